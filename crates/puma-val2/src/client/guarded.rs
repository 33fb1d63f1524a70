//! An arm whose controller stops it when something comes too near to the hand.

use crate::client::val2_client::Val2Client;
use crate::error::ArmError;
use crate::joints::{JointDelta, Joints};
use crate::manipulator::{Gripper, Manipulator};
use crate::transport::Transport;

/// A [`Val2Client`] whose moves are watched by the controller itself
/// ([`Val2Client::arm_proximity`]).
///
/// A stop ([`ArmError::ProximityStop`]) disarms the guard, so that the arm can go back the way it
/// came. The guard is armed again after a move that has ended with nothing near.
#[derive(Debug)]
pub struct GuardedArm<T: Transport> {
    client: Val2Client<T>,
    signal: u16,
    armed: bool,
}

impl<T: Transport> GuardedArm<T> {
    /// Arms the guard on [`ClientConfig::proximity_signal`](crate::ClientConfig::proximity_signal).
    ///
    /// # Errors
    /// Those of [`Val2Client::arm_proximity`].
    pub fn new(mut client: Val2Client<T>) -> Result<Self, ArmError> {
        let signal = client.config().proximity_signal;
        client.arm_proximity(signal)?;
        Ok(Self {
            client,
            signal,
            armed: true,
        })
    }

    fn watched(
        &mut self,
        order: impl FnOnce(&mut Val2Client<T>) -> Result<Joints, ArmError>,
    ) -> Result<Joints, ArmError> {
        let outcome = order(&mut self.client);
        if matches!(outcome, Err(ArmError::ProximityStop { .. })) {
            self.armed = false;
        } else if outcome.is_ok() && !self.armed && !self.client.signal(self.signal)? {
            self.client.arm_proximity(self.signal)?;
            self.armed = true;
        }
        outcome
    }
}

impl<T: Transport> Manipulator for GuardedArm<T> {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        self.client.joints()
    }

    fn move_by(&mut self, delta: JointDelta) -> Result<Joints, ArmError> {
        self.watched(|client| client.move_by(delta))
    }

    fn move_to(&mut self, target: Joints) -> Result<Joints, ArmError> {
        self.watched(|client| client.move_to(target))
    }

    fn set_gripper(&mut self, gripper: Gripper) -> Result<(), ArmError> {
        self.client.set_gripper(gripper)
    }

    fn stop(&mut self) -> Result<(), ArmError> {
        self.client.stop()
    }
}
