//! An arm that does not know the cell, and sensors for it.

use std::sync::{Arc, Mutex, PoisonError};

use puma_val2::{ArmError, Gripper, JointDelta, Joints, Manipulator, ProximitySensor};

use crate::devices::shared_cell::SharedCell;

impl SharedCell {
    /// Wraps an arm whose jaws act on the cell. `pose` returns the angles of its links
    /// ([`SharedCell::links`]); whoever moves them calls [`SharedCell::move_hand`] on the way.
    pub fn with_jaws_of<M, P>(&self, arm: M, pose: P) -> impl Manipulator + use<M, P>
    where
        M: Manipulator,
        P: FnMut() -> Joints + Send,
    {
        FollowedArm {
            arm,
            cell: self.clone(),
            pose,
            reported: None,
        }
    }

    /// Wraps an arm, now at `start`, that the cell follows by the joints which the arm reports at
    /// the end of each move. Returns it with a closure that reads the last angles of its links.
    pub fn follow<M: Manipulator>(
        &self,
        arm: M,
        start: Joints,
    ) -> (
        impl Manipulator + use<M>,
        impl Fn() -> Joints + Clone + Send + Sync + use<M>,
    ) {
        self.move_hand(&self.links(&start));
        let reported = Arc::new(Mutex::new(start));
        let read = {
            let (cell, reported) = (self.clone(), Arc::clone(&reported));
            move || cell.links(&reported.lock().unwrap_or_else(PoisonError::into_inner))
        };
        let arm = FollowedArm {
            arm,
            cell: self.clone(),
            pose: read.clone(),
            reported: Some(reported),
        };
        (arm, read)
    }

    /// Returns the proximity sensors on a hand at the pose that `pose` returns.
    pub fn sensor<P>(&self, pose: P) -> impl ProximitySensor + use<P>
    where
        P: FnMut() -> Joints + Send,
    {
        CellSensor(self.clone(), pose)
    }
}

struct CellSensor<P>(SharedCell, P);

impl<P: FnMut() -> Joints + Send> ProximitySensor for CellSensor<P> {
    fn object_near(&mut self) -> Result<bool, ArmError> {
        let joints = (self.1)();
        Ok(self.0.with(|cell| cell.proximity(&joints)))
    }
}

struct FollowedArm<M, P> {
    arm: M,
    cell: SharedCell,
    pose: P,
    /// Last joints reported, of an arm that the cell follows by its reports.
    reported: Option<Arc<Mutex<Joints>>>,
}

impl<M, P> FollowedArm<M, P> {
    fn has_friction(&self) -> bool {
        let errors = self.cell.errors();
        errors.stiction > 0.0 || errors.dead_zone > 0.0
    }

    fn note(&self, outcome: Result<Joints, ArmError>) -> Result<Joints, ArmError> {
        let stands = match &outcome {
            Ok(joints) | Err(ArmError::ProximityStop { joints, .. }) => Some(joints),
            Err(_) => None,
        };
        if let (Some(reported), Some(joints)) = (&self.reported, stands) {
            *reported.lock().unwrap_or_else(PoisonError::into_inner) = *joints;
            self.cell.move_hand(&self.cell.links(joints));
        }
        outcome
    }
}

impl<M: Manipulator, P: FnMut() -> Joints + Send> Manipulator for FollowedArm<M, P> {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        let joints = self.arm.joints();
        self.note(joints)
    }

    fn move_by(&mut self, delta: JointDelta) -> Result<Joints, ArmError> {
        if self.has_friction() {
            let target = self.arm.joints()? + delta;
            return self.move_to(target);
        }
        let joints = self.arm.move_by(delta);
        self.note(joints)
    }

    fn move_to(&mut self, mut target: Joints) -> Result<Joints, ArmError> {
        if self.has_friction() {
            let reported = self.arm.joints()?;
            target = self.cell.overcome_friction(&reported, &target);
        }
        let joints = self.arm.move_to(target);
        self.note(joints)
    }

    fn set_gripper(&mut self, gripper: Gripper) -> Result<(), ArmError> {
        self.arm.set_gripper(gripper)?;
        self.cell.set_gripper(gripper, &(self.pose)());
        Ok(())
    }

    fn stop(&mut self) -> Result<(), ArmError> {
        self.arm.stop()
    }
}
