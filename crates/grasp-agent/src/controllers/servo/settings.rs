//! Settings of the servo controllers.

use hough_heuristic::Features;
use nalgebra::{Matrix3, Vector3};
use puma_val2::Joints;
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
    /// Gain far from the goal, and slope of the gain at the goal per error of a goal radius: the
    /// adaptive gain of `ViSP` (default `None`, a constant gain). With [`ServoSettings::gain`] as
    /// that at the goal, the gain at the error e is (gain - far) exp(-slope e / (gain - far)) +
    /// far.
    pub adaptive: Option<[f64; 2]>,
    /// Poses in which balls with 9/33, 17/33, 1 and 55/33 of the goal's radius are typically seen;
    /// the third one is that at the goal (default: those of a PUMA).
    pub poses: [Joints; 4],
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
            adaptive: None,
            poses: [
                (-105.0, 205.0),
                (-80.0, 195.0),
                (-57.0, 186.0),
                (-57.0, 186.0),
            ]
            .map(|(j2, j3)| Joints::from_degrees([0.0, j2, j3, 0.0, 45.0, 0.0])),
            steps: JointLimits::PAPER_STEPS,
        }
    }

    /// Returns the settings with another gain.
    #[must_use]
    pub fn with_gain(self, gain: f64) -> Self {
        Self { gain, ..self }
    }

    /// Returns the gain at an error in goal radii.
    pub(crate) fn gain_at(&self, error: f64) -> f64 {
        match self.adaptive {
            Some([far, slope]) if (self.gain - far).abs() > 1e-9 => {
                let span = self.gain - far;
                span * (-slope * error / span).exp() + far
            }
            _ => self.gain,
        }
    }

    /// Returns the features (x/r, y/r, 1/r) of a sphere, scaled to feature units at the goal.
    pub(crate) fn sphere(&self, seen: &Features) -> Vector3<f64> {
        let [cx, cy] = self.model.centre;
        let scale = self.goal.r / seen.r;
        Vector3::new(seen.x - cx, seen.y - cy, self.goal.r) * scale
    }

    /// Converts an image Jacobian at the goal to one of [`ServoSettings::sphere`].
    pub(crate) fn by_sphere(&self, jacobian: &Matrix3<f64>) -> Matrix3<f64> {
        let here = self.sphere(&self.goal) / self.goal.r;
        let mut by_features = Matrix3::identity();
        by_features.set_column(2, &Vector3::new(-here.x, -here.y, -1.0));
        by_features * jacobian
    }

    /// Checks the settings, for example after they were read from a file.
    ///
    /// # Errors
    /// [`BehaviourError::Settings`] names the setting that cannot work.
    pub fn check(&self) -> Result<(), BehaviourError> {
        self.model.check()?;
        check_goal(&self.goal)?;
        above_zero("gain", self.gain)?;
        if self.poses.iter().any(|pose| pose.non_finite().is_some()) {
            let fault = "a pose in which balls are typically seen is not finite".into();
            return Err(BehaviourError::Settings(fault));
        }
        if let Some([far, slope]) = self.adaptive {
            above_zero("the gain far from the goal", far)?;
            above_zero("the slope of the gain", slope)?;
            if far > self.gain {
                let fault = format!("the gain far from the goal, {far}, exceeds that at the goal");
                return Err(BehaviourError::Settings(fault));
            }
        }
        Ok(check_steps(&self.steps, &self.model.arm)?)
    }
}
