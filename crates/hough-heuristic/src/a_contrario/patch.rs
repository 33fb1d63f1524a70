//! A part of the frame drawn so that an ellipse in it becomes a circle.

use image::{GrayImage, Luma};

use super::halve;
use super::measure::Measured;
use super::polar::Ring;
use super::prover::{Pyramid, Size};
use crate::curve::Ellipse;

/// Pixels beyond the circle that are drawn: in radii, and in addition.
const BEYOND: f64 = 0.4;
const MORE: f64 = 16.0;

/// A square part of a frame in which an ellipse is a circle of the same area about the middle.
pub(super) struct Patch {
    pub(super) gray: GrayImage,
    pub(super) sizes: Vec<Size>,
    /// Place of the circle's centre in the frame.
    centre: (f64, f64),
    /// Columns of the matrix that turns pixels of the patch into those of the frame.
    across: (f64, f64),
    down: (f64, f64),
    /// Column and row of the circle's centre.
    middle: f64,
    radius: f64,
}

impl Patch {
    /// Draws the patch from the frame halved `depth` times.
    pub(super) fn new(pyramid: Pyramid<'_>, ellipse: &Ellipse, depth: usize) -> Self {
        let scale = f64::from(1 << depth);
        let radius = (ellipse.major * ellipse.minor).sqrt() / scale;
        let middle = ((1.0 + BEYOND) * radius + MORE).ceil();
        let (sin, cos) = ellipse.angle.sin_cos();
        let (long, short) = (ellipse.major / radius, ellipse.minor / radius);
        let mut patch = Self {
            gray: GrayImage::default(),
            sizes: Vec::new(),
            centre: (ellipse.x, ellipse.y),
            across: (long * cos, long * sin),
            down: (-short * sin, short * cos),
            middle,
            radius,
        };
        let from = pyramid.gray(depth);
        let corner = 0.5 * (scale - 1.0);
        let side = 2 * middle as u32 + 1;
        // The same in pixels of the halved frame.
        let place = patch.in_frame(0.0, 0.0);
        let [x0, y0] = [place.0, place.1].map(|at| ((at - corner) / scale) as f32);
        let [ax, ay, dx, dy] = [patch.across.0, patch.across.1, patch.down.0, patch.down.1]
            .map(|step| (step / scale) as f32);
        let (right, bottom) = (
            (from.width - 1) as f32 - 0.01,
            (from.height - 1) as f32 - 0.01,
        );
        patch.gray = GrayImage::from_fn(side, side, |column, row| {
            let (column, row) = (column as f32, row as f32);
            let x = (x0 + column * ax + row * dx).clamp(0.0, right);
            let y = (y0 + column * ay + row * dy).clamp(0.0, bottom);
            let (left, top) = (x as usize, y as usize);
            let (fx, fy) = (x - left as f32, y - top as f32);
            let at = top * from.width + left;
            let [a, b, c, d] = [at, at + 1, at + from.width, at + from.width + 1]
                .map(|pixel| f32::from(from.pixels[pixel]));
            let (upper, lower) = (a + (b - a) * fx, c + (d - c) * fx);
            Luma([(upper + (lower - upper) * fy + 0.5) as u8])
        });
        let mut left = radius;
        while left >= 12.0 {
            let mut size = Size::default();
            let (gray, width) = match patch.sizes.last() {
                Some(last) => (&last.gray, last.width),
                None => (patch.gray.as_raw(), side as usize),
            };
            (size.width, size.height) = halve::halve(gray, width, &mut size.gray);
            patch.sizes.push(size);
            left *= 0.5;
        }
        patch
    }

    pub(super) fn pyramid(&self) -> Pyramid<'_> {
        Pyramid {
            frame: &self.gray,
            sizes: &self.sizes,
        }
    }

    /// The circle that the ellipse became, in pixels of the patch.
    pub(super) fn ring(&self) -> Ring {
        Ring {
            x: self.middle as f32,
            y: self.middle as f32,
            r: self.radius as f32,
        }
    }

    /// A place of the patch in pixels of the frame.
    pub(super) fn in_frame(&self, x: f64, y: f64) -> (f64, f64) {
        let (x, y) = (x - self.middle, y - self.middle);
        (
            self.centre.0 + x * self.across.0 + y * self.down.0,
            self.centre.1 + x * self.across.1 + y * self.down.1,
        )
    }

    /// The ellipse of the frame whose image in the patch was measured.
    pub(super) fn ellipse(&self, measured: &Measured) -> Ellipse {
        let [x, y, r, cos2, sin2] = [
            measured.ring.x,
            measured.ring.y,
            measured.ring.r,
            measured.cos2,
            measured.sin2,
        ]
        .map(f64::from);
        let column = |one: f64, other: f64| {
            (
                one * self.across.0 + other * self.down.0,
                one * self.across.1 + other * self.down.1,
            )
        };
        let (u, v) = (column(r + cos2, sin2), column(sin2, r - cos2));
        // The squares of the half-axes are the eigenvalues of the matrix times its transpose.
        let (xx, xy, yy) = (
            u.0 * u.0 + v.0 * v.0,
            u.0 * u.1 + v.0 * v.1,
            u.1 * u.1 + v.1 * v.1,
        );
        let (mean, half) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
        let (x, y) = self.in_frame(x, y);
        Ellipse {
            x,
            y,
            major: (mean + half).sqrt(),
            minor: (mean - half).max(0.0).sqrt(),
            angle: 0.5 * (2.0 * xy).atan2(xx - yy),
        }
    }
}
