//! The proximity sensors: read, and set up to stop the arm.

use super::wire::is_doubt;
use super::{Ending, Val2Client, shortened};
use crate::{ArmError, Joints, ProximitySensor, Transport};

/// Names of the two programs that guard a motion where the monitor itself does not watch signals.
const RUN: &str = "PGRUN";
const HIT: &str = "PGHIT";

/// A signal that stops the arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Guard {
    pub(super) signal: u16,
    /// Whether motions have to run inside a program for the controller to watch the signal.
    pub(super) by_program: bool,
}

impl<T: Transport> Val2Client<T> {
    /// Lets the controller itself stop the next motions as soon as input `signal` comes on, without waiting for us (`REACTI`).
    ///
    /// A move that is stopped so ends in [`ArmError::ProximityStop`] and uses the guard up: the way back is free until it is armed again. Where
    /// the monitor does not take `DO REACTI`, two small programs are stored in the controller (`PGRUN`, `PGHIT`; older ones of these names are
    /// replaced) and moves run inside them. While armed, moves of several joints are always coordinated.
    ///
    /// # Errors
    /// What the line or the controller said.
    pub fn arm_proximity(&mut self, signal: u16) -> Result<(), ArmError> {
        let by_program = match self.command(&format!("DO REACTI {signal}")) {
            Ok(_) => false,
            Err(ArmError::Refused { .. }) => {
                self.store_guard(signal)?;
                true
            }
            Err(error) => return Err(error),
        };
        self.guard = Some(Guard { signal, by_program });
        Ok(())
    }

    /// Undoes [`Val2Client::arm_proximity`].
    ///
    /// # Errors
    /// What the line or the controller said.
    pub fn disarm_proximity(&mut self) -> Result<(), ArmError> {
        match self.guard.take() {
            Some(Guard {
                signal,
                by_program: false,
            }) => self.command(&format!("DO IGNORE {signal}")).map(drop),
            _ => Ok(()),
        }
    }

    fn store_guard(&mut self, signal: u16) -> Result<(), ArmError> {
        self.store_program(HIT, &["HALT".to_owned()])?;
        let steps = [
            format!("REACTI {signal},{HIT}"),
            format!("MOVE #{}", self.config.point_name),
            "BREAK".to_owned(),
        ];
        self.store_program(RUN, &steps)
    }

    /// Types a program into the controller's editor, replacing one of the same name, and compares it with what the controller lists.
    ///
    /// # Errors
    /// What the line or the controller said; [`ArmError::Garbled`] if the listing differs several times over.
    pub fn store_program(&mut self, name: &str, steps: &[String]) -> Result<(), ArmError> {
        let mut tries = 0;
        loop {
            match self.store_once(name, steps) {
                Err(error) if is_doubt(&error) && tries < self.config.retries => {
                    tries += 1;
                    self.wire.settle(&self.config)?;
                }
                outcome => return outcome,
            }
        }
    }

    fn store_once(&mut self, name: &str, steps: &[String]) -> Result<(), ArmError> {
        let patience = self.config.reply_timeout * 4;
        let mut say = |line: &str| {
            self.wire
                .exchange(line, patience, &self.config)
                .map_err(|failed| failed.error)
        };
        // An old program of this name, if there is one; that there is none is no fault.
        if say(&format!("DELETEP {name}"))?.ending == Ending::Question {
            say("Y")?;
        }
        let mut last = say(&format!("EDIT {name}"))?;
        for step in steps {
            last = say(step)?;
        }
        if last.ending != Ending::Question {
            let heard = shortened(&last.text);
            return Err(self.wire.garbled(name, "the editor's prompt", &heard));
        }
        say("E")?;
        let listed = say(&format!("LISTP {name}"))?.text.to_ascii_uppercase();
        let all_there = steps.iter().all(|step| {
            let step = step.to_ascii_uppercase();
            listed
                .split(['\r', '\n'])
                .any(|line| line.trim_end().ends_with(&step))
        });
        if all_there {
            return Ok(());
        }
        let heard = shortened(&listed);
        Err(self.wire.garbled(name, "a listing of what was typed", &heard))
    }

    /// Runs a stored program to its end and returns what it printed. A program that asks for values is aborted.
    ///
    /// # Errors
    /// What the line or the controller said, its messages in asterisks included; [`ArmError::Silence`] after `config.motion_timeout`, the program
    /// aborted.
    pub fn execute(&mut self, program: &str) -> Result<String, ArmError> {
        let line = format!("EXECUTE {program}");
        self.last_known = None;
        self.run(&line).map_err(|failed| failed.error)
    }

    /// Aborts the program that runs, if one does.
    ///
    /// # Errors
    /// What the line said.
    pub fn abort(&mut self) -> Result<(), ArmError> {
        let patience = self.config.motion_timeout;
        match self.wire.exchange_to_end("ABORT", patience, &self.config) {
            Ok(_) => Ok(()),
            Err(failed) => Err(failed.error),
        }
    }

    pub(super) fn run(&mut self, line: &str) -> Result<String, super::Failed> {
        let patience = self.config.motion_timeout;
        let after = |error| super::Failed {
            error,
            maybe_done: true,
        };
        let reply = match self.wire.exchange_to_end(line, patience, &self.config) {
            Err(failed) if failed.maybe_done && matches!(failed.error, ArmError::Silence { .. }) => {
                self.abort().map_err(after)?;
                return Err(failed);
            }
            reply => reply?,
        };
        self.without_message(line, &reply)?;
        if reply.ending == Ending::Question {
            self.abort().map_err(after)?;
            let heard = shortened(&reply.text);
            return Err(after(self.wire.garbled(
                line,
                "a program that asks for nothing",
                &heard,
            )));
        }
        Ok(reply.text)
    }

    /// A motion under guard of a program: the point is defined already.
    pub(super) fn run_guarded(&mut self) -> Result<(), super::Failed> {
        self.run(&format!("EXECUTE {RUN}")).map(drop)
    }

    /// The arm stands short of its goal: whether that is the guard's doing.
    pub(super) fn stopped_by_guard(&mut self, stands: Joints) -> Result<(), ArmError> {
        let Some(Guard { signal, .. }) = self.guard else {
            return Ok(());
        };
        if !self.signal(signal)? {
            return Ok(());
        }
        self.guard = None;
        Err(ArmError::ProximityStop {
            port: self.wire.port(),
            signal,
            joints: stands,
        })
    }
}

impl<T: Transport> ProximitySensor for Val2Client<T> {
    /// Reads the input of [`ClientConfig::proximity_signal`](crate::ClientConfig::proximity_signal).
    fn object_near(&mut self) -> Result<bool, ArmError> {
        self.signal(self.config.proximity_signal)
    }
}
