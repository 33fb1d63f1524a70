//! Position-based visual servoing.

use puma_val2::JointDelta;

use crate::controller::{Consequence, Controller, GaveUp, Situation};
use crate::controllers::servo::settings::{Boldness, ServoSettings};
use crate::limits::JointLimits;

/// Position-based visual servoing (Hutchinson, Hager, Corke 1996, section V): the ball's place in
/// space is computed from the image by the geometrical model, and the error between the pose of the
/// arm and the pose wanted is removed in joint space.
#[derive(Clone, Debug)]
pub struct PositionBased {
    settings: ServoSettings,
    boldness: Boldness,
}

impl PositionBased {
    /// With the given model and gain.
    pub fn new(settings: ServoSettings) -> Self {
        Self {
            settings,
            boldness: Boldness::FULL,
        }
    }
}

impl Controller for PositionBased {
    fn name(&self) -> &str {
        "position-based"
    }

    fn decide(&mut self, now: &Situation, limits: &JointLimits) -> Result<JointDelta, GaveUp> {
        let ServoSettings {
            model,
            goal,
            gain,
            steps,
        } = &self.settings;
        let ball = model
            .locate(&now.joints, &now.features)
            .ok_or(GaveUp::NoMoveLeft)?;
        let (target, _) = model
            .pose_showing(&ball, goal, &now.joints)
            .ok_or(GaveUp::NoMoveLeft)?;
        let wanted = std::array::from_fn(|i| gain * (target.0[i] - now.joints.0[i]));
        Ok(self.boldness.cut(wanted, steps, &now.joints, limits))
    }

    fn begin(&mut self) {
        self.boldness = Boldness::FULL;
    }

    fn judge(&mut self, consequence: &Consequence) {
        self.boldness.judge(consequence);
    }
}
