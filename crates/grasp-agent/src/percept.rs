//! What the controller perceives at one moment.

use hough_heuristic::{Detection, Features};
use puma_val2::{Joint, Joints};

/// A ball in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sighting {
    /// The circle in pixels of the frame, with its score.
    pub detection: Detection,
    /// The same in feature units.
    pub features: Features,
    /// Where the longer axis of its outline points in the image, radians from x toward y; `None`
    /// for what is round, or where that is not known.
    #[cfg_attr(feature = "serde", serde(default))]
    pub long_axis: Option<f64>,
}

/// The ball in the image and the elbow: everything a behaviour decides by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Percept {
    /// Centre and radius of the ball's outline, in feature units (192x144).
    pub features: Features,
    /// The paper's third joint angle, degrees: see [`theta3`].
    pub theta3: f64,
}

impl Percept {
    /// The percept of `features`, seen from the pose `joints`.
    pub fn new(features: Features, joints: &Joints) -> Self {
        Self {
            features,
            theta3: theta3(joints),
        }
    }
}

/// `JT3` where theta 3 is zero, degrees.
pub(crate) const THETA3_ZERO: f64 = 170.0;

/// The paper's angle theta 3 "between J2 and J3" in degrees: `JT3` - 170.
///
/// The paper gives no zero. With this one the goal poses of a reachable ball fill its interval \[0
/// : 40\] (10th to 90th percentile: -1 to 33).
pub fn theta3(joints: &Joints) -> f64 {
    joints[Joint::J3].to_degrees() - THETA3_ZERO
}

/// One quantity of a [`Percept`] that a behaviour's state is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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
    /// The value of this quantity in `percept`.
    pub fn of(self, percept: &Percept) -> f64 {
        match self {
            Self::X => percept.features.x,
            Self::Y => percept.features.y,
            Self::R => percept.features.r,
            Self::Theta3 => percept.theta3,
        }
    }
}
