//! An arm that moves at once.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use puma_val2::{ArmError, Gripper, JointDelta, Joints, Manipulator, ProximitySensor};

use crate::devices::shared_cell::SharedCell;

/// An arm without a controller that moves at once: a [`Manipulator`] and a [`ProximitySensor`].
///
/// It pushes the ball when it runs into it, carries it when it holds it, and records both
/// ([`SharedCell::contacts`]). It makes the errors of its cell ([`SharedCell::set_errors`]) and
/// reports what its encoders read; [`SimulatedArm::pose`] returns the angles of the links.
#[derive(Clone, Debug)]
pub struct SimulatedArm {
    cell: SharedCell,
    drive: Arc<Mutex<Drive>>,
}

/// Motors and gears.
#[derive(Clone, Copy, Debug)]
struct Drive {
    /// Angles that the encoders read.
    read: Joints,
    /// Joint angles behind the play of the gears.
    driven: Joints,
}

impl SimulatedArm {
    /// Creates an arm in `cell`, sent to `joints`.
    ///
    /// # Errors
    /// [`ArmError::JointLimit`] or [`ArmError::NotFinite`] if it cannot stand there.
    pub fn new(cell: SharedCell, joints: Joints) -> Result<Self, ArmError> {
        cell.with(|cell| cell.arm.check(&joints))?;
        let mut drive = Drive {
            read: joints,
            driven: joints,
        };
        drive.send(joints, &cell);
        let drive = Arc::new(Mutex::new(drive));
        Ok(Self { cell, drive })
    }

    /// Returns a closure that reads the angles of the links whenever it is called, for
    /// [`CellCamera::new`](crate::CellCamera::new) and
    /// [`FeatureCamera::new`](crate::FeatureCamera::new).
    pub fn pose(&self) -> impl FnMut() -> Joints + Send + use<> {
        let arm = self.clone();
        move || arm.links()
    }

    fn links(&self) -> Joints {
        let driven = self.drive().driven;
        self.cell.links(&driven)
    }

    fn drive(&self) -> MutexGuard<'_, Drive> {
        // Plain data stays valid when a thread panics.
        self.drive.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drive {
    /// Turns the motors to the counts nearest to `target`; the links follow once the play is used
    /// up.
    fn send(&mut self, target: Joints, cell: &SharedCell) {
        let errors = cell.errors();
        let half = 0.5 * errors.backlash;
        for i in 0..6 {
            let (angle, step) = (target.0[i], errors.encoder_step[i]);
            let motor = if step > 0.0 {
                (angle / step).round() * step
            } else {
                angle
            };
            self.read.0[i] = motor;
            self.driven.0[i] = self.driven.0[i].clamp(motor - half, motor + half);
        }
    }
}

impl Manipulator for SimulatedArm {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        Ok(self.drive().read)
    }

    fn move_by(&mut self, delta: JointDelta) -> Result<Joints, ArmError> {
        let target = self.drive().read + delta;
        self.move_to(target)
    }

    fn move_to(&mut self, target: Joints) -> Result<Joints, ArmError> {
        self.cell.with(|cell| cell.arm.check(&target))?;
        let from = self.links();
        let read = {
            let mut drive = self.drive();
            let target = self.cell.overcome_friction(&drive.read, &target);
            drive.send(target, &self.cell);
            drive.read
        };
        self.cell.sweep(&from, &self.links());
        Ok(read)
    }

    fn set_gripper(&mut self, gripper: Gripper) -> Result<(), ArmError> {
        self.cell.set_gripper(gripper, &self.links());
        Ok(())
    }

    fn stop(&mut self) -> Result<(), ArmError> {
        Ok(())
    }
}

impl ProximitySensor for SimulatedArm {
    fn object_near(&mut self) -> Result<bool, ArmError> {
        let joints = self.links();
        Ok(self.cell.with(|cell| cell.proximity(&joints)))
    }
}
