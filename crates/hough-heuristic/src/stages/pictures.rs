//! Pictures of a detection and of its stages.

use std::io;
use std::path::{Path, PathBuf};

use image::{DynamicImage, GrayImage, Rgb, RgbImage};

use super::Stages;
use crate::circle::Circle;
use crate::curve::Curve;
#[cfg(feature = "program")]
use crate::curve::Ellipse;
use crate::detect::Detection;
use crate::output::write_png;

const LIGHT: Rgb<u8> = Rgb([255, 230, 90]);
const EXPLAINED: Rgb<u8> = Rgb([80, 150, 255]);
const CANDIDATE: Rgb<u8> = Rgb([255, 140, 0]);
const FOUND: Rgb<u8> = Rgb([60, 255, 60]);

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
        let edges = DynamicImage::ImageLuma8(self.edges.image().clone()).into_rgb8();
        let mut structure = darkened(frame, 3);
        for pixel in self.edges.pixels() {
            let explained = found
                .iter()
                .any(|detection| self.explains(&detection.circle, *pixel));
            let color = if explained { EXPLAINED } else { LIGHT };
            plot(&mut structure, pixel.x as i32, pixel.y as i32, color);
        }
        let mut candidates = darkened(frame, 2);
        for circle in self.candidates {
            draw(&mut candidates, circle, CANDIDATE);
        }
        let pictures = [
            ("1_edges.png", edges),
            ("2_structure.png", structure),
            ("3_candidates.png", candidates),
            ("4_accepted.png", with_circles(darkened(frame, 1), found)),
        ];
        let paths = pictures.each_ref().map(|(name, _)| folder.join(name));
        for (path, (_, picture)) in paths.iter().zip(&pictures) {
            write_png(path, picture)?;
        }
        Ok(paths)
    }
}

/// Draws the circles found and their centers into a picture.
pub(crate) fn with_circles(mut picture: RgbImage, found: &[Detection]) -> RgbImage {
    for &Detection { circle, .. } in found {
        for radius in [circle.radius - 0.5, circle.radius + 0.5] {
            draw(&mut picture, &Circle { radius, ..circle }, FOUND);
        }
        cross(&mut picture, circle.x, circle.y);
    }
    picture
}

/// Draws ellipses and their centers into a picture.
#[cfg(feature = "program")]
pub(crate) fn with_ellipses(mut picture: RgbImage, ellipses: &[Ellipse]) -> RgbImage {
    for &ellipse in ellipses {
        for wider in [-0.5, 0.5] {
            let (major, minor) = (ellipse.major + wider, ellipse.minor + wider);
            let outline = Ellipse {
                major,
                minor,
                ..ellipse
            };
            draw(&mut picture, &outline, FOUND);
        }
        cross(&mut picture, ellipse.x, ellipse.y);
    }
    picture
}

fn cross(picture: &mut RgbImage, x: f64, y: f64) {
    let (x, y) = (x.round() as i32, y.round() as i32);
    for step in -4..=4 {
        plot(picture, x.saturating_add(step), y, FOUND);
        plot(picture, x, y.saturating_add(step), FOUND);
    }
}

fn darkened(frame: &GrayImage, divisor: u8) -> RgbImage {
    RgbImage::from_fn(frame.width(), frame.height(), |x, y| {
        Rgb([frame.get_pixel(x, y).0[0] / divisor; 3])
    })
}

fn draw(picture: &mut RgbImage, curve: &impl Curve, color: Rgb<u8>) {
    curve.outline(picture.width(), picture.height(), |x, y| {
        plot(picture, x, y, color);
        true
    });
}

/// Sets a pixel, if it is in the picture.
fn plot(picture: &mut RgbImage, x: i32, y: i32, color: Rgb<u8>) {
    if let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y))
        && let Some(pixel) = picture.get_pixel_mut_checked(x, y)
    {
        *pixel = color;
    }
}
