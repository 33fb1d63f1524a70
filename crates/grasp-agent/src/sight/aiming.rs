//! The inverse of a camera model: poses in which a ball shows as wanted.

use hough_heuristic::Features;
use nalgebra::{Matrix3, Point3, Vector3};
use puma_val2::Joints;

use crate::sight::camera_model::CameraModel;

impl CameraModel {
    /// Returns the pose near `from`, differing in the first three joints, in which a ball at `ball`
    /// shows most nearly as `features`, and the remaining distance of the ball from its place
    /// before the camera, metres. `None` for features that no ball has, and if a number is not
    /// finite.
    pub(crate) fn pose_showing(
        &self,
        ball: &Point3<f64>,
        features: &Features,
        from: &Joints,
    ) -> Option<(Joints, f64)> {
        let (pose, off) = self.pose_placing(ball, &self.in_camera(features)?, from);
        off.is_finite().then_some((pose, off))
    }

    /// Returns the pose near `from`, differing in the first three joints, in which a ball at `ball`
    /// is nearest to `wanted` in the camera frame, and the remaining distance, metres.
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

    /// Returns the pose near `from`, differing in the first three joints, in which the gripper is
    /// at `ball`; `None` if there is none within a millimetre.
    pub(crate) fn pose_gripping(&self, ball: &Point3<f64>, from: &Joints) -> Option<Joints> {
        let (joints, miss) = solved(from, |joints| self.tool_point(joints) - ball);
        (miss < 0.001).then_some(joints)
    }

    /// Returns the image Jacobian of a ball at `ball`: rows x, y, r (feature units) by columns JT1,
    /// JT2, JT3 (radians).
    pub(crate) fn image_jacobian(
        &self,
        joints: &Joints,
        ball: &Point3<f64>,
    ) -> Option<Matrix3<f64>> {
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

/// Returns the joints near `from`, differing in the first three, at which the error is least, and
/// its norm there: Newton's method with damping.
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
        // At most half a radian at once: beyond that the linear model does not hold.
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
