//! The outline of a ball in the image.

use std::f64::consts::TAU;

use hough_heuristic::Circle;
use nalgebra::Point2;

/// An ellipse in the image, pixels ((0, 0) is the centre of the top-left pixel, x to the right, y downward).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Ellipse {
    /// Centre.
    pub centre: Point2<f64>,
    /// The longer semi-axis.
    pub major: f64,
    /// The shorter semi-axis.
    pub minor: f64,
    /// Direction of the longer axis, radians from +x toward +y.
    pub angle: f64,
}

/// Points on an outline at which shares and moments are taken.
const OUTLINE: usize = 256;

impl Ellipse {
    /// The circle of equal mean radius: same centre, radius the mean of the semi-axes.
    pub fn circle(&self) -> Circle {
        Circle {
            x: self.centre.x,
            y: self.centre.y,
            radius: 0.5 * (self.major + self.minor),
        }
    }

    /// The point of the outline at the eccentric angle `t`, radians from the longer axis.
    pub fn point(&self, t: f64) -> Point2<f64> {
        let ((sin_t, cos_t), (sin, cos)) = (t.sin_cos(), self.angle.sin_cos());
        let (u, v) = (self.major * cos_t, self.minor * sin_t);
        Point2::new(
            self.centre.x + u * cos - v * sin,
            self.centre.y + u * sin + v * cos,
        )
    }

    /// Half the width and half the height of the upright box around the ellipse.
    pub fn half_extent(&self) -> (f64, f64) {
        let (sin, cos) = self.angle.sin_cos();
        (
            (self.major * cos).hypot(self.minor * sin),
            (self.major * sin).hypot(self.minor * cos),
        )
    }

    /// The share of the outline, 0..=1, that lies inside a frame of `width` x `height` pixels, whose border runs half a pixel
    /// outside the outer pixel centres.
    pub fn share_inside(&self, width: u32, height: u32) -> f64 {
        let (right, bottom) = (f64::from(width) - 0.5, f64::from(height) - 0.5);
        let (w, h) = self.half_extent();
        let (x, y) = (self.centre.x, self.centre.y);
        if x - w >= -0.5 && x + w <= right && y - h >= -0.5 && y + h <= bottom {
            return 1.0;
        }
        if x + w < -0.5 || x - w > right || y + h < -0.5 || y - h > bottom {
            return 0.0;
        }
        // A unit vector turned step by step: no sine inside the loop.
        let (turn_sin, turn_cos) = (TAU / OUTLINE as f64).sin_cos();
        let (angle_sin, angle_cos) = self.angle.sin_cos();
        let (mut sin, mut cos) = (0.5 * TAU / OUTLINE as f64).sin_cos();
        let mut inside = 0;
        for _ in 0..OUTLINE {
            let (u, v) = (self.major * cos, self.minor * sin);
            let (px, py) = (
                x + u * angle_cos - v * angle_sin,
                y + u * angle_sin + v * angle_cos,
            );
            inside += u32::from(px >= -0.5 && px <= right && py >= -0.5 && py <= bottom);
            (sin, cos) = (sin * turn_cos + cos * turn_sin, cos * turn_cos - sin * turn_sin);
        }
        f64::from(inside) / OUTLINE as f64
    }

    /// The ellipse with the area and second moments of a closed outline, given as a function of an angle 0..2 pi.
    pub(crate) fn of_outline(point: impl Fn(f64) -> Point2<f64>) -> Self {
        let points: [Point2<f64>; OUTLINE] = std::array::from_fn(|i| point(i as f64 * TAU / OUTLINE as f64));
        // Moments about the first point, by Green's theorem over the polygon, then about the centroid.
        let origin = points[0];
        let (mut area, mut mx, mut my, mut mxx, mut mxy, mut myy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for i in 0..OUTLINE {
            let (p, q) = (points[i] - origin, points[(i + 1) % OUTLINE] - origin);
            let cross = p.x * q.y - q.x * p.y;
            area += cross / 2.0;
            mx += cross * (p.x + q.x) / 6.0;
            my += cross * (p.y + q.y) / 6.0;
            mxx += cross * (p.x * p.x + p.x * q.x + q.x * q.x) / 12.0;
            myy += cross * (p.y * p.y + p.y * q.y + q.y * q.y) / 12.0;
            mxy += cross * (p.x * (2.0 * p.y + q.y) + q.x * (p.y + 2.0 * q.y)) / 24.0;
        }
        let (cx, cy) = (mx / area, my / area);
        let (xx, xy, yy) = (mxx / area - cx * cx, mxy / area - cx * cy, myy / area - cy * cy);
        let (mean, half) = ((xx + yy) / 2.0, ((xx - yy) / 2.0).hypot(xy));
        // A regular polygon has a little less spread than its circle; this makes an ellipse come out exactly.
        let polygon = 3.0 / (2.0 + (TAU / OUTLINE as f64).cos());
        Self {
            centre: Point2::new(origin.x + cx, origin.y + cy),
            major: 2.0 * ((mean + half) * polygon).sqrt(),
            minor: 2.0 * ((mean - half).max(0.0) * polygon).sqrt(),
            angle: 0.5 * (2.0 * xy).atan2(xx - yy),
        }
    }
}
