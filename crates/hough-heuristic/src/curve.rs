//! Curves of n parameters that n pixels determine.

mod circle;
mod ellipse;
mod line;

pub(crate) use circle::{circles_of_radius, longest_outline};
pub use ellipse::Ellipse;
pub(crate) use ellipse::solve;
pub use line::Line;

use crate::edges::EdgePixel;

/// A curve `f(x, y, a1..an) = 0` that n pixels determine (section 2.1, equation 1).
///
/// [`CurveSearch`](crate::CurveSearch) finds any such curve. The crate has [`Line`] (n = 2),
/// [`Circle`](crate::Circle) (n = 3) and [`Ellipse`] (n = 5).
pub trait Curve: Sized {
    /// The number n of parameters, and of the pixels that determine them.
    const PARAMETERS: usize;

    /// Returns the curve through [`PARAMETERS`](Curve::PARAMETERS) pixels; `None` if they are too
    /// near to one another or do not determine one. All numbers of the curve are finite.
    fn through(pixels: &[EdgePixel]) -> Option<Self>;

    /// Visits the pixels of the curve, each once, until `visit` returns `false`; returns `true` if
    /// it never did.
    ///
    /// The number of these pixels is the denominator of β. A closed curve visits its pixels outside
    /// the frame of `width` x `height` too; one without end visits those inside.
    fn outline(&self, width: u32, height: u32, visit: impl FnMut(i32, i32) -> bool) -> bool;

    /// Returns the distance of a point from the curve, pixels. An accepted curve explains the edge
    /// pixels near it.
    fn distance(&self, x: f64, y: f64) -> f64;
}

/// Smallest distance between two pixels of a draw, pixels. Nearer ones mostly show their own
/// rounding.
const MIN_SPACING: u32 = 3;

/// Returns `true` if any two of the pixels are nearer than [`MIN_SPACING`].
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
