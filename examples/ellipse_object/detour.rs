//! The way of a turned hand to an egg and back. A hand that swung in from the side would run a
//! finger into the egg.

use nalgebra::Translation3;
use puma_val2::{ArmError, Gripper, Joint, JointDelta, Joints, Manipulator, PumaParams};

/// Distance from the egg at which the hand turns, metres along the tool axis.
const ASIDE: f64 = 0.08;
/// Smallest turn of `JT6` that needs the detour, radians.
const TURNED: f64 = 0.05;

/// An arm that approaches and leaves a pose with a turned hand along the tool axis.
pub(crate) struct Detour<'a> {
    pub(crate) arm: &'a mut dyn Manipulator,
    pub(crate) params: PumaParams,
}

impl Detour<'_> {
    /// Returns the pose back along the tool axis from `joints` if the hand is turned there and can
    /// go.
    fn before(&self, joints: &Joints) -> Option<Joints> {
        let back = self.params.forward(joints) * Translation3::new(0.0, 0.0, -ASIDE);
        let posture = self.params.configuration(joints);
        let turned = joints[Joint::J6].abs() > TURNED;
        turned.then(|| self.params.inverse_near(&back, joints, Some(posture)).ok())?
    }
}

impl Manipulator for Detour<'_> {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        self.arm.joints()
    }

    fn move_by(&mut self, delta: JointDelta) -> Result<Joints, ArmError> {
        if delta[Joint::J6].abs() < TURNED {
            return self.arm.move_by(delta);
        }
        let target = self.arm.joints()? + delta;
        self.move_to(target)
    }

    fn move_to(&mut self, target: Joints) -> Result<Joints, ArmError> {
        let from = self.arm.joints()?;
        if (target[Joint::J6] - from[Joint::J6]).abs() > TURNED {
            for leg in [self.before(&from), self.before(&target)]
                .into_iter()
                .flatten()
            {
                self.arm.move_to(leg)?;
            }
        }
        self.arm.move_to(target)
    }

    fn set_gripper(&mut self, gripper: Gripper) -> Result<(), ArmError> {
        self.arm.set_gripper(gripper)
    }

    fn stop(&mut self) -> Result<(), ArmError> {
        self.arm.stop()
    }
}
