//! The gripper and the camera as bodies: how near they come to things.

use nalgebra::{Isometry3, Point3};

/// A segment with a thickness: how fingers, palm, camera and rods are modelled.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Capsule {
    /// One end of the axis, metres.
    pub from: Point3<f64>,
    /// The other end, metres.
    pub to: Point3<f64>,
    /// Radius, metres.
    pub radius: f64,
}

impl Capsule {
    /// The capsule moved by `pose`.
    pub fn moved(&self, pose: &Isometry3<f64>) -> Self {
        Self {
            from: pose * self.from,
            to: pose * self.to,
            radius: self.radius,
        }
    }

    /// The point of the axis that is nearest to `point`.
    pub fn nearest_axis_point(&self, point: &Point3<f64>) -> Point3<f64> {
        let along = self.to - self.from;
        let length2 = along.norm_squared();
        let t = if length2 > 0.0 {
            ((point - self.from).dot(&along) / length2).clamp(0.0, 1.0)
        } else {
            0.0
        };
        self.from + along * t
    }

    /// Gap between the surface and a sphere, metres; below zero if they overlap.
    pub fn gap_to_sphere(&self, centre: &Point3<f64>, radius: f64) -> f64 {
        (self.nearest_axis_point(centre) - centre).norm() - self.radius - radius
    }

    /// Gap between the surfaces of two capsules, metres; below zero if they overlap.
    pub fn gap_to(&self, other: &Self) -> f64 {
        // Alternating projection onto the two segments; the distance is convex, and a few rounds settle it to micrometres for
        // the short, mostly crossing segments of a hand.
        let mut p = self.from + (self.to - self.from) * 0.5;
        let mut q = other.nearest_axis_point(&p);
        for _ in 0..32 {
            let next = self.nearest_axis_point(&q);
            let moved = (next - p).norm_squared();
            p = next;
            q = other.nearest_axis_point(&p);
            if moved < 1e-14 {
                break;
            }
        }
        (p - q).norm() - self.radius - other.radius
    }

    /// Gap above the horizontal plane at `height`, metres.
    pub fn gap_to_plane(&self, height: f64) -> f64 {
        self.from.z.min(self.to.z) - self.radius - height
    }
}

/// The hand: a gripper with two parallel jaws that open along the hand's y axis, and the camera beside it.
///
/// Lengths in metres, in the hand frame (origin at the wrist centre, z along the tool axis).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Hand {
    /// From the flange to the tool point between the finger pads, along z.
    pub tool: f64,
    /// How far the finger tips reach past the tool point.
    pub beyond_tool: f64,
    /// Radius of a finger.
    pub finger_radius: f64,
    /// From the tool axis to the axis of each open finger.
    pub half_opening: f64,
    /// Radius of the palm that carries the fingers.
    pub palm_radius: f64,
    /// Length of the fingers from the palm to the tips.
    pub finger_length: f64,
    /// Radius of the camera's body.
    pub camera_radius: f64,
    /// How far the lens reaches past the centre of projection.
    pub lens: f64,
    /// Reach of the proximity sensors.
    pub sensor_range: f64,
    /// How far from the middle of the pads, across the jaws, a ball may be and still be held.
    pub pad_tolerance: f64,
}

impl Hand {
    /// The gripper used throughout: tool point 126 mm beyond the flange (`TOOL` z = 126).
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

    /// The two fingers in the hand frame, jaws `half_opening` metres off the tool axis; `flange` is the distance from the wrist
    /// centre to the flange.
    pub fn fingers(&self, flange: f64, half_opening: f64) -> [Capsule; 2] {
        let tip = flange + self.tool + self.beyond_tool;
        [half_opening, -half_opening].map(|y| Capsule {
            from: Point3::new(0.0, y, tip - self.finger_length),
            to: Point3::new(0.0, y, tip - self.finger_radius),
            radius: self.finger_radius,
        })
    }

    /// The palm in the hand frame.
    pub fn palm(&self, flange: f64) -> Capsule {
        let front = flange + self.tool + self.beyond_tool - self.finger_length;
        Capsule {
            from: Point3::new(0.0, 0.0, 0.0),
            to: Point3::new(0.0, 0.0, (front - self.palm_radius).max(0.0)),
            radius: self.palm_radius,
        }
    }

    /// The camera's body in the *camera* frame.
    pub fn camera_body(&self) -> Capsule {
        Capsule {
            from: Point3::new(0.0, 0.0, -0.060),
            to: Point3::new(0.0, 0.0, self.lens - self.camera_radius),
            radius: self.camera_radius,
        }
    }
}

impl Default for Hand {
    fn default() -> Self {
        Self::paper()
    }
}
