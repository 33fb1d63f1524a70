//! The arm between a base and a tool.

use nalgebra::Isometry3;

use crate::joints::Joints;
use crate::kinematics::params::PumaParams;

/// Position of the arm in the world and tool at its flange: VAL's `BASE` and `TOOL`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Frames {
    /// The arm's own frame (origin at the shoulder) in the world frame, metres.
    pub base: Isometry3<f64>,
    /// The hand frame in the flange frame, metres.
    pub tool: Isometry3<f64>,
}

impl Default for Frames {
    /// Both at the unit transformation: VAL's `BASE` without arguments and `TOOL NULL`.
    fn default() -> Self {
        Self {
            base: Isometry3::identity(),
            tool: Isometry3::identity(),
        }
    }
}

impl Frames {
    /// Returns the hand in the world.
    pub fn hand(&self, arm: &PumaParams, joints: &Joints) -> Isometry3<f64> {
        self.base * arm.forward(joints) * self.tool
    }

    /// Returns the flange in the arm's own frame when the hand is at `hand` in the world, for
    /// [`PumaParams::inverse`].
    pub fn flange(&self, hand: &Isometry3<f64>) -> Isometry3<f64> {
        self.base.inverse() * hand * self.tool.inverse()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Translation3, UnitQuaternion, Vector3};

    #[test]
    fn the_flange_of_a_hand_leads_back_to_the_joints() {
        let arm = PumaParams::unimation();
        let frames = Frames {
            base: Isometry3::from_parts(
                Translation3::new(0.1, -0.2, 0.3),
                UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.7),
            ),
            tool: Isometry3::from_parts(
                Translation3::new(0.0, 0.02, 0.12),
                UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -0.4),
            ),
        };
        let joints = Joints::from_degrees([30.0, -60.0, 140.0, 25.0, 50.0, -70.0]);
        let flange = frames.flange(&frames.hand(&arm, &joints));
        let back = arm.inverse_near(&flange, &joints, None).unwrap();
        assert!((back - joints).0.iter().all(|d| d.abs() < 1e-12));
    }
}
