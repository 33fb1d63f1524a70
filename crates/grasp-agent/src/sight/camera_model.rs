//! Camera model: optics, mount on the hand, size of the ball.

use hough_heuristic::Features;
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use puma_val2::{Arm, Joints, Kinematics, PumaParams};
use serde::{Deserialize, Serialize};

use crate::checked::above_zero;

/// Model of an arm with a camera on its hand, and of the ball, as a controller believes them to be.
///
/// [`CameraModel::view`] predicts the image of a ball at a place, [`CameraModel::locate`] computes
/// the place from the image. Lengths are in metres, in VAL's world frame (origin at the shoulder, z
/// up).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CameraModel {
    /// Geometry of the arm.
    pub arm: Arm,
    /// Focal length, feature units (192 to the width of the frame).
    pub focal: f64,
    /// Principal point, feature units.
    pub centre: [f64; 2],
    /// Camera frame (z along the optical axis, x right, y down in the image) in the hand frame
    /// ([`Arm::wrist`]).
    pub mount: Isometry3<f64>,
    /// Radius of the ball, metres.
    pub ball_radius: f64,
    /// Distance from the flange to the point between the finger pads, metres.
    pub tool: f64,
}

impl CameraModel {
    /// Returns the paper's set-up: an 11.5 mm lens before a 2/3" CCD (8.8 mm wide), 60 mm above the
    /// tool axis, 4.5 mm to its left and 20 mm past the wrist centre, looking along the tool axis;
    /// a ball of 20 mm radius; a gripper of 126 mm.
    pub fn paper() -> Self {
        let axes = Matrix3::new(
            0.0, 1.0, 0.0, //
            -1.0, 0.0, 0.0, //
            0.0, 0.0, 1.0,
        );
        Self {
            arm: PumaParams::unimation().into(),
            focal: 11.5 / 8.8 * Features::WIDTH,
            centre: [0.5 * Features::WIDTH, 0.5 * Features::HEIGHT],
            mount: Isometry3::from_parts(
                Translation3::new(-0.060, 0.0045, 0.020),
                UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes)),
            ),
            ball_radius: 0.020,
            tool: 0.126,
        }
    }

    /// Checks that something can be seen by it.
    pub(crate) fn check(&self) -> Result<(), String> {
        // No sine or cosine is 0 there, so that each length enters.
        let hand = self.arm.forward(&Joints([0.5; 6])).to_homogeneous();
        let mount = self.mount.to_homogeneous();
        let mut numbers = hand
            .iter()
            .chain(&mount)
            .copied()
            .chain(self.centre)
            .chain([self.tool]);
        if !numbers.all(f64::is_finite) {
            return Err("a length or an angle of the camera or the arm is not finite".into());
        }
        let off = (self.mount.rotation.norm() - 1.0).abs();
        if off.is_nan() || off > 1e-9 {
            return Err("the rotation of the mount is no unit quaternion".into());
        }
        above_zero("the focal length", self.focal)?;
        above_zero("the radius of the ball", self.ball_radius)
    }

    /// Returns the outline of a ball at `ball` with the arm at `joints`, in the frame or outside
    /// it; `None` if it has none, for example behind the camera.
    pub fn view(&self, joints: &Joints, ball: &Point3<f64>) -> Option<Features> {
        let camera = self.arm.wrist(joints) * self.mount;
        self.outline(&camera.inverse_transform_point(ball))
    }

    /// Returns the place of a ball that shows as `features` with the arm at `joints`; `None` for
    /// features that no ball has.
    pub fn locate(&self, joints: &Joints, features: &Features) -> Option<Point3<f64>> {
        Some(self.arm.wrist(joints) * self.mount * self.in_camera(features)?)
    }

    /// Returns the point between the finger pads.
    pub fn tool_point(&self, joints: &Joints) -> Point3<f64> {
        self.arm.wrist(joints) * Point3::new(0.0, 0.0, self.arm.flange() + self.tool)
    }

    /// Returns the outline of a ball with its centre at `p` in the camera frame: centre and mean
    /// semi-axis of the ellipse in which the image plane cuts the cone of rays that touch the ball.
    pub(crate) fn outline(&self, p: &Point3<f64>) -> Option<Features> {
        let (scale, major, minor) = self.ellipse(p)?;
        let features = Features::new(
            self.centre[0] + scale * p.x,
            self.centre[1] + scale * p.y,
            0.5 * (major + minor),
        );
        (features.x.is_finite() && features.y.is_finite() && features.r.is_finite())
            .then_some(features)
    }

    /// Returns the ellipse of [`CameraModel::outline`]: the factor from (`p.x`, `p.y`) to its
    /// middle, from the principal point, and its semi-axes, the major one along that direction.
    pub(crate) fn ellipse(&self, p: &Point3<f64>) -> Option<(f64, f64, f64)> {
        let depth2 = p.z * p.z;
        let tangent2 = depth2 - self.ball_radius * self.ball_radius;
        // The whole ball is in front of the lens.
        if p.z.is_nan() || p.z <= self.ball_radius {
            return None;
        }
        let scale = self.focal * p.z / tangent2;
        let distance2 = p.coords.norm_squared();
        let minor = self.focal * self.ball_radius / tangent2.sqrt();
        let major = self.focal
            * self.ball_radius
            * (distance2 - self.ball_radius * self.ball_radius).sqrt()
            / tangent2;
        Some((scale, major, minor))
    }

    /// Inverts [`CameraModel::outline`].
    pub(crate) fn in_camera(&self, features: &Features) -> Option<Point3<f64>> {
        let wanted = [features.x, features.y, features.r];
        if !wanted.iter().all(|v| v.is_finite()) || features.r <= 0.0 {
            return None;
        }
        let ray = |x: f64, y: f64| {
            Vector3::new(
                (x - self.centre[0]) / self.focal,
                (y - self.centre[1]) / self.focal,
                1.0,
            )
        };
        let depth = self.focal * self.ball_radius / features.r;
        let mut p = Point3::from(ray(features.x, features.y) * depth.max(1.01 * self.ball_radius));
        // The centre of the outline lies nearly, not exactly, in the direction of the ball's:
        // correct by the rest.
        for _ in 0..30 {
            let seen = self.outline(&p)?;
            let z = (p.z * seen.r / features.r).max(1.001 * self.ball_radius);
            let toward = p.coords / p.z + ray(features.x, features.y) - ray(seen.x, seen.y);
            let next = Point3::from(toward * z);
            let step = (next - p).norm();
            p = next;
            if step < 1e-12 {
                break;
            }
        }
        Some(p)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_comes_back_to_the_last_digit() {
        let model = CameraModel {
            mount: Isometry3::from_parts(
                Translation3::new(0.1, -0.2, 0.3),
                UnitQuaternion::from_euler_angles(0.1, 0.7, -2.0),
            ),
            ..CameraModel::paper()
        };
        for arm in [model.arm, Arm::ur5(), Arm::so101()] {
            let model = CameraModel { arm, ..model };
            let text = serde_json::to_string(&model).unwrap();
            assert_eq!(serde_json::from_str::<CameraModel>(&text).unwrap(), model);
        }
    }

    #[test]
    fn a_located_ball_shows_as_it_was_seen() {
        let model = CameraModel::paper();
        let joints = Joints::from_degrees([10.0, -80.0, 195.0, 0.0, 45.0, 0.0]);
        for (x, y, r) in [
            (96.0, 72.0, 9.5),
            (10.0, 130.0, 12.0),
            (103.5, 78.0, 33.0),
            (150.0, 20.0, 60.0),
        ] {
            let features = Features::new(x, y, r);
            let ball = model.locate(&joints, &features).unwrap();
            let seen = model.view(&joints, &ball).unwrap();
            assert!(
                (seen.x - x).abs() < 1e-6 && (seen.y - y).abs() < 1e-6 && (seen.r - r).abs() < 1e-6,
                "{seen:?}"
            );
        }
        assert!(
            model
                .locate(&joints, &Features::new(96.0, f64::NAN, 10.0))
                .is_none()
        );
        assert!(model.view(&joints, &Point3::new(-5.0, 0.0, 2.0)).is_none());
    }

    #[test]
    fn at_the_goal_the_fifth_joint_brings_the_gripper_to_the_ball() {
        let model = CameraModel::paper();
        let goal = Joints::from_degrees([0.0, -53.0, 186.2, 0.0, 45.0, 0.0]);
        let ball = model
            .locate(&goal, &Features::new(103.5, 78.0, 33.0))
            .unwrap();
        let grip = Joints::from_degrees([0.0, -53.0, 186.2, 0.0, 26.99, 0.0]);
        assert!((model.tool_point(&grip) - ball).norm() < 0.0005);
    }
}
