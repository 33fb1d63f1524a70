//! Pictures of the stages of a detection.

use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use image::{GrayImage, Rgb, RgbImage};

use crate::circle::Circle;
use crate::curve::Curve;
use crate::detect::{Detection, Stages};

/// A picture could not be written.
#[derive(Debug, thiserror::Error)]
#[error("{}: {reason}", path.display())]
pub struct StageError {
    /// The file.
    pub path: PathBuf,
    /// What went wrong.
    pub reason: String,
}

/// Writes a picture of each stage of a detection into a folder, which must exist, and returns their
/// paths.
///
/// * `1_edges.png`: the edge image.
/// * `2_structure.png`: the structure `D` over the darkened frame, what the circles found explain
///   in blue.
/// * `3_candidates.png`: the candidates that were looked at closely, over the frame.
/// * `4_accepted.png`: the circles found, over the frame.
///
/// The stages are those of any detector
/// ([`CircleDetector::stages`](crate::CircleDetector::stages)), candidates included if they were
/// [kept](crate::CircleDetector::keep_candidates). Each file appears complete or not at all, and
/// replaces one of its name; what has its name and is no regular file (a device, a pipe) is written
/// to as it is, never replaced, and a link stays a link.
///
/// # Errors
/// The first file that cannot be written.
pub fn write_stages(
    folder: &Path,
    frame: &GrayImage,
    stages: &Stages<'_>,
    found: &[Detection],
) -> Result<[PathBuf; 4], StageError> {
    const LIGHT: Rgb<u8> = Rgb([255, 230, 90]);
    const EXPLAINED: Rgb<u8> = Rgb([80, 150, 255]);
    const CANDIDATE: Rgb<u8> = Rgb([255, 140, 0]);
    const FOUND: Rgb<u8> = Rgb([60, 255, 60]);
    let edges = stages.edges;
    let colour = |dim: u8| {
        RgbImage::from_fn(frame.width(), frame.height(), |x, y| {
            let grey = frame.get_pixel(x, y).0[0] / dim;
            Rgb([grey, grey, grey])
        })
    };
    let edge_image = RgbImage::from_fn(edges.width(), edges.height(), |x, y| {
        Rgb([edges.image().get_pixel(x, y).0[0]; 3])
    });
    let mut structure = colour(3);
    for pixel in edges.pixels() {
        let explained = found
            .iter()
            .any(|detection| stages.explains(&detection.circle, *pixel));
        plot(
            &mut structure,
            pixel.x as i32,
            pixel.y as i32,
            if explained { EXPLAINED } else { LIGHT },
        );
    }
    let mut tried = colour(2);
    for circle in stages.candidates {
        draw(&mut tried, circle, CANDIDATE);
    }
    let mut accepted = colour(1);
    for detection in found {
        let circle = detection.circle;
        for radius in [circle.radius - 0.5, circle.radius + 0.5] {
            draw(&mut accepted, &Circle { radius, ..circle }, FOUND);
        }
        for step in -4..=4 {
            let (x, y) = (circle.x.round() as i32, circle.y.round() as i32);
            plot(&mut accepted, x.saturating_add(step), y, FOUND);
            plot(&mut accepted, x, y.saturating_add(step), FOUND);
        }
    }
    Ok([
        write(folder, "1_edges.png", &edge_image)?,
        write(folder, "2_structure.png", &structure)?,
        write(folder, "3_candidates.png", &tried)?,
        write(folder, "4_accepted.png", &accepted)?,
    ])
}

fn draw(picture: &mut RgbImage, circle: &Circle, colour: Rgb<u8>) {
    circle.outline(picture.width(), picture.height(), |x, y| {
        plot(picture, x, y, colour);
        true
    });
}

/// Sets a pixel, if it is in the picture.
fn plot(picture: &mut RgbImage, x: i32, y: i32, colour: Rgb<u8>) {
    if let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y))
        && let Some(pixel) = picture.get_pixel_mut_checked(x, y)
    {
        *pixel = colour;
    }
}

fn write(folder: &Path, name: &str, picture: &RgbImage) -> Result<PathBuf, StageError> {
    let path = folder.join(name);
    let mut png = Cursor::new(Vec::new());
    let written = picture
        .write_to(&mut png, image::ImageFormat::Png)
        .map_err(|error| error.to_string())
        .and_then(|()| write_whole(&path, png.get_ref()).map_err(|error| error.to_string()));
    match written {
        Ok(()) => Ok(path),
        Err(reason) => Err(StageError { path, reason }),
    }
}

/// Writes a file beside its place and renames it. What is there and is no regular file is written
/// to as it is, not replaced; a link stays a link.
fn write_whole(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    if fs::metadata(&target).is_ok_and(|there| !there.is_file()) {
        return fs::write(&target, bytes);
    }
    let mut beside = target.as_os_str().to_owned();
    beside.push(".part");
    let written = fs::write(&beside, bytes).and_then(|()| fs::rename(&beside, &target));
    if written.is_err() {
        // Best effort: the error that matters is the one above.
        let _ = fs::remove_file(&beside);
    }
    written
}
