//! Settings of the hybrid controller.

use hough_heuristic::Features;

use crate::behaviour::spec::GoalInterval;
use crate::checked::checked;
use crate::controllers::hybrid::belief::Prior;
#[cfg(feature = "serde")]
use crate::controllers::servo::settings::check_goal;
use crate::limits::JointLimits;
#[cfg(feature = "serde")]
use crate::limits::check_steps;
use crate::sight::camera_model::CameraModel;

/// Settings of a [`Hybrid`](crate::Hybrid).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct HybridSettings {
    /// Nominal camera and arm.
    pub nominal: CameraModel,
    /// Expected errors of the nominal model.
    pub prior: Prior,
    /// Fraction of the prior uncertainty added back when a saved belief is loaded, 0..=1 (default
    /// 0.2). Larger values re-learn a knocked camera sooner; see
    /// [`Hybrid::with_belief`](crate::Hybrid::with_belief).
    pub drift: f64,
    /// Features of the ball at the goal (default (103.5, 78, 33)).
    pub goal: Features,
    /// Largest turns of `JT1` to `JT3` in one move, radians (default
    /// [`JointLimits::PAPER_STEPS`]).
    pub steps: [f64; 3],
    /// Margin to the frame's border, in standard deviations of the predicted image place (default
    /// 2).
    pub caution: f64,
    /// Number of latest runs kept as evidence (default 400).
    pub memory: usize,
    /// Turn of `JT5` for the grip, radians (default -18.01 degrees).
    pub grip_turn: f64,
    /// Turn of `JT4` for the grip, radians (default 0).
    pub grip_aside: f64,
    /// Largest standard deviation of the ball's place, metres, at which the controller aims the
    /// grip itself (default 0.008). Above it the agent's configured grip is used.
    pub grip_certainty: f64,
}

checked!(HybridSettings {
    nominal: CameraModel,
    prior: Prior,
    drift: f64,
    goal: Features,
    steps: [f64; 3],
    caution: f64,
    memory: usize,
    grip_turn: f64,
    grip_aside: f64,
    grip_certainty: f64,
});

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
            grip_turn: -18.01_f64.to_radians(),
            grip_aside: 0.0,
            grip_certainty: 0.008,
        }
    }

    /// Validates the settings.
    #[cfg(feature = "serde")]
    pub(crate) fn check(&self) -> Result<(), String> {
        self.nominal.check()?;
        self.prior.check()?;
        check_goal(&self.goal)?;
        check_steps(&self.steps)?;
        for (name, value) in [
            ("drift", self.drift),
            ("caution", self.caution),
            ("grip_certainty", self.grip_certainty),
        ] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(format!(
                    "{name} is {value}; expected a finite number, 0 or more"
                ));
            }
        }
        for (name, value) in [
            ("grip_turn", self.grip_turn),
            ("grip_aside", self.grip_aside),
        ] {
            if !value.is_finite() {
                return Err(format!("{name} is {value}; expected a finite number"));
            }
        }
        Ok(())
    }
}
