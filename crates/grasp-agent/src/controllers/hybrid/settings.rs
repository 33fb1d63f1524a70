//! Settings of the hybrid controller.

use hough_heuristic::Features;
use serde::{Deserialize, Serialize};

use crate::behaviour::spec::GoalInterval;
use crate::checked::check_goal;
use crate::controllers::hybrid::belief::Prior;
use crate::error::BehaviourError;
use crate::limits::{JointLimits, check_steps};
use crate::sight::camera_model::CameraModel;

/// Settings of a [`Hybrid`](crate::Hybrid).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HybridSettings {
    /// Nominal camera, arm and ball (default [`CameraModel::paper`]).
    pub nominal: CameraModel,
    /// Expected errors of the nominal model (default [`Prior::by_eye`]).
    pub prior: Prior,
    /// Fraction of the prior uncertainty added back when a saved belief is loaded, at least 0
    /// (default 0.2). Larger values re-learn a knocked camera sooner; see
    /// [`Hybrid::with_belief`](crate::Hybrid::with_belief).
    pub drift: f64,
    /// Features of the ball at the goal (default (103.5, 78, 33)).
    pub goal: Features,
    /// Largest turns of `JT1` to `JT3` in one move, radians (default
    /// [`JointLimits::PAPER_STEPS`]).
    pub steps: [f64; 3],
    /// Margin to the frame's border, in standard deviations of the predicted image place, at least
    /// 0 (default 2).
    pub caution: f64,
    /// Number of latest runs kept as evidence (default 400).
    pub memory: usize,
    /// Turns of the last three joints for the grip, radians (default 0, -18.01 degrees, 0).
    pub grip: [f64; 3],
    /// Largest standard deviation of an aimed grip from the ball, metres, at least 0 (default
    /// 0.008). Above it [`AgentConfig::grip`] is used, and after an aim that has missed if a goal
    /// was taught. Without a taught goal, aims that follow one that has missed lie beside it, along
    /// the axes of uncertainty.
    ///
    /// [`AgentConfig::grip`]: crate::AgentConfig::grip
    pub grip_certainty: f64,
}

impl HybridSettings {
    /// Returns the default settings.
    pub fn paper() -> Self {
        Self {
            nominal: CameraModel::paper(),
            prior: Prior::by_eye(),
            drift: 0.2,
            goal: GoalInterval::paper_features(),
            steps: JointLimits::PAPER_STEPS,
            caution: 2.0,
            memory: 400,
            grip: [0.0, -18.01_f64.to_radians(), 0.0],
            grip_certainty: 0.008,
        }
    }

    /// Checks the settings, for example after they were read from a file.
    ///
    /// # Errors
    /// [`BehaviourError::Settings`] names the setting that cannot work.
    pub fn check(&self) -> Result<(), BehaviourError> {
        self.nominal.check()?;
        self.prior.check()?;
        check_goal(&self.goal)?;
        check_steps(&self.steps, &self.nominal.arm)?;
        for (name, value, least) in [
            ("drift", self.drift, 0.0),
            ("caution", self.caution, 0.0),
            ("grip_certainty", self.grip_certainty, 0.0),
            ("a turn of grip", self.grip.iter().sum(), f64::MIN),
        ] {
            if !(value.is_finite() && value >= least) {
                let allowed = if least < 0.0 { "" } else { ", 0 or more" };
                return Err(format!("{name} is {value}; expected a finite number{allowed}").into());
            }
        }
        Ok(())
    }
}
