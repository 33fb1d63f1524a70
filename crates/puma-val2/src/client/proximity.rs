//! Proximity sensors: reading them, and stopping the arm by them.

use std::time::Duration;

use crate::client::number::plain;
use crate::client::val2_client::Val2Client;
use crate::client::wire::Failed;
use crate::error::ArmError;
use crate::joints::Joints;
use crate::manipulator::ProximitySensor;
use crate::transport::Transport;

/// Programs of the guard: one for moves of the joints, one for a single move of another kind, and
/// the one that the signal calls.
const RUN: &str = "PGRUN";
const ONCE: &str = "PGONCE";
const HIT: &str = "PGHIT";

/// Variable in which the called program notes that it ran. A signal that has come and gone leaves
/// nothing else behind.
const LATCH: &str = "PGH";

impl<T: Transport> Val2Client<T> {
    /// Lets the controller itself stop the next motions when input `signal` comes on (`REACTI`).
    ///
    /// A move during which the signal comes, even for a moment, ends in [`ArmError::ProximityStop`]
    /// and disarms the guard: the way back is free until it is armed again. Motions run inside
    /// small programs that are stored in the controller (`PGRUN`, `PGONCE`, `PGHIT`; older programs
    /// of these names are replaced), because it is not known whether a monitor watches signals
    /// while no program runs.
    ///
    /// While the guard is armed, moves of several joints are always coordinated, and
    /// [`Val2Client::drive`], [`Val2Client::ready`] and [`Val2Client::move_hand`] run inside a
    /// program as well. [`Val2Client::calibrate`], [`Val2Client::execute`] and
    /// [`Val2Client::resident`] cannot be guarded and are refused with [`ArmError::Setting`].
    ///
    /// # Errors
    /// Errors of the line or the controller: there is no such signal, for instance.
    pub fn arm_proximity(&mut self, signal: u16) -> Result<(), ArmError> {
        self.signal(signal)?;
        self.type_program(HIT, &[format!("{LATCH} = -1"), "HALT".to_owned()])?;
        let to_goal = format!("MOVE {}", self.goal());
        let steps = self.steps_to_point(&to_goal);
        self.type_program(RUN, &guarded_steps(signal, &steps))?;
        self.command(&format!("DO {LATCH} = 0"))?;
        if self.truth(LATCH)? {
            return Err(self.wire.garbled(LATCH, "0, as it was set", "-1"));
        }
        self.guard = Some(signal);
        Ok(())
    }

    /// Undoes [`Val2Client::arm_proximity`].
    ///
    /// # Errors
    /// None at present: the controller watches the signal only while a guarded move runs.
    pub fn disarm_proximity(&mut self) -> Result<(), ArmError> {
        self.guard = None;
        Ok(())
    }

    /// Returns the program that carries out a motion to a point under guard.
    pub(super) fn guarding(
        &mut self,
        speed: Option<f64>,
        motion: &str,
    ) -> Result<&'static str, ArmError> {
        let Some(signal) = self.guard else {
            return Ok(RUN);
        };
        if speed.is_none() && motion == format!("MOVE {}", self.goal()) {
            return Ok(RUN);
        }
        let mut steps = self.steps_to_point(motion);
        if let Some(speed) = speed {
            let at = steps.iter().position(|step| step == motion);
            steps.insert(at.unwrap_or(0), format!("SPEED {}", plain(speed)));
        }
        self.type_program(ONCE, &guarded_steps(signal, &steps))?;
        Ok(ONCE)
    }

    /// Runs these steps under guard. Their goal must not depend on the arm's position.
    pub(super) fn run_guarded_once(
        &mut self,
        signal: u16,
        motion: &[String],
        limit: Duration,
    ) -> Result<(), Failed> {
        self.type_program(ONCE, &guarded_steps(signal, motion))?;
        self.run(&format!("EXECUTE {ONCE}"), limit).map(drop)
    }

    /// Ends a guarded motion: a program that may still run is ended, and a signal that has come is
    /// reported, even if it has gone again. Returns the arm's position.
    pub(super) fn check_guard(
        &mut self,
        mut stands: Joints,
        doubtful: bool,
    ) -> Result<Joints, ArmError> {
        let Some(signal) = self.guard else {
            return Ok(stands);
        };
        if doubtful {
            self.end_program().map_err(|error| self.lost(error))?;
            stands = self.where_().map_err(|error| self.lost(error))?.joints;
        }
        if !self.truth(LATCH)? {
            return Ok(stands);
        }
        self.guard = None;
        Err(ArmError::ProximityStop {
            port: self.wire.port(),
            signal,
            joints: stands,
        })
    }
}

/// Returns the steps of a program that moves the arm under guard. If the signal is on already, the
/// arm stays.
fn guarded_steps(signal: u16, motion: &[String]) -> Vec<String> {
    let before = [
        format!("REACTI {signal},{HIT}"),
        format!("IF SIG({signal}) THEN"),
        format!("{LATCH} = -1"),
        "ELSE".to_owned(),
    ];
    let after = ["BREAK".to_owned(), "END".to_owned()];
    before.iter().chain(motion).chain(&after).cloned().collect()
}

impl<T: Transport> ProximitySensor for Val2Client<T> {
    /// Reads the input [`ClientConfig::proximity_signal`](crate::ClientConfig::proximity_signal).
    fn object_near(&mut self) -> Result<bool, ArmError> {
        self.signal(self.wire.config.proximity_signal)
    }
}
