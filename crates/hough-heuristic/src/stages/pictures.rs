//! Pictures of the stages of a detection.

use std::fs;
use std::io::{self, Cursor};
use std::path::{Path, PathBuf};

use image::{GrayImage, Rgb, RgbImage};

use super::Stages;
use crate::circle::Circle;
use crate::curve::Curve;
use crate::detect::Detection;

impl Stages<'_> {
    /// Writes a picture of each stage into a folder, which must exist, and returns their paths.
    ///
    /// * `1_edges.png`: the edge image.
    /// * `2_structure.png`: the structure `D` over the darkened frame; the pixels that the circles
    ///   found explain are blue.
    /// * `3_candidates.png`: the candidates over the frame, if the detector keeps them.
    /// * `4_accepted.png`: the circles found, over the frame.
    ///
    /// Each file appears complete or not at all, and replaces one of its name. A device, a pipe or
    /// another file that is not regular is written to and never replaced; a link stays a link.
    ///
    /// # Errors
    /// The first file that cannot be written; the text names it.
    pub fn write(
        &self,
        folder: &Path,
        frame: &GrayImage,
        found: &[Detection],
    ) -> io::Result<[PathBuf; 4]> {
        const LIGHT: Rgb<u8> = Rgb([255, 230, 90]);
        const EXPLAINED: Rgb<u8> = Rgb([80, 150, 255]);
        const CANDIDATE: Rgb<u8> = Rgb([255, 140, 0]);
        const FOUND: Rgb<u8> = Rgb([60, 255, 60]);
        let edges = self.edges;
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
                .any(|detection| self.explains(&detection.circle, *pixel));
            plot(
                &mut structure,
                pixel.x as i32,
                pixel.y as i32,
                if explained { EXPLAINED } else { LIGHT },
            );
        }
        let mut tried = colour(2);
        for circle in self.candidates {
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

fn write(folder: &Path, name: &str, picture: &RgbImage) -> io::Result<PathBuf> {
    let path = folder.join(name);
    let mut png = Cursor::new(Vec::new());
    picture
        .write_to(&mut png, image::ImageFormat::Png)
        .map_err(io::Error::other)
        .and_then(|()| write_whole(&path, png.get_ref()))
        .map_err(|error| io::Error::new(error.kind(), format!("{}: {error}", path.display())))?;
    Ok(path)
}

/// Writes a file beside its place and renames it. What is there and is no regular file is written
/// to as it is, not replaced; a link stays a link.
fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
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
