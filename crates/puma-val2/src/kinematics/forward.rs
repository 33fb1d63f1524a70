//! Joint angles to hand pose.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::joints::Joints;
use crate::kinematics::params::PumaParams;

impl PumaParams {
    /// Returns the pose of the flange in the world frame (metres).
    ///
    /// ```
    /// use puma_val2::{Joints, PumaParams};
    ///
    /// let ready = Joints::READY;
    /// let hand = PumaParams::unimation().forward(&ready);
    /// assert!((hand.translation.z - 0.92112).abs() < 1e-12);
    /// ```
    pub fn forward(&self, joints: &Joints) -> Isometry3<f64> {
        self.wrist(joints) * Translation3::new(0.0, 0.0, self.d6)
    }

    /// Returns the pose of the hand frame at the wrist centre: the intersection of the axes of
    /// `JT4`, `JT5` and `JT6`, z along the tool axis. [`PumaParams::forward`] lies `d6` further
    /// along z.
    pub fn wrist(&self, joints: &Joints) -> Isometry3<f64> {
        // Rz(theta) Tz(d) Tx(a) Rx(alpha) for each joint, with alpha a multiple of a quarter turn.
        let links: [(f64, f64, f64); 6] = [
            (-1.0, 0.0, 0.0),
            (0.0, self.a2, self.d2),
            (1.0, self.a3, 0.0),
            (-1.0, 0.0, self.d4),
            (1.0, 0.0, 0.0),
            (0.0, 0.0, 0.0),
        ];
        let mut axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        let mut position = Vector3::zeros();
        for (angle, (sin_alpha, a, d)) in joints.0.into_iter().zip(links) {
            let (s, c) = angle.sin_cos();
            let cos_alpha = 1.0 - sin_alpha * sin_alpha;
            let [x, y, z] = axes;
            position += x * (a * c) + y * (a * s) + z * d;
            // Sums of columns: products of matrices take several times as long.
            axes = [
                x * c + y * s,
                x * (-s * cos_alpha) + y * (c * cos_alpha) + z * sin_alpha,
                x * (s * sin_alpha) + y * (-c * sin_alpha) + z * cos_alpha,
            ];
        }
        let rotation = Matrix3::from_columns(&axes);
        let rotation =
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
        Isometry3::from_parts(position.into(), rotation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Named poses of the arm: joint degrees, position in millimetres, and the tool axis.
    #[test]
    fn named_poses_stand_where_the_literature_says() {
        let poses = [
            (
                [0.0, -90.0, 90.0, 0.0, 0.0, 0.0],
                [-20.32, 149.09, 921.12],
                [0.0, 0.0, 1.0],
            ),
            (
                [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
                [411.48, 149.09, 489.32],
                [0.0, 0.0, 1.0],
            ),
            (
                [90.0, 0.0, 90.0, 0.0, 0.0, 0.0],
                [-149.09, 921.12, 20.32],
                [0.0, 1.0, 0.0],
            ),
            (
                [0.0, 0.0, 90.0, 0.0, 0.0, 0.0],
                [921.12, 149.09, 20.32],
                [1.0, 0.0, 0.0],
            ),
            (
                [0.0, -45.0, 180.0, 0.0, 45.0, 0.0],
                [625.92, 149.09, -42.78],
                [0.0, 0.0, -1.0],
            ),
        ];
        let arm = PumaParams::unimation();
        for (degrees, millimetres, axis) in poses {
            let hand = arm.forward(&Joints::from_degrees(degrees));
            let position = hand.translation.vector * 1000.0;
            assert!(
                (position - Vector3::from(millimetres)).amax() < 0.005,
                "{degrees:?}: {position}"
            );
            assert!(
                (hand * Vector3::z() - Vector3::from(axis)).amax() < 1e-12,
                "{degrees:?}"
            );
        }
    }
}
