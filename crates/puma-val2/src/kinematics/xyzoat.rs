//! A pose in VAL's six numbers: X Y Z and the angles O A T.

use std::fmt;

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion};

/// Hand pose in VAL's six numbers: a position and the angles O, A, T.
///
/// The rotation is `Rz(o) R0 Ry(a) Rz(t)` with `R0 = [[0,1,0],[0,0,-1],[-1,0,0]]` (Fu, Gonzalez,
/// Lee, *Robotics*, 1987, chapter 2): with all three angles zero the tool axis points along -y and
/// the line from finger to finger along x. These are *not* the ZYZ angles that V+ and AS call by
/// similar letters: the unit rotation is (90, -90, 0) here.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Xyzoat {
    /// Position along x, metres.
    pub x: f64,
    /// Position along y, metres.
    pub y: f64,
    /// Position along z, metres.
    pub z: f64,
    /// Orientation angle O about the vertical, radians.
    pub o: f64,
    /// Altitude angle A, radians, -90 to 90 degrees when taken from a pose.
    pub a: f64,
    /// Tool angle T about the tool axis, radians.
    pub t: f64,
}

impl Xyzoat {
    /// Converts from VAL's own units, millimetres and degrees.
    pub fn from_val(values: [f64; 6]) -> Self {
        let [x, y, z, o, a, t] = values;
        Self {
            x: x / 1000.0,
            y: y / 1000.0,
            z: z / 1000.0,
            o: o.to_radians(),
            a: a.to_radians(),
            t: t.to_radians(),
        }
    }

    /// Returns the numbers in VAL's own units: millimetres and degrees, angles in (-180, 180].
    pub fn val(&self) -> [f64; 6] {
        [
            self.x * 1000.0,
            self.y * 1000.0,
            self.z * 1000.0,
            self.o.to_degrees(),
            self.a.to_degrees(),
            self.t.to_degrees(),
        ]
    }

    /// Returns the six numbers of a pose. Where the tool axis is vertical, T is 0.
    pub fn from_pose(pose: &Isometry3<f64>) -> Self {
        let r = pose.rotation.to_rotation_matrix().into_inner();
        let (ax, ay, az) = (r[(0, 2)], r[(1, 2)], r[(2, 2)]);
        let horizontal = ax.hypot(ay);
        let (o, t) = if horizontal > 1e-9 {
            (ax.atan2(-ay), r[(2, 1)].atan2(-r[(2, 0)]))
        } else {
            let up = if az < 0.0 { 1.0 } else { -1.0 };
            ((-r[(0, 0)] * up).atan2(r[(1, 0)] * up), 0.0)
        };
        Self {
            x: pose.translation.x,
            y: pose.translation.y,
            z: pose.translation.z,
            o,
            a: (-az).atan2(horizontal),
            t,
        }
    }

    /// Returns the pose of the six numbers.
    pub fn pose(&self) -> Isometry3<f64> {
        let ((so, co), (sa, ca), (st, ct)) = (self.o.sin_cos(), self.a.sin_cos(), self.t.sin_cos());
        let rotation = Matrix3::new(
            co * st - so * sa * ct,
            co * ct + so * sa * st,
            so * ca,
            so * st + co * sa * ct,
            so * ct - co * sa * st,
            -co * ca,
            -ca * ct,
            ca * st,
            -sa,
        );
        Isometry3::from_parts(
            Translation3::new(self.x, self.y, self.z),
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation)),
        )
    }

    /// Returns `true` if all six numbers are finite.
    pub(crate) fn is_finite(&self) -> bool {
        self.val().iter().all(|v| v.is_finite())
    }
}

impl fmt::Display for Xyzoat {
    /// Formats millimetres with two decimals, degrees with three: `X 75.14 Y 164.64 Z 915.57 O
    /// 100.000 A -80.000 T 0.000`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z, o, a, t] = self.val();
        write!(f, "X {x:.2} Y {y:.2} Z {z:.2} O {o:.3} A {a:.3} T {t:.3}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::joints::Joints;
    use crate::kinematics::params::PumaParams;

    #[test]
    fn ready_shows_ninety_minus_ninety_zero() {
        let ready = Joints::READY;
        let shown = Xyzoat::from_pose(&PumaParams::unimation().forward(&ready)).val();
        let wanted = [-20.32, 149.09, 921.12, 90.0, -90.0, 0.0];
        assert!(
            shown.iter().zip(wanted).all(|(s, w)| (s - w).abs() < 1e-9),
            "{shown:?}"
        );
    }

    #[test]
    fn all_zero_points_along_minus_y() {
        let pose = Xyzoat::default().pose();
        assert!((pose * nalgebra::Vector3::z() + nalgebra::Vector3::y()).amax() < 1e-15);
    }
}
