//! The outline of a ball in the image.

use std::f64::consts::{PI, TAU};

use hough_heuristic::Circle;
use nalgebra::Point2;

/// An ellipse in the image, pixels ((0, 0) is the centre of the top-left pixel, x to the right, y
/// downward).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ProjectedEllipse {
    /// Centre.
    pub centre: Point2<f64>,
    /// The longer semi-axis.
    pub major: f64,
    /// The shorter semi-axis.
    pub minor: f64,
    /// Direction of the longer axis, radians from +x toward +y.
    pub angle: f64,
}

/// Number of points on an outline at which moments are taken.
const OUTLINE: usize = 256;

impl ProjectedEllipse {
    /// Returns the circle with this centre and the mean of the semi-axes as radius.
    pub fn circle(&self) -> Circle {
        Circle {
            x: self.centre.x,
            y: self.centre.y,
            radius: 0.5 * (self.major + self.minor),
        }
    }

    /// Returns the point of the outline at the eccentric angle `t`, radians from the longer axis.
    pub fn point(&self, t: f64) -> Point2<f64> {
        let ((sin_t, cos_t), (sin, cos)) = (t.sin_cos(), self.angle.sin_cos());
        let (u, v) = (self.major * cos_t, self.minor * sin_t);
        Point2::new(
            self.centre.x + u * cos - v * sin,
            self.centre.y + u * sin + v * cos,
        )
    }

    /// Returns half the width and half the height of the upright box around the ellipse.
    pub(crate) fn half_extent(&self) -> (f64, f64) {
        let (sin, cos) = self.angle.sin_cos();
        (
            (self.major * cos).hypot(self.minor * sin),
            (self.major * sin).hypot(self.minor * cos),
        )
    }

    /// Returns the fraction of the outline, 0..=1, that lies inside a frame of `width` x `height`
    /// pixels, whose border runs half a pixel outside the outer pixel centres. It is measured in
    /// the eccentric angle, which is close to the length for a nearly round outline.
    pub fn share_inside(&self, width: u32, height: u32) -> f64 {
        let (right, bottom) = (f64::from(width) - 0.5, f64::from(height) - 0.5);
        let (x, y) = (self.centre.x, self.centre.y);
        // No half extent is above the longer axis.
        let inside = |at: f64, last: f64| at - self.major >= -0.5 && at + self.major <= last;
        if inside(x, right) && inside(y, bottom) {
            return 1.0;
        }
        let (w, h) = self.half_extent();
        if x - w >= -0.5 && x + w <= right && y - h >= -0.5 && y + h <= bottom {
            return 1.0;
        }
        if x + w < -0.5 || x - w > right || y + h < -0.5 || y - h > bottom {
            return 0.0;
        }
        // With t the eccentric angle, x runs as w cos(t - s) about its middle and y as h cos(t -
        // u): each border cuts off one arc of t.
        let (sin, cos) = self.angle.sin_cos();
        let (s, u) = (
            (-self.minor * sin).atan2(self.major * cos),
            (self.minor * cos).atan2(self.major * sin),
        );
        let beyond = |gap: f64, reach: f64| {
            if gap >= reach {
                0.0
            } else {
                (gap / reach).max(-1.0).acos()
            }
        };
        // Middle and half length of the arcs beyond the right, lower, left and upper border.
        let arcs = [
            (s, beyond(right - x, w)),
            (u, beyond(bottom - y, h)),
            (s + PI, beyond(x + 0.5, w)),
            (u + PI, beyond(y + 0.5, h)),
        ];
        let mut outside: f64 = arcs.iter().map(|arc| 2.0 * arc.1).sum();
        // Points beyond a corner of the frame are counted for both of its borders.
        for i in 0..4 {
            let (a, b) = (arcs[i], arcs[(i + 1) % 4]);
            if a.1 > 0.0 && b.1 > 0.0 {
                let apart = ((a.0 - b.0).rem_euclid(TAU) - PI).abs();
                let apart = PI - apart;
                for distance in [apart, TAU - apart] {
                    outside -= (a.1 + b.1 - distance).min(2.0 * a.1.min(b.1)).max(0.0);
                }
            }
        }
        (1.0 - outside / TAU).clamp(0.0, 1.0)
    }

    /// Returns the ellipse with the area and second moments of a closed outline, given as a
    /// function of an angle 0..2 pi; `None` if a point of it has no pixel.
    pub(crate) fn of_outline(point: impl Fn(f64) -> Option<Point2<f64>>) -> Option<Self> {
        let mut points = [Point2::origin(); OUTLINE];
        for (i, place) in points.iter_mut().enumerate() {
            *place = point(i as f64 * TAU / OUTLINE as f64)?;
        }
        // Moments about the first point, by Green's theorem over the polygon, then about the
        // centroid.
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
        let (xx, xy, yy) = (
            mxx / area - cx * cx,
            mxy / area - cx * cy,
            myy / area - cy * cy,
        );
        let (mean, half) = ((xx + yy) / 2.0, ((xx - yy) / 2.0).hypot(xy));
        // Corrects for the smaller spread of a polygon, so that an ellipse comes out exactly.
        let polygon = 3.0 / (2.0 + (TAU / OUTLINE as f64).cos());
        Some(Self {
            centre: Point2::new(origin.x + cx, origin.y + cy),
            major: 2.0 * ((mean + half) * polygon).sqrt(),
            minor: 2.0 * ((mean - half).max(0.0) * polygon).sqrt(),
            angle: 0.5 * (2.0 * xy).atan2(xx - yy),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counts the fraction inside.
    fn counted(e: &ProjectedEllipse, width: u32, height: u32) -> f64 {
        let n = 5_000;
        let inside = |p: Point2<f64>| {
            (-0.5..=f64::from(width) - 0.5).contains(&p.x)
                && (-0.5..=f64::from(height) - 0.5).contains(&p.y)
        };
        (0..n)
            .filter(|i| inside(e.point(f64::from(*i) * TAU / f64::from(n))))
            .count() as f64
            / f64::from(n)
    }

    #[test]
    fn share_inside_is_the_counted_one() {
        for i in 0..600 {
            let f = |k: i32| f64::from(i * 7919 % (k * 97)) / f64::from(k * 97);
            let major = 3.0 + 140.0 * f(3);
            let e = ProjectedEllipse {
                centre: Point2::new(-30.0 + 160.0 * f(5), -30.0 + 130.0 * f(7)),
                major,
                minor: major * (0.4 + 0.6 * f(11)),
                angle: TAU * f(13),
            };
            let (share, count) = (e.share_inside(100, 70), counted(&e, 100, 70));
            assert!(
                (share - count).abs() < 2e-3,
                "{e:?}: {share} against {count}"
            );
        }
    }
}
