//! The sighting of an object in one frame, and the percept that behaviours decide by.

use hough_heuristic::Features;
use puma_val2::{Joint, Joints};
use serde::{Deserialize, Serialize};

/// An object found in one frame, the ball for example.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sighting {
    /// Centre and radius of its outline, feature units (192x144).
    pub features: Features,
    /// Score of the detection; the scale is the detector's own.
    pub score: f64,
    /// Direction of the longer axis of its outline, radians from x toward y in the image. `None`
    /// for round outlines and where the direction is unknown.
    pub long_axis: Option<f64>,
}

impl Sighting {
    /// Creates a sighting of a round object with the score 1.
    pub fn new(features: Features) -> Self {
        Self {
            features,
            score: 1.0,
            long_axis: None,
        }
    }

    /// Returns `true` if every number is finite.
    pub(crate) fn is_finite(&self) -> bool {
        let Features { x, y, r } = self.features;
        let numbers = [x, y, r, self.score].into_iter();
        numbers.chain(self.long_axis).all(f64::is_finite)
    }
}

/// Inputs of a behaviour at one moment: the ball in the image and the elbow angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Percept {
    /// Centre and radius of the ball's outline, feature units (192x144).
    pub features: Features,
    /// The paper's angle theta 3 "between J2 and J3", degrees: the angle of the third joint less
    /// [`BehaviourSpec::theta3_zero`](crate::BehaviourSpec::theta3_zero).
    pub theta3: f64,
}

impl Percept {
    /// `JT3` of a PUMA at which theta 3 is zero, degrees.
    ///
    /// The paper gives no zero. With this one the goal poses of a reachable ball fill its interval
    /// \[0 : 40\] (10th to 90th percentile: -1 to 33).
    pub const THETA3_ZERO: f64 = 170.0;

    /// Creates the percept of `features` seen from the pose `joints` of a PUMA.
    pub fn new(features: Features, joints: &Joints) -> Self {
        Self {
            features,
            theta3: joints[Joint::J3].to_degrees() - Self::THETA3_ZERO,
        }
    }
}

/// One quantity of a [`Percept`]; behaviours build their states from these.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Input {
    /// Horizontal centre, feature units.
    X,
    /// Vertical centre, feature units.
    Y,
    /// Radius, feature units.
    R,
    /// Elbow angle, degrees.
    Theta3,
}

impl Input {
    /// Returns the value of this quantity in `percept`.
    pub fn of(self, percept: &Percept) -> f64 {
        match self {
            Self::X => percept.features.x,
            Self::Y => percept.features.y,
            Self::R => percept.features.r,
            Self::Theta3 => percept.theta3,
        }
    }
}
