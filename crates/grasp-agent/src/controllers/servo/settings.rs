//! Settings of the servo controllers.

use hough_heuristic::Features;

use crate::behaviour::spec::GoalInterval;
#[cfg(feature = "serde")]
use crate::checked::above_zero;
use crate::checked::checked;
use crate::limits::JointLimits;
#[cfg(feature = "serde")]
use crate::limits::check_steps;
use crate::sight::camera_model::CameraModel;

/// Settings common to all servo controllers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct ServoSettings {
    /// Camera and arm as they are believed to be.
    pub model: CameraModel,
    /// Features of the ball at the goal (default (103.5, 78, 33), the middle of the paper's goal
    /// intervals).
    pub goal: Features,
    /// Share of the error to remove in one move, above 0 (default 1).
    pub gain: f64,
    /// Largest turns of `JT1` to `JT3` in one move, radians (default
    /// [`JointLimits::PAPER_STEPS`]).
    pub steps: [f64; 3],
}

checked!(ServoSettings {
    model: CameraModel,
    goal: Features,
    gain: f64,
    steps: [f64; 3],
});

impl ServoSettings {
    /// Pose with the ball at the goal, degrees: the median over reachable balls.
    pub const GOAL_POSE: [f64; 6] = [0.0, -57.0, 186.0, 0.0, 45.0, 0.0];

    /// Returns the default settings.
    pub fn paper() -> Self {
        Self {
            model: CameraModel::paper(),
            goal: GoalInterval::paper_features(),
            gain: 1.0,
            steps: JointLimits::PAPER_STEPS,
        }
    }

    #[cfg(feature = "serde")]
    fn check(&self) -> Result<(), String> {
        self.model.check()?;
        check_goal(&self.goal)?;
        above_zero("gain", self.gain)?;
        check_steps(&self.steps)
    }

    /// Returns the settings with another gain.
    #[must_use]
    pub fn with_gain(self, gain: f64) -> Self {
        Self { gain, ..self }
    }
}

/// Checks that a ball can have these features.
#[cfg(feature = "serde")]
pub(crate) fn check_goal(goal: &Features) -> Result<(), String> {
    let Features { x, y, r } = *goal;
    if !(x.is_finite() && y.is_finite()) {
        return Err(format!("the goal is at {x}, {y}, which is not finite"));
    }
    above_zero("the radius of the goal", r)
}
