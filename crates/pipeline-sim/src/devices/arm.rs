//! An arm that moves at once.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use puma_val2::{ArmError, Gripper, JointDelta, Joints, Manipulator, ProximitySensor};

use crate::cell::errors::{Drive, Errors};
use crate::devices::shared_cell::SharedCell;

/// An arm without a controller that moves at once: a [`Manipulator`] and a [`ProximitySensor`].
///
/// It pushes the ball when it runs into it, carries it when it holds it, and records both
/// ([`SharedCell::contacts`]). With [`Errors`] its gears have play and its encoders count in steps:
/// it reports the angles of the motors, and [`SimulatedArm::pose`] returns those of the links.
#[derive(Clone, Debug)]
pub struct SimulatedArm {
    cell: SharedCell,
    drive: Arc<Mutex<Drive>>,
}

impl SimulatedArm {
    /// Creates a perfect arm in `cell`, standing at `joints`.
    ///
    /// # Errors
    /// [`ArmError::JointLimit`] or [`ArmError::NotFinite`] if it cannot stand there.
    pub fn new(cell: SharedCell, joints: Joints) -> Result<Self, ArmError> {
        Self::with_errors(cell, joints, &Errors::none())
    }

    /// Creates an arm with the backlash and the encoder steps of `errors`, sent to `joints`.
    /// ([`Errors::apply`] puts the other errors into the cell.)
    ///
    /// # Errors
    /// Those of [`SimulatedArm::new`]; [`ArmError::Setting`] for backlash or an encoder step that
    /// is not finite, below zero or above half a turn.
    pub fn with_errors(
        cell: SharedCell,
        joints: Joints,
        errors: &Errors,
    ) -> Result<Self, ArmError> {
        errors.check_drive()?;
        cell.with(|cell| cell.params.check(&joints))?;
        let drive = Arc::new(Mutex::new(Drive::new(joints, errors)));
        Ok(Self { cell, drive })
    }

    /// Returns a closure that reads the angles of the links whenever it is called, for
    /// [`CellCamera::new`](crate::CellCamera::new) and
    /// [`FeatureCamera::new`](crate::FeatureCamera::new).
    pub fn pose(&self) -> impl FnMut() -> Joints + Send + use<> {
        let drive = Arc::clone(&self.drive);
        move || locked(&drive).links()
    }
}

/// Locks plain data, which stays valid when a thread panics.
fn locked(drive: &Mutex<Drive>) -> MutexGuard<'_, Drive> {
    drive.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Manipulator for SimulatedArm {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        Ok(locked(&self.drive).reported())
    }

    fn move_by(&mut self, delta: JointDelta) -> Result<Joints, ArmError> {
        let target = locked(&self.drive).reported() + delta;
        self.move_to(target)
    }

    fn move_to(&mut self, target: Joints) -> Result<Joints, ArmError> {
        let mut drive = locked(&self.drive);
        self.cell.with(|cell| cell.params.check(&target))?;
        let from = drive.links();
        drive.send(target);
        self.cell.sweep(&from, &drive.links());
        Ok(drive.reported())
    }

    fn set_gripper(&mut self, gripper: Gripper) -> Result<(), ArmError> {
        let joints = locked(&self.drive).links();
        self.cell.set_gripper(gripper, &joints);
        Ok(())
    }

    fn stop(&mut self) -> Result<(), ArmError> {
        Ok(())
    }
}

impl ProximitySensor for SimulatedArm {
    fn object_near(&mut self) -> Result<bool, ArmError> {
        let joints = locked(&self.drive).links();
        Ok(self.cell.with(|cell| cell.proximity(&joints)))
    }
}
