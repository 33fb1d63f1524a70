//! The paper's method in its generality: curves of n parameters, given by n pixels.

mod circle;
mod ellipse;
mod line;

pub(crate) use circle::{circles_of_radius, longest_outline};
pub use ellipse::Ellipse;
pub use line::Line;

use crate::edges::EdgePixel;

/// A curve `f(x, y, a1..an) = 0` that n pixels determine (section 2.1, equation 1).
///
/// [`CurveSearch`](crate::CurveSearch) finds any such curve. The crate has [`Line`] (n = 2), [`Circle`](crate::Circle)
/// (n = 3) and [`Ellipse`] (n = 5).
pub trait Curve: Sized {
    /// The number n of parameters, and of the pixels that determine them.
    const PARAMETERS: usize;

    /// The curve through [`PARAMETERS`](Curve::PARAMETERS) pixels; none if they lie too near to one
    /// another or in such a way that they determine none. Every number of a curve that is returned
    /// is finite.
    fn through(pixels: &[EdgePixel]) -> Option<Self>;

    /// Visits the pixels of the estimated curve, each once, until `visit` says false; true if it
    /// never did.
    ///
    /// This is the denominator of β. A closed curve visits its pixels outside the frame of `width`
    /// x `height` too; one without end visits those inside.
    fn outline(&self, width: u32, height: u32, visit: impl FnMut(i32, i32) -> bool) -> bool;

    /// The distance of a point from the curve, pixels: what decides whether an accepted curve
    /// explains an edge pixel.
    fn distance(&self, x: f64, y: f64) -> f64;
}

/// The least distance between two pixels of a draw, pixels: nearer ones say little about a curve
/// but their own rounding.
const MIN_SPACING: u32 = 3;

/// Whether any two of the pixels are nearer than [`MIN_SPACING`].
fn crowded(pixels: &[EdgePixel]) -> bool {
    pixels.iter().enumerate().any(|(place, a)| {
        pixels[..place].iter().any(|b| {
            let (dx, dy) = (a.x.abs_diff(b.x), a.y.abs_diff(b.y));
            dx < MIN_SPACING && dy < MIN_SPACING && dx * dx + dy * dy < MIN_SPACING * MIN_SPACING
        })
    })
}

/// The whole number nearest to a coordinate; halves go up.
pub(crate) fn round(value: f64) -> i32 {
    (value + 0.5).floor() as i32
}
