//! Settings of the servo controllers, and what they share.

use hough_heuristic::Features;
use nalgebra::{Matrix3, Vector3};
use puma_val2::{JointDelta, Joints};

#[cfg(feature = "serde")]
use crate::checked::above_zero;
use crate::checked::checked;
use crate::controller::Consequence;
use crate::limits::{JointLimits, StepLimits};
use crate::sight::camera_model::CameraModel;

/// What every servo controller is told.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(remote = "Self")
)]
pub struct ServoSettings {
    /// The camera and the arm as they are believed to be.
    pub model: CameraModel,
    /// Features of the ball where it should be \[(103.5, 78, 33), the middle of the paper's goal
    /// intervals\].
    pub goal: Features,
    /// Which part of the error is to be removed in one cycle \[1\], above 0.
    pub gain: f64,
    /// The farthest that each joint turns in one cycle [[`StepLimits::paper`]].
    pub steps: StepLimits,
}

checked!(ServoSettings);

impl ServoSettings {
    /// The settings in the brackets of the fields.
    pub fn paper() -> Self {
        Self {
            model: CameraModel::paper(),
            goal: Features {
                x: 103.5,
                y: 78.0,
                r: 33.0,
            },
            gain: 1.0,
            steps: StepLimits::paper(),
        }
    }

    /// Whether they can be used; if not, why.
    #[cfg(feature = "serde")]
    pub(crate) fn check(&self) -> Result<(), String> {
        let Self {
            model,
            goal,
            gain,
            steps,
        } = self;
        model.check()?;
        check_goal(goal)?;
        above_zero("gain", *gain)?;
        steps.check()
    }

    /// The same with another gain.
    #[must_use]
    pub fn with_gain(self, gain: f64) -> Self {
        Self { gain, ..self }
    }
}

/// Whether a ball can show so; if not, why.
#[cfg(feature = "serde")]
pub(crate) fn check_goal(goal: &Features) -> Result<(), String> {
    let Features { x, y, r } = *goal;
    if !(x.is_finite() && y.is_finite()) {
        return Err(format!("the goal is at {x}, {y}, which is not finite"));
    }
    above_zero("the radius of the goal", r)
}

/// How boldly a servo controller moves: it remembers nothing else.
///
/// Without it a controller that loses the ball would, once recovery has brought it back, lose it by
/// the same move again.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Boldness(f64);

impl Boldness {
    pub(crate) const FULL: Self = Self(1.0);

    /// Half as bold after every move that lost the ball or was taken back, half as bold again after
    /// every one that was not.
    pub(crate) fn judge(&mut self, consequence: &Consequence) {
        self.0 = match consequence {
            Consequence::Seen(_) => (1.5 * self.0).min(1.0),
            Consequence::Lost | Consequence::TakenBack => (0.5 * self.0).max(1.0 / 64.0),
            Consequence::Missed => self.0,
        };
    }

    /// `wanted` times the boldness, cut to what a cycle allows.
    pub(crate) fn cut(
        self,
        wanted: [f64; 3],
        steps: &StepLimits,
        joints: &Joints,
        limits: &JointLimits,
    ) -> JointDelta {
        let whole = steps.apply(wanted, joints, limits);
        JointDelta(whole.0.map(|turn| turn * self.0))
    }
}

/// The joint turns that remove `error` where the image changes by `jacobian`: damped least squares,
/// so that near a singular pose the turns stay finite.
pub(crate) fn turns(jacobian: &Matrix3<f64>, error: &Vector3<f64>) -> Option<Vector3<f64>> {
    const DAMPING: f64 = 1.0;
    let normal = jacobian.transpose() * jacobian + Matrix3::identity() * DAMPING;
    normal
        .cholesky()
        .map(|c| c.solve(&(jacobian.transpose() * error)))
}
