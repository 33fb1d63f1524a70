//! Where the camera sits on the hand.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion};

/// The pose of the camera frame in the hand frame.
///
/// Hand frame: origin at the wrist centre, z along the tool axis
/// ([`puma_val2::PumaParams::wrist`]). Camera frame: see [`crate::Camera`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mount(pub Isometry3<f64>);

impl Mount {
    /// The mount used throughout: 60 mm off the tool axis on the outer (upper) side of the hand,
    /// 4.5 mm to its left and 20 mm past the wrist centre, optical axis parallel to the tool axis,
    /// image right along -y and image down along +x.
    ///
    /// With it, and with `JT5` held at 45 degrees, the ball stands at the paper's goal (x 99..108,
    /// y 74..82, r 32..34) exactly where turning `JT5` alone brings the gripper to it.
    pub fn paper() -> Self {
        let axes = Matrix3::new(
            0.0, 1.0, 0.0, //
            -1.0, 0.0, 0.0, //
            0.0, 0.0, 1.0,
        );
        Self(Isometry3::from_parts(
            Translation3::new(-0.060, 0.0045, 0.020),
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes)),
        ))
    }

    /// The mount displaced by `shift` (metres, along the camera's own axes) and then turned in
    /// place by `roll` about the optical axis, `pitch` about the image's x axis and `yaw` about its
    /// y axis (radians).
    pub fn displaced(&self, shift: [f64; 3], roll: f64, pitch: f64, yaw: f64) -> Self {
        let turn = Rotation3::from_axis_angle(&nalgebra::Vector3::y_axis(), yaw)
            * Rotation3::from_axis_angle(&nalgebra::Vector3::x_axis(), pitch)
            * Rotation3::from_axis_angle(&nalgebra::Vector3::z_axis(), roll);
        let step = Isometry3::from_parts(
            Translation3::from(shift),
            UnitQuaternion::from_rotation_matrix(&turn),
        );
        Self(self.0 * step)
    }
}

impl Default for Mount {
    fn default() -> Self {
        Self::paper()
    }
}
