//! Joint speeds to hand speeds, and the poses where that mapping fails.

use std::fmt;

use nalgebra::{Matrix6, Vector3, Vector6};

use crate::joints::Joints;
use crate::kinematics::params::PumaParams;

/// A posture in which the hand cannot move in some direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Singularity {
    /// `JT5` is straight (or folded back): the axes of `JT4` and `JT6` lie in one line.
    Wrist,
    /// The arm is stretched (or folded) from shoulder to wrist centre.
    Elbow,
    /// The wrist centre is as near to the waist axis as the arm's lateral offset allows.
    Shoulder,
}

impl fmt::Display for Singularity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Wrist => "the wrist is straight: JT4 and JT6 turn about one axis",
            Self::Elbow => "the elbow is straight: the wrist cannot move away from the shoulder",
            Self::Shoulder => {
                "the wrist is over the waist: it cannot move sideways of the upper arm"
            }
        })
    }
}

impl PumaParams {
    /// Returns the Jacobian of the flange in the world frame: rows vx vy vz (metres per radian) wx
    /// wy wz, one column per joint.
    pub fn jacobian(&self, joints: &Joints) -> Matrix6<f64> {
        let [t1, t2, t3, t4, t5, _] = joints.0;
        let ((s1, c1), (s2, c2), (s23, c23)) = (t1.sin_cos(), t2.sin_cos(), (t2 + t3).sin_cos());
        let ((s4, c4), (s5, c5)) = (t4.sin_cos(), t5.sin_cos());
        // From the arm's own frame behind JT3 (x ahead, y along the shoulder axis) to the world.
        let forearm = |v: Vector3<f64>| {
            let ahead = c23 * v.x + s23 * v.z;
            Vector3::new(
                c1 * ahead - s1 * v.y,
                s1 * ahead + c1 * v.y,
                -s23 * v.x + c23 * v.z,
            )
        };
        let shoulder_axis = Vector3::new(-s1, c1, 0.0);
        let elbow = Vector3::new(c1 * self.a2 * c2, s1 * self.a2 * c2, -self.a2 * s2)
            + shoulder_axis * self.d2;
        let wrist = elbow + forearm(Vector3::new(self.a3, 0.0, self.d4));
        let tool_axis = forearm(Vector3::new(c4 * s5, s4 * s5, c5));
        let flange = wrist + tool_axis * self.d6;
        let axes = [
            (Vector3::z(), Vector3::zeros()),
            (shoulder_axis, Vector3::zeros()),
            (shoulder_axis, elbow),
            (forearm(Vector3::z()), wrist),
            (forearm(Vector3::new(-s4, c4, 0.0)), wrist),
            (tool_axis, wrist),
        ];
        Matrix6::from_columns(&axes.map(|(axis, through)| {
            let v = axis.cross(&(flange - through));
            Vector6::new(v.x, v.y, v.z, axis.x, axis.y, axis.z)
        }))
    }

    /// Returns the Jacobian with speeds in the flange's own frame.
    pub fn jacobian_tool(&self, joints: &Joints) -> Matrix6<f64> {
        let back = self.forward(joints).rotation.inverse().to_rotation_matrix();
        let mut jacobian = self.jacobian(joints);
        for mut column in jacobian.column_iter_mut() {
            let linear = back * Vector3::new(column[0], column[1], column[2]);
            let angular = back * Vector3::new(column[3], column[4], column[5]);
            column.fixed_rows_mut::<3>(0).copy_from(&linear);
            column.fixed_rows_mut::<3>(3).copy_from(&angular);
        }
        jacobian
    }

    /// Returns the first singularity that the arm is nearer to than `margin`: the sine of `JT5`,
    /// the sine of the elbow's angle away from straight, or the wrist's distance ahead of the
    /// shoulder in units of the stretched arm. 0.02 is about a degree.
    ///
    /// READY is at the wrist's singularity and 2.7 degrees off the elbow's.
    pub fn singularity(&self, joints: &Joints, margin: f64) -> Option<Singularity> {
        let forearm = self.d4.hypot(self.a3);
        let straight = self.elbow_lever(joints) / forearm;
        let ahead = self.wrist_ahead(joints);
        if joints.0[4].sin().abs() < margin {
            Some(Singularity::Wrist)
        } else if straight.abs() < margin {
            Some(Singularity::Elbow)
        } else if ahead.abs() < margin * (self.a2 + forearm) {
            Some(Singularity::Shoulder)
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_the_derivatives_of_the_forward_kinematics() {
        let arm = PumaParams::unimation();
        let joints = Joints::from_degrees([20.0, -70.0, 120.0, 30.0, 40.0, -50.0]);
        let (jacobian, at, step) = (arm.jacobian(&joints), arm.forward(&joints), 1e-6);
        for i in 0..6 {
            let mut moved = joints;
            moved.0[i] += step;
            let after = arm.forward(&moved);
            let linear = (after.translation.vector - at.translation.vector) / step;
            let angular = (after.rotation * at.rotation.inverse()).scaled_axis() / step;
            let column = jacobian.column(i);
            assert!(
                (linear - column.fixed_rows::<3>(0)).amax() < 1e-6,
                "joint {}",
                i + 1
            );
            assert!(
                (angular - column.fixed_rows::<3>(3)).amax() < 1e-6,
                "joint {}",
                i + 1
            );
        }
    }

    #[test]
    fn singular_postures_are_named_and_have_no_determinant() {
        let arm = PumaParams::unimation();
        let cases = [
            ([0.0, -90.0, 90.0, 0.0, 0.0, 0.0], Some(Singularity::Wrist)),
            ([0.0, -45.0, 180.0, 0.0, 45.0, 0.0], None),
        ];
        for (degrees, wanted) in cases {
            assert_eq!(
                arm.singularity(&Joints::from_degrees(degrees), 0.02),
                wanted
            );
        }
        // d4 cos JT3 = a3 sin JT3
        let t3 = (arm.d4).atan2(arm.a3);
        let stretched = Joints([0.3, -0.4, t3, 0.0, 0.8, 0.0]);
        assert_eq!(arm.singularity(&stretched, 0.02), Some(Singularity::Elbow));
        assert!(arm.jacobian(&stretched).determinant().abs() < 1e-12);
        // A wrist straight above the shoulder.
        let over = arm.inverse(&nalgebra::Isometry3::from_parts(
            nalgebra::Translation3::new(0.0, arm.d2 + arm.d6, 0.6),
            nalgebra::UnitQuaternion::from_axis_angle(
                &Vector3::x_axis(),
                -std::f64::consts::FRAC_PI_2,
            ),
        ));
        let over = over.unwrap()[0].joints;
        assert_eq!(arm.singularity(&over, 0.02), Some(Singularity::Shoulder));
        assert!(arm.jacobian(&over).determinant().abs() < 1e-9);
    }
}
