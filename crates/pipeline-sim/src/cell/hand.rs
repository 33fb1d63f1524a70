//! The gripper and the camera as bodies, and their distances from things.

use nalgebra::{Isometry3, Point3};

/// A segment with a radius: the model of fingers, palm, camera and rods.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Capsule {
    /// One end of the axis, metres.
    pub(crate) from: Point3<f64>,
    /// The other end, metres.
    pub(crate) to: Point3<f64>,
    /// Radius, metres.
    pub(crate) radius: f64,
}

impl Capsule {
    /// Returns the capsule moved by `pose`.
    pub(crate) fn moved(&self, pose: &Isometry3<f64>) -> Self {
        Self {
            from: pose * self.from,
            to: pose * self.to,
            radius: self.radius,
        }
    }

    /// Returns the point of the axis that is nearest to `point`.
    pub(crate) fn nearest_axis_point(&self, point: &Point3<f64>) -> Point3<f64> {
        let along = self.to - self.from;
        let length2 = along.norm_squared();
        let t = if length2 > 0.0 {
            ((point - self.from).dot(&along) / length2).clamp(0.0, 1.0)
        } else {
            0.0
        };
        self.from + along * t
    }

    /// Returns the gap to a sphere, metres; below zero if they overlap.
    pub(crate) fn gap_to_sphere(&self, centre: &Point3<f64>, radius: f64) -> f64 {
        (self.nearest_axis_point(centre) - centre).norm() - self.radius - radius
    }

    /// Returns the gap to another capsule, metres; below zero if they overlap.
    pub(crate) fn gap_to(&self, other: &Self) -> f64 {
        // Axes as p(s) = from + s u and q(t) = from' + t v with s, t in 0..1. The squared distance
        // is a convex quadratic: its minimum is where both lines are nearest to each other, if that
        // is on both segments, else on one of the four ends.
        let ends = [
            (self.from - other.nearest_axis_point(&self.from)).norm(),
            (self.to - other.nearest_axis_point(&self.to)).norm(),
            (other.from - self.nearest_axis_point(&other.from)).norm(),
            (other.to - self.nearest_axis_point(&other.to)).norm(),
        ];
        let (u, v, w) = (
            self.to - self.from,
            other.to - other.from,
            self.from - other.from,
        );
        let (uu, uv, vv, uw, vw) = (u.dot(&u), u.dot(&v), v.dot(&v), u.dot(&w), v.dot(&w));
        // Zero for parallel axes, where one of the ends is as near as any other place.
        let determinant = uu * vv - uv * uv;
        let (s, t) = (
            (uv * vw - vv * uw) / determinant,
            (uu * vw - uv * uw) / determinant,
        );
        let crossing = determinant > 0.0 && (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t);
        let between = if crossing {
            (w + u * s - v * t).norm()
        } else {
            f64::INFINITY
        };
        ends.into_iter().fold(between, f64::min) - self.radius - other.radius
    }

    /// Returns the gap above the horizontal plane at `height`, metres.
    pub(crate) fn gap_to_plane(&self, height: f64) -> f64 {
        self.from.z.min(self.to.z) - self.radius - height
    }
}

/// The hand: a gripper with two parallel jaws that open along the hand's y axis, and the camera
/// beside it.
///
/// Lengths in metres, in the hand frame (origin at the wrist centre, z along the tool axis).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct HandShape {
    /// Distance from the flange to the tool point between the finger pads, along z.
    pub tool: f64,
    /// Distance of the finger tips past the tool point.
    pub beyond_tool: f64,
    /// Radius of a finger.
    pub finger_radius: f64,
    /// Distance from the tool axis to the axis of each open finger.
    pub half_opening: f64,
    /// Radius of the palm that carries the fingers.
    pub palm_radius: f64,
    /// Length of the fingers from the palm to the tips.
    pub finger_length: f64,
    /// Radius of the camera's body.
    pub camera_radius: f64,
    /// Distance of the lens past the centre of projection.
    pub lens: f64,
    /// Reach of the proximity sensors.
    pub sensor_range: f64,
    /// Greatest distance from the middle of the pads, across the jaws, at which a ball is held.
    pub pad_tolerance: f64,
}

impl HandShape {
    /// Returns the gripper of the paper's cell: tool point 126 mm beyond the flange (`TOOL` z =
    /// 126).
    pub fn paper() -> Self {
        Self {
            tool: 0.126,
            beyond_tool: 0.010,
            finger_radius: 0.006,
            half_opening: 0.036,
            palm_radius: 0.035,
            finger_length: 0.072,
            camera_radius: 0.022,
            lens: 0.015,
            sensor_range: 0.004,
            pad_tolerance: 0.010,
        }
    }

    /// Returns the two fingers in the hand frame, `half_opening` metres off the tool axis; `flange`
    /// is the distance from the wrist centre to the flange.
    pub(crate) fn fingers(&self, flange: f64, half_opening: f64) -> [Capsule; 2] {
        let tip = flange + self.tool + self.beyond_tool;
        [half_opening, -half_opening].map(|y| Capsule {
            from: Point3::new(0.0, y, tip - self.finger_length),
            to: Point3::new(0.0, y, tip - self.finger_radius),
            radius: self.finger_radius,
        })
    }

    /// Returns the palm in the hand frame.
    pub(crate) fn palm(&self, flange: f64) -> Capsule {
        let front = flange + self.tool + self.beyond_tool - self.finger_length;
        Capsule {
            from: Point3::new(0.0, 0.0, 0.0),
            to: Point3::new(0.0, 0.0, (front - self.palm_radius).max(0.0)),
            radius: self.palm_radius,
        }
    }

    /// Returns the camera's body in the *camera* frame.
    pub(crate) fn camera_body(&self) -> Capsule {
        Capsule {
            from: Point3::new(0.0, 0.0, -0.060),
            to: Point3::new(0.0, 0.0, self.lens - self.camera_radius),
            radius: self.camera_radius,
        }
    }
}

impl Default for HandShape {
    fn default() -> Self {
        Self::paper()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::rngs::Xoshiro256PlusPlus;
    use rand::{RngExt, SeedableRng};

    /// Searches places on both axes, finer and finer about the best: the distance is convex.
    fn tried(a: &Capsule, b: &Capsule) -> f64 {
        let at = |c: &Capsule, t: f64| c.from + (c.to - c.from) * t;
        let ((mut s, mut t), mut width) = ((0.5, 0.5), 0.5);
        let mut least = f64::INFINITY;
        for _ in 0..60 {
            let (s0, t0) = (s, t);
            for i in -10..=10 {
                for j in -10..=10 {
                    let (p, q): (f64, f64) = (
                        (s0 + width * f64::from(i) / 10.0).clamp(0.0, 1.0),
                        (t0 + width * f64::from(j) / 10.0).clamp(0.0, 1.0),
                    );
                    let distance = (at(a, p) - at(b, q)).norm();
                    if distance < least {
                        (least, s, t) = (distance, p, q);
                    }
                }
            }
            width *= 0.7;
        }
        least - a.radius - b.radius
    }

    #[test]
    fn gap_between_capsules_is_the_least_distance() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let mut point = |reach: f64| {
            let mut draw = || rng.random_range(-reach..reach);
            Point3::new(draw(), draw(), draw())
        };
        for k in 0..150 {
            // Some are nearly parallel, some are points.
            let spread = [0.05, 1e-4, 0.0][k % 3];
            let (from, along) = (point(0.1), point(0.1).coords);
            let a = Capsule {
                from,
                to: from + along,
                radius: 0.006,
            };
            let from = point(0.1);
            let b = Capsule {
                from,
                to: from + along * if k % 5 == 0 { 0.0 } else { 1.0 } + point(1.0).coords * spread,
                radius: 0.008,
            };
            let (gap, expected) = (a.gap_to(&b), tried(&a, &b));
            assert!(
                (gap - expected).abs() < 1e-6,
                "{a:?} {b:?}: {gap} {expected}"
            );
            assert!((gap - b.gap_to(&a)).abs() < 1e-12);
        }
    }
}
