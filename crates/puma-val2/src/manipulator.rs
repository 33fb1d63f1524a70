//! Traits of an arm, and of its sensors.

use crate::error::ArmError;
use crate::joints::{JointDelta, Joints};

/// An arm that moves by joint angles.
///
/// Every call waits until the arm stands. A move ends at its goal, confirmed by the arm's own
/// report, or is an error; after an error [`Manipulator::joints`] returns the arm's position. Only
/// after [`ArmError::Unconfirmed`] and [`ArmError::Line`] the arm may still move: it has been told
/// to stop, if it could hear.
pub trait Manipulator {
    /// Returns the joint angles that the arm reports.
    ///
    /// # Errors
    /// Errors of the line or the controller.
    fn joints(&mut self) -> Result<Joints, ArmError>;

    /// Turns every joint by its part of `delta` and returns the joint angles that the arm reports
    /// afterwards.
    ///
    /// # Errors
    /// [`ArmError::JointLimit`] or [`ArmError::NotFinite`] before anything moves; otherwise errors
    /// of the line or the controller.
    fn move_by(&mut self, delta: JointDelta) -> Result<Joints, ArmError> {
        let target = self.joints()? + delta;
        self.move_to(target)
    }

    /// Turns the joints to `target` and returns the joint angles that the arm reports afterwards.
    ///
    /// # Errors
    /// The errors of [`Manipulator::move_by`].
    fn move_to(&mut self, target: Joints) -> Result<Joints, ArmError>;

    /// Opens or closes the gripper (default: nothing, for an arm without one).
    ///
    /// # Errors
    /// Errors of the line or the controller.
    fn set_gripper(&mut self, gripper: Gripper) -> Result<(), ArmError> {
        let _ = gripper;
        Ok(())
    }

    /// Stops the arm at once.
    ///
    /// # Errors
    /// Errors of the line or the controller.
    fn stop(&mut self) -> Result<(), ArmError>;
}

/// State of the gripper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Gripper {
    /// Jaws apart.
    Open,
    /// Jaws together, or on an object between them.
    Closed,
}

/// Pair of capacitive sensors on the hand (section 2 of the paper).
pub trait ProximitySensor {
    /// Returns `true` if something is so near to the hand that the arm must not go on.
    ///
    /// # Errors
    /// Errors of the line or the controller.
    fn object_near(&mut self) -> Result<bool, ArmError>;
}

/// No sensor: nothing is ever near.
impl ProximitySensor for () {
    fn object_near(&mut self) -> Result<bool, ArmError> {
        Ok(false)
    }
}

impl<T: Manipulator + ?Sized> Manipulator for &mut T {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        (**self).joints()
    }

    fn move_by(&mut self, delta: JointDelta) -> Result<Joints, ArmError> {
        (**self).move_by(delta)
    }

    fn move_to(&mut self, target: Joints) -> Result<Joints, ArmError> {
        (**self).move_to(target)
    }

    fn set_gripper(&mut self, gripper: Gripper) -> Result<(), ArmError> {
        (**self).set_gripper(gripper)
    }

    fn stop(&mut self) -> Result<(), ArmError> {
        (**self).stop()
    }
}
