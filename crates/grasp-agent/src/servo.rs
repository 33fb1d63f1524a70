//! The rivals that the paper names, as controllers: visual servoing in its classical forms, a fuzzy
//! controller, and a one-step look-ahead.
//!
//! All of them believe in a [`CameraModel`] and do not learn. They share what is not theirs to
//! decide: the goal, the longest step of a cycle, the working limits.

mod fuzzy;
mod image_based;
mod look_ahead;
mod position_based;

use hough_heuristic::Features;
use nalgebra::{Matrix3, Point3, Vector3};
use puma_val2::{JointDelta, Joints};

use crate::checked::checked;
#[cfg(feature = "serde")]
use crate::config::above_zero;
use crate::{CameraModel, Consequence, JointLimits, StepLimits};

pub use fuzzy::Fuzzy;
pub use image_based::{ImageBased, JacobianAt};
pub use look_ahead::LookAhead;
pub use position_based::PositionBased;

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

impl CameraModel {
    /// The pose near `from`, differing in the first three joints, in which a ball at `ball` shows
    /// as `features`, or most nearly so, and how far the ball is then from its place before the
    /// camera, metres. `None` for features that no ball has, and where a number is not finite.
    pub fn pose_showing(
        &self,
        ball: &Point3<f64>,
        features: &Features,
        from: &Joints,
    ) -> Option<(Joints, f64)> {
        let (pose, off) = self.pose_placing(ball, &self.in_camera(features)?, from);
        off.is_finite().then_some((pose, off))
    }

    /// The pose near `from`, differing in the first three joints, in which a ball at `ball` is at
    /// `wanted` in the camera frame, or most nearly so, and how far off it is then, metres.
    pub(crate) fn pose_placing(
        &self,
        ball: &Point3<f64>,
        wanted: &Point3<f64>,
        from: &Joints,
    ) -> (Joints, f64) {
        let seen_at =
            |joints: &Joints| (self.arm.wrist(joints) * self.mount).inverse_transform_point(ball);
        solved(from, |joints| seen_at(joints) - wanted)
    }

    /// The pose near `from`, differing in the first three joints, in which the gripper is at
    /// `ball`; `None` if there is none within a millimetre.
    pub(crate) fn pose_gripping(&self, ball: &Point3<f64>, from: &Joints) -> Option<Joints> {
        let (joints, miss) = solved(from, |joints| self.tool_point(joints) - ball);
        (miss < 0.001).then_some(joints)
    }

    /// How the image of a ball at `ball` changes with the first three joints: rows x, y, r (feature
    /// units) by columns JT1, JT2, JT3 (radians).
    pub fn image_jacobian(&self, joints: &Joints, ball: &Point3<f64>) -> Option<Matrix3<f64>> {
        const TURN: f64 = 1e-5;
        let mut jacobian = Matrix3::zeros();
        for i in 0..3 {
            let at = |turn: f64| {
                let mut turned = *joints;
                turned.0[i] += turn;
                self.view(&turned, ball)
            };
            let (up, down) = (at(TURN)?, at(-TURN)?);
            let change = Vector3::new(up.x - down.x, up.y - down.y, up.r - down.r);
            jacobian.set_column(i, &(change / (2.0 * TURN)));
        }
        Some(jacobian)
    }
}

/// The joints near `from`, differing in the first three, at which `error` is least, and how large
/// it is there: Newton's method with damping.
fn solved(from: &Joints, error_at: impl Fn(&Joints) -> Vector3<f64>) -> (Joints, f64) {
    const TURN: f64 = 1e-6;
    let (mut joints, mut error) = (*from, error_at(from));
    let mut damping = 1e-6;
    for _ in 0..60 {
        if error.norm() < 1e-7 {
            break;
        }
        let mut jacobian = Matrix3::zeros();
        for i in 0..3 {
            let mut turned = joints;
            turned.0[i] += TURN;
            jacobian.set_column(i, &((error_at(&turned) - error) / TURN));
        }
        let normal = jacobian.transpose() * jacobian + Matrix3::identity() * damping;
        let Some(step) = normal.lu().solve(&(jacobian.transpose() * error)) else {
            break;
        };
        // No more than half a radian at once: the arm turns, the model of it is straight.
        let step: Vector3<f64> = step * (0.5 / step.amax()).min(1.0);
        let mut next = joints;
        for i in 0..3 {
            next.0[i] -= step[i];
        }
        let left = error_at(&next);
        if left.norm() < error.norm() {
            (joints, error, damping) = (next, left, (damping * 0.3).max(1e-12));
        } else {
            damping = damping * 10.0 + 1e-9;
        }
    }
    (joints, error.norm())
}

/// How boldly a servo controller moves: it remembers nothing else.
///
/// Without it a controller that loses the ball would, once recovery has brought it back, lose it by
/// the same move again.
#[derive(Clone, Copy, Debug)]
struct Boldness(f64);

impl Boldness {
    const FULL: Self = Self(1.0);

    /// Half as bold after every move that lost the ball or was taken back, half as bold again after
    /// every one that was not.
    fn judge(&mut self, consequence: &Consequence) {
        self.0 = match consequence {
            Consequence::Seen(_) => (1.5 * self.0).min(1.0),
            Consequence::Lost | Consequence::TakenBack => (0.5 * self.0).max(1.0 / 64.0),
            Consequence::Missed => self.0,
        };
    }

    /// `wanted` times the boldness, cut to what a cycle allows.
    fn cut(
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
fn turns(jacobian: &Matrix3<f64>, error: &Vector3<f64>) -> Option<Vector3<f64>> {
    const DAMPING: f64 = 1.0;
    let normal = jacobian.transpose() * jacobian + Matrix3::identity() * DAMPING;
    normal
        .cholesky()
        .map(|c| c.solve(&(jacobian.transpose() * error)))
}
