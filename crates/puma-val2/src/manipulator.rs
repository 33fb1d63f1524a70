//! The doors of an arm: what a controller needs of it, whatever it is made of.

use crate::error::ArmError;
use crate::joints::{JointDelta, Joints};

/// An arm that moves by joint angles.
///
/// Every call waits until the arm stands. A move either ends where it was asked to, as the arm
/// itself reports, or is an error; after an error [`Manipulator::joints`] says where the arm
/// stands. Only [`ArmError::Unconfirmed`] and [`ArmError::Line`] leave open whether it does: the
/// arm has been told to stop, if it could still hear.
pub trait Manipulator {
    /// The joint angles that the arm reports.
    ///
    /// # Errors
    /// What kept the arm from answering.
    fn joints(&mut self) -> Result<Joints, ArmError>;

    /// Turns every joint by its part of `delta` and returns the joint angles that the arm reports
    /// afterwards.
    ///
    /// # Errors
    /// [`ArmError::JointLimit`] or [`ArmError::NotFinite`] before anything moves; otherwise what
    /// went wrong on the way.
    fn move_by(&mut self, delta: JointDelta) -> Result<Joints, ArmError>;

    /// Turns the joints to `target` and returns the joint angles that the arm reports afterwards.
    ///
    /// # Errors
    /// As for [`Manipulator::move_by`].
    fn move_to(&mut self, target: Joints) -> Result<Joints, ArmError>;

    /// Opens or closes the gripper.
    ///
    /// # Errors
    /// What kept the arm from doing so.
    fn set_gripper(&mut self, gripper: Gripper) -> Result<(), ArmError>;

    /// Stops the arm at once.
    ///
    /// # Errors
    /// What kept the message from reaching the arm.
    fn stop(&mut self) -> Result<(), ArmError>;
}

/// The two states of the gripper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Gripper {
    /// Jaws apart.
    Open,
    /// Jaws together, or on what lies between them.
    Closed,
}

/// The pair of capacitive sensors on the hand (section 2 of the paper).
pub trait ProximitySensor {
    /// Whether something is so near to the hand that the arm must not go on.
    ///
    /// # Errors
    /// What kept the sensor from being read.
    fn object_near(&mut self) -> Result<bool, ArmError>;
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
