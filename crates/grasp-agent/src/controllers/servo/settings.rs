//! Settings of the servo controllers.

use hough_heuristic::Features;
use serde::{Deserialize, Serialize};

use crate::behaviour::spec::GoalInterval;
use crate::checked::{above_zero, check_goal};
use crate::error::BehaviourError;
use crate::limits::{JointLimits, check_steps};
use crate::sight::camera_model::CameraModel;

/// Settings common to all servo controllers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ServoSettings {
    /// Model of camera, arm and ball that the moves are computed from (default
    /// [`CameraModel::paper`]).
    pub model: CameraModel,
    /// Features of the ball at the goal (default (103.5, 78, 33), the middle of the paper's goal
    /// intervals).
    pub goal: Features,
    /// Fraction of the error that one move removes, above 0 and finite (default 1).
    pub gain: f64,
    /// Largest turns of `JT1` to `JT3` in one move, radians (default
    /// [`JointLimits::PAPER_STEPS`]).
    pub steps: [f64; 3],
}

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

    /// Returns the settings with another gain.
    #[must_use]
    pub fn with_gain(self, gain: f64) -> Self {
        Self { gain, ..self }
    }

    /// Checks the settings, for example after they were read from a file.
    ///
    /// # Errors
    /// [`BehaviourError::Settings`] names the setting that cannot work.
    pub fn check(&self) -> Result<(), BehaviourError> {
        self.model.check()?;
        check_goal(&self.goal)?;
        above_zero("gain", self.gain)?;
        Ok(check_steps(&self.steps)?)
    }
}
