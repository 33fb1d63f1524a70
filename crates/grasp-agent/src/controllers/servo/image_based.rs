//! Image-based visual servoing.

use nalgebra::{Matrix3, Vector3};
use puma_val2::{JointDelta, Joints};

use crate::controller::{Consequence, Controller, GaveUp, Situation};
use crate::controllers::servo::settings::{Boldness, ServoSettings, turns};
use crate::limits::JointLimits;

/// Image-based visual servoing (Hutchinson, Hager, Corke 1996, section VI) on the features of a
/// sphere, centre and radius: the error in the image is removed through the inverse of the image
/// Jacobian.
#[derive(Clone, Debug)]
pub struct ImageBased {
    settings: ServoSettings,
    boldness: Boldness,
    at: JacobianAt,
    goal: Option<Matrix3<f64>>,
}

/// Where the Jacobian is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum JacobianAt {
    /// Where the arm is now, with the ball where the model places it.
    Now,
    /// At the goal, once and for all.
    Goal,
}

impl ImageBased {
    /// The pose, degrees, that the constant Jacobian is taken at: the median of the poses in which
    /// reachable balls stand at the goal.
    pub const GOAL_POSE: [f64; 6] = [0.0, -57.0, 186.0, 0.0, 45.0, 0.0];

    /// With the given model, gain and Jacobian.
    pub fn new(settings: ServoSettings, at: JacobianAt) -> Self {
        let pose = Joints::from_degrees(Self::GOAL_POSE);
        let ball = settings.model.locate(&pose, &settings.goal);
        Self {
            goal: ball.and_then(|ball| settings.model.image_jacobian(&pose, &ball)),
            settings,
            boldness: Boldness::FULL,
            at,
        }
    }
}

impl Controller for ImageBased {
    fn name(&self) -> &str {
        match self.at {
            JacobianAt::Now => "image-based, current J",
            JacobianAt::Goal => "image-based, goal J",
        }
    }

    fn decide(&mut self, now: &Situation, limits: &JointLimits) -> Result<JointDelta, GaveUp> {
        let ServoSettings {
            model,
            goal,
            gain,
            steps,
        } = &self.settings;
        let jacobian = match self.at {
            JacobianAt::Goal => self.goal,
            JacobianAt::Now => model
                .locate(&now.joints, &now.features)
                .and_then(|ball| model.image_jacobian(&now.joints, &ball)),
        };
        let (jacobian, seen) = (jacobian.ok_or(GaveUp::NoMoveLeft)?, now.features);
        let error = Vector3::new(goal.x - seen.x, goal.y - seen.y, goal.r - seen.r);
        let wanted = turns(&jacobian, &error).ok_or(GaveUp::NoMoveLeft)? * *gain;
        Ok(self.boldness.cut(wanted.into(), steps, &now.joints, limits))
    }

    fn begin(&mut self) {
        self.boldness = Boldness::FULL;
    }

    fn judge(&mut self, consequence: &Consequence) {
        self.boldness.judge(consequence);
    }
}
