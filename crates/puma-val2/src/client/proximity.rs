//! Proximity sensors: reading them, and stopping the arm by them.

use crate::client::dialogue::NUDGE;
use crate::client::number::plain;
use crate::client::reader::Ending;
use crate::client::val2_client::Val2Client;
use crate::client::wire::{Failed, is_doubt};
use crate::error::ArmError;
use crate::joints::Joints;
use crate::manipulator::ProximitySensor;
use crate::transport::Transport;

/// Programs of the guard: one for moves of the joints, one for a single move of another kind, and
/// the one that the signal calls.
const RUN: &str = "PGRUN";
const ONCE: &str = "PGONCE";
const HIT: &str = "PGHIT";

/// Program that moves to a point where nothing is echoed.
const GOAL: &str = "PGMOVE";

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
        self.store_program(HIT, &[format!("{LATCH} = -1"), "HALT".to_owned()])?;
        let to_goal = format!("MOVE #{}", self.wire.config.point_name);
        self.store_program(RUN, &guarded_steps(signal, &[to_goal]))?;
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

    /// Moves to the point that has been defined, under guard.
    pub(super) fn run_guarded(&mut self, speed: Option<f64>) -> Result<(), Failed> {
        match (speed, self.guard) {
            (Some(speed), Some(signal)) => {
                let to_goal = format!("MOVE #{}", self.wire.config.point_name);
                self.run_guarded_once(signal, &[format!("SPEED {}", plain(speed)), to_goal])
            }
            _ => self.run(&format!("EXECUTE {RUN}")).map(drop),
        }
    }

    /// Moves to a point that has just been defined.
    ///
    /// Without an echo a damaged name could be that of a point that another damaged line has made.
    /// A stored program holds the name then, and its listing has been compared.
    pub(super) fn move_to_point(&mut self, word: &str, name: &str) -> Result<(), Failed> {
        let motion = format!("{word} {name}");
        if self.wire.checks_echo() {
            let line = format!("DO {motion}");
            let timeout = self.wire.config.motion_timeout;
            return self.command_once(&line, timeout).map(drop);
        }
        if self.goal_program.as_ref() != Some(&motion) {
            self.goal_program = None;
            self.store_program(GOAL, std::slice::from_ref(&motion))?;
            self.goal_program = Some(motion);
        }
        self.run(&format!("EXECUTE {GOAL}")).map(drop)
    }

    /// Runs these steps under guard. Their goal must not depend on the arm's position.
    pub(super) fn run_guarded_once(
        &mut self,
        signal: u16,
        motion: &[String],
    ) -> Result<(), Failed> {
        self.store_program(ONCE, &guarded_steps(signal, motion))?;
        self.run(&format!("EXECUTE {ONCE}")).map(drop)
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

    /// Types a program into the controller's editor, replaces one of the same name, and compares
    /// the listing.
    ///
    /// # Errors
    /// [`ArmError::Setting`], before anything is sent, for a name or a step that is not one line of
    /// printable characters; [`ArmError::Garbled`] if the listing differs several times over;
    /// otherwise errors of the line or the controller.
    pub fn store_program(&mut self, name: &str, steps: &[String]) -> Result<(), ArmError> {
        check_line("the name of a program", name)?;
        for step in steps {
            check_line("a step of a program", step)?;
        }
        let mut tries = 0;
        loop {
            match self.store_once(name, steps) {
                Err(error) if is_doubt(&error) || matches!(error, ArmError::Refused { .. }) => {
                    // Out of the editor in any case.
                    self.wire.settle()?;
                    if tries >= self.wire.config.retries || !self.is_doubtful(&error) {
                        return Err(error);
                    }
                    tries += 1;
                }
                outcome => return outcome,
            }
        }
    }

    fn store_once(&mut self, name: &str, steps: &[String]) -> Result<(), ArmError> {
        // An old program of this name, if there is one; that there is none is no fault.
        if self.say(&format!("DELETEP {name}"))?.ending == Ending::Question {
            self.say("Y")?;
        }
        // Steps belong into the editor: at the monitor some of them would be carried out.
        let edit = format!("EDIT {name}");
        for line in std::iter::once(&edit).chain(steps) {
            let reply = self.say(line)?;
            self.without_message(line, &reply)?;
            if reply.ending != Ending::Question {
                return Err(self.wire.garbled(line, "the editor's prompt", &reply.text));
            }
        }
        self.say("E")?;
        let listed = self.say(&format!("LISTP {name}"))?.text;
        let listed = listed.to_ascii_uppercase();
        if holds(&listed, steps) {
            return Ok(());
        }
        Err(self
            .wire
            .garbled(name, "a listing of what was typed", &listed))
    }

    /// Runs a stored program to its end and returns its output. A program that asks for values is
    /// aborted: at once if its question ends with a question mark, otherwise after
    /// `config.motion_timeout`.
    ///
    /// # Errors
    /// [`ArmError::Setting`] for a name that is not one line of printable characters, and while a
    /// proximity guard is armed; [`ArmError::Silence`] after `config.motion_timeout`, the program
    /// aborted; otherwise errors of the line or the controller.
    pub fn execute(&mut self, program: &str) -> Result<String, ArmError> {
        check_line("the name of a program", program)?;
        self.refuse_under_guard("a program")?;
        self.last_known = None;
        self.wire.nudge = b"";
        let outcome = self.run(&format!("EXECUTE {program}"));
        self.wire.nudge = NUDGE;
        let Err(failed) = outcome else {
            return outcome.map_err(ArmError::from);
        };
        if failed.maybe_done && is_doubt(&failed.error) {
            self.end_program().map_err(|error| self.lost(error))?;
        }
        Err(failed.error)
    }

    /// Aborts the program that runs, if any.
    ///
    /// # Errors
    /// Errors of the line.
    pub fn abort(&mut self) -> Result<(), ArmError> {
        self.last_known = None;
        self.end_program()
    }

    fn end_program(&mut self) -> Result<(), ArmError> {
        let patience = self.wire.config.motion_timeout;
        let mut tries = 0;
        loop {
            let error = match self.wire.exchange_to_end("ABORT", patience) {
                Ok(reply) if reply.ending == Ending::Idle => return Ok(()),
                Ok(reply) => {
                    let expected = "the idle monitor's prompt";
                    self.wire.garbled("ABORT", expected, &reply.text)
                }
                Err(failed) => failed.error,
            };
            if !is_doubt(&error) || tries >= self.wire.config.retries {
                return Err(error);
            }
            tries += 1;
            // A program that asks for values is left here.
            self.wire.settle()?;
        }
    }

    /// Runs a program until it ends. A question of the program is an error.
    fn run(&mut self, line: &str) -> Result<String, Failed> {
        let patience = self.wire.config.motion_timeout;
        let reply = self.wire.exchange_to_end(line, patience)?;
        self.without_message(line, &reply)?;
        if reply.ending == Ending::Question {
            let expected = "a program that asks for nothing";
            return Err(Failed::after(self.wire.garbled(
                line,
                expected,
                &reply.text,
            )));
        }
        Ok(reply.text)
    }
}

/// Refuses text that would not arrive as one line.
fn check_line(what: &'static str, text: &str) -> Result<(), ArmError> {
    if !text.trim().is_empty() && text.bytes().all(|b| matches!(b, 0x20..=0x7e)) {
        return Ok(());
    }
    Err(ArmError::Setting {
        what,
        value: format!("{text:?}"),
        allowed: "one line of printable ASCII characters",
    })
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

/// Returns `true` if a listing shows exactly these steps in their order.
fn holds(listing: &str, steps: &[String]) -> bool {
    let steps: Vec<String> = steps.iter().map(|step| step.to_ascii_uppercase()).collect();
    let shown: Vec<&str> = listing
        .split(['\r', '\n'])
        .map(str::trim)
        // `.PROGRAM`, `.END` and prompts are not steps.
        .filter(|line| {
            !line.starts_with(['.', '*']) && steps.iter().any(|step| line.ends_with(step.as_str()))
        })
        .collect();
    shown.len() == steps.len()
        && shown
            .iter()
            .zip(&steps)
            .all(|(line, step)| line.ends_with(step.as_str()))
}

impl<T: Transport> ProximitySensor for Val2Client<T> {
    /// Reads the input [`ClientConfig::proximity_signal`](crate::ClientConfig::proximity_signal).
    fn object_near(&mut self) -> Result<bool, ArmError> {
        self.signal(self.wire.config.proximity_signal)
    }
}
