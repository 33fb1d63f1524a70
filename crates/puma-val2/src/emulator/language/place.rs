//! Values of locations.

use nalgebra::Isometry3;

use crate::joints::Joints;
use crate::kinematics::xyzoat::Xyzoat;

/// Value of a location.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// A hand pose in the world frame (or relative to another one), metres.
    Transformation(Isometry3<f64>),
    /// A precision point: six joint angles.
    PrecisionPoint(Joints),
}

impl Place {
    /// Returns the six numbers that VAL shows: millimetres and degrees, or six joint angles in
    /// degrees.
    pub fn val(&self) -> [f64; 6] {
        match self {
            Self::Transformation(pose) => Xyzoat::from_pose(pose).val(),
            Self::PrecisionPoint(joints) => joints.degrees(),
        }
    }

    /// Returns a value of the same kind with these six numbers.
    pub(crate) fn with_val(&self, values: [f64; 6]) -> Self {
        match self {
            Self::Transformation(_) => Self::Transformation(Xyzoat::from_val(values).pose()),
            Self::PrecisionPoint(_) => Self::PrecisionPoint(Joints::from_degrees(values)),
        }
    }
}
