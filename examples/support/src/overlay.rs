//! Circles and words drawn over a frame.

use embedded_graphics::mono_font::iso_8859_1::{FONT_6X10, FONT_10X20};
use embedded_graphics::mono_font::{MonoTextStyle, MonoTextStyleBuilder};
pub use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::pixelcolor::RgbColor;
use embedded_graphics::prelude::*;
use embedded_graphics::primitives::{Circle as Ring, Line, PrimitiveStyle, StyledDrawable};
use embedded_graphics::text::{Baseline, Text};
use hough_heuristic::Circle;
use image::{DynamicImage, GrayImage, Rgb, RgbImage};

/// Height of a caption, pixels.
pub const CAPTION: u32 = 24;
/// Colour of what was found.
const FOUND: Rgb888 = Rgb888::new(60, 255, 60);

/// A frame to draw on.
#[derive(Clone, Debug)]
pub struct Overlay(RgbImage);

impl From<RgbImage> for Overlay {
    fn from(picture: RgbImage) -> Self {
        Self(picture)
    }
}

impl Overlay {
    /// Returns a color copy of a gray frame to draw on.
    pub fn new(frame: &GrayImage) -> Self {
        Self(DynamicImage::ImageLuma8(frame.clone()).into_rgb8())
    }

    fn stroke<S>(&mut self, shape: &S, style: PrimitiveStyle<Rgb888>)
    where
        S: StyledDrawable<PrimitiveStyle<Rgb888>, Color = Rgb888, Output = ()>,
    {
        let Ok(()) = shape.draw_styled(&style, self);
    }

    /// Draws a found circle: its outline and its centre, clipped to the frame.
    pub fn circle(&mut self, circle: &Circle) {
        let diameter = (2.0 * circle.radius).round().max(1.0) as u32;
        let ring = Ring::with_center(point((circle.x, circle.y)), diameter);
        self.stroke(&ring, PrimitiveStyle::with_stroke(FOUND, 3));
        let arm = ((circle.radius * 0.15) as i32).clamp(3, 12);
        for along in [Point::new(arm, 0), Point::new(0, arm)] {
            let centre = point((circle.x, circle.y));
            let cross = Line::new(centre - along, centre + along);
            self.stroke(&cross, PrimitiveStyle::with_stroke(FOUND, 1));
        }
    }

    /// Draws a straight line.
    pub fn line(&mut self, from: (f64, f64), to: (f64, f64), colour: Rgb888, width: u32) {
        let line = Line::new(point(from), point(to));
        self.stroke(&line, PrimitiveStyle::with_stroke(colour, width));
    }

    /// Draws a filled disc.
    pub fn disc(&mut self, centre: (f64, f64), radius: f64, colour: Rgb888) {
        let diameter = (2.0 * radius).round().max(1.0) as u32;
        let disc = Ring::with_center(point(centre), diameter);
        self.stroke(&disc, PrimitiveStyle::with_fill(colour));
    }

    /// Draws a closed curve, given as a function of an angle.
    pub fn closed(&mut self, curve: impl Fn(f64) -> (f64, f64)) {
        const CORNERS: u32 = 120;
        let at = |corner| curve(std::f64::consts::TAU * f64::from(corner) / f64::from(CORNERS));
        for corner in 0..CORNERS {
            self.line(at(corner), at(corner + 1), FOUND, 3);
        }
    }

    /// Writes small words into the top left corner.
    pub fn label(&mut self, words: &str) {
        let style = MonoTextStyleBuilder::new()
            .font(&FONT_6X10)
            .text_color(Rgb888::YELLOW)
            .background_color(Rgb888::new(20, 20, 40))
            .build();
        let text = Text::with_baseline(words, Point::zero(), style, Baseline::Top);
        let Ok(_) = text.draw(self);
    }

    /// Adds a caption in a dark strip above the picture.
    pub fn captioned(self, words: &str) -> RgbImage {
        let dark = Rgb([20, 20, 40]);
        let mut higher = RgbImage::from_pixel(self.0.width(), self.0.height() + CAPTION, dark);
        image::imageops::replace(&mut higher, &self.0, 0, i64::from(CAPTION));
        let mut captioned = Self(higher);
        let style = MonoTextStyle::new(&FONT_10X20, Rgb888::YELLOW);
        let text = Text::with_baseline(words, Point::new(6, 2), style, Baseline::Top);
        let Ok(_) = text.draw(&mut captioned);
        captioned.0
    }

    /// Returns the picture.
    pub fn into_image(self) -> RgbImage {
        self.0
    }
}

fn point((x, y): (f64, f64)) -> Point {
    Point::new(x.round() as i32, y.round() as i32)
}

impl OriginDimensions for Overlay {
    fn size(&self) -> Size {
        Size::new(self.0.width(), self.0.height())
    }
}

impl DrawTarget for Overlay {
    type Color = Rgb888;
    type Error = std::convert::Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb888>>>(
        &mut self,
        pixels: I,
    ) -> Result<(), Self::Error> {
        for Pixel(at, colour) in pixels {
            if let (Ok(x), Ok(y)) = (u32::try_from(at.x), u32::try_from(at.y))
                && let Some(pixel) = self.0.get_pixel_mut_checked(x, y)
            {
                *pixel = Rgb([colour.r(), colour.g(), colour.b()]);
            }
        }
        Ok(())
    }
}
