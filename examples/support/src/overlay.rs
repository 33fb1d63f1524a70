//! Circles and words drawn over a frame.

use embedded_graphics::mono_font::MonoTextStyle;
use embedded_graphics::mono_font::iso_8859_1::FONT_10X20;
pub use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::pixelcolor::RgbColor;
use embedded_graphics::prelude::*;
use embedded_graphics::primitives::{Circle as Ring, Line, PrimitiveStyle, Rectangle};
use embedded_graphics::text::{Baseline, Text};
use hough_heuristic::Circle;
use image::{DynamicImage, GrayImage, Rgb, RgbImage};

/// Height of a caption, pixels.
pub const CAPTION: u32 = 24;

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

    /// Draws a found circle: its outline and its centre, clipped to the frame.
    pub fn circle(&mut self, circle: &Circle) {
        let green = Rgb888::new(60, 255, 60);
        let centre = Point::new(circle.x.round() as i32, circle.y.round() as i32);
        let diameter = (2.0 * circle.radius).round().max(1.0) as u32;
        let outline =
            Ring::with_center(centre, diameter).into_styled(PrimitiveStyle::with_stroke(green, 3));
        let Ok(()) = outline.draw(self);
        let arm = ((circle.radius * 0.15) as i32).clamp(3, 12);
        for along in [Point::new(arm, 0), Point::new(0, arm)] {
            let Ok(()) = Line::new(centre - along, centre + along)
                .into_styled(PrimitiveStyle::with_stroke(green, 1))
                .draw(self);
        }
    }

    /// Draws a straight line.
    pub fn line(&mut self, from: (f64, f64), to: (f64, f64), colour: Rgb888, width: u32) {
        let at = |(x, y): (f64, f64)| Point::new(x.round() as i32, y.round() as i32);
        let style = PrimitiveStyle::with_stroke(colour, width);
        let Ok(()) = Line::new(at(from), at(to)).into_styled(style).draw(self);
    }

    /// Draws a filled disc.
    pub fn disc(&mut self, centre: (f64, f64), radius: f64, colour: Rgb888) {
        let at = Point::new(centre.0.round() as i32, centre.1.round() as i32);
        let diameter = (2.0 * radius).round().max(1.0) as u32;
        let Ok(()) = Ring::with_center(at, diameter)
            .into_styled(PrimitiveStyle::with_fill(colour))
            .draw(self);
    }

    /// Draws a closed curve, given as a function of an angle.
    pub fn closed(&mut self, point: impl Fn(f64) -> (f64, f64)) {
        const CORNERS: u32 = 120;
        let at = |corner: u32| {
            let (x, y) = point(std::f64::consts::TAU * f64::from(corner) / f64::from(CORNERS));
            Point::new(x.round() as i32, y.round() as i32)
        };
        let style = PrimitiveStyle::with_stroke(Rgb888::new(60, 255, 60), 3);
        for corner in 0..CORNERS {
            let Ok(()) = Line::new(at(corner), at(corner + 1))
                .into_styled(style)
                .draw(self);
        }
    }

    /// Draws a caption on a dark bar over the top of the picture.
    fn caption(&mut self, words: &str) {
        let bar = Rectangle::new(Point::zero(), Size::new(self.0.width(), CAPTION));
        let Ok(()) = bar
            .into_styled(PrimitiveStyle::with_fill(Rgb888::new(20, 20, 40)))
            .draw(self);
        let style = MonoTextStyle::new(&FONT_10X20, Rgb888::YELLOW);
        let Ok(_) = Text::with_baseline(words, Point::new(6, 2), style, Baseline::Top).draw(self);
    }

    /// Adds a caption in a dark strip above the picture.
    pub fn captioned(self, words: &str) -> Self {
        let mut higher = RgbImage::new(self.0.width(), self.0.height() + CAPTION);
        image::imageops::replace(&mut higher, &self.0, 0, i64::from(CAPTION));
        let mut captioned = Self(higher);
        captioned.caption(words);
        captioned
    }

    /// Returns the picture.
    pub fn into_image(self) -> RgbImage {
        self.0
    }
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
