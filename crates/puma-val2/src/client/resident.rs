//! A program that stays in the controller and moves the arm as it is told: the fewest characters
//! per move.

use crate::client::motion::{AS_SENT, STILL, furthest};
use crate::client::number::plain;
use crate::client::point::shown_values;
use crate::client::reader::Ending;
use crate::client::val2_client::Val2Client;
use crate::client::wire::{Reply, is_doubt};
use crate::error::ArmError;
use crate::joints::{JointDelta, Joints};
use crate::manipulator::{Gripper, Manipulator};
use crate::transport::Transport;

/// Name of the resident program.
const NAME: &str = "PGLOOP";

/// Keys of the program. A changed bit can make a carriage return of a character, and its line two:
/// so what a line begins with after an angle (no angle is as large as these numbers) is no key, and
/// a move ends with its key once more.
const MOVE: &str = "7";
const OPEN: &str = "508";
const CLOSE: &str = "609";
const WHERE: &str = "817";
const END: &str = "914";

/// Steps of the program. It asks for a key, six angles and the key again. An empty, cut or damaged
/// answer makes it ask anew.
const STEPS: [&str; 17] = [
    "10 PROMPT \"GO? \",PGK,PGA,PGB,PGC,PGD,PGE,PGF,PGZ",
    "IF PGK == 914 GOTO 20",
    "IF PGK == 817 GOTO 15",
    "IF PGK == 508 THEN",
    "OPENI",
    "END",
    "IF PGK == 609 THEN",
    "CLOSEI",
    "END",
    "IF PGK <> 7 OR PGZ <> 7 GOTO 10",
    "MOVE #PPOINT(PGA,PGB,PGC,PGD,PGE,PGF)",
    "BREAK",
    "15 HERE #PGN",
    "DECOMPOSE PGQ[1] = #PGN",
    "TYPE /F1.3,PGQ[1],PGQ[2],PGQ[3],PGQ[4],PGQ[5],PGQ[6]",
    "GOTO 10",
    "20 TYPE \"BYE\"",
];

/// Answer of the program to a line.
const QUESTION: &str = "the program's question";

/// The arm through a program that runs in its controller. While this lives, the monitor is not
/// used.
///
/// The controller must know `#PPOINT`. A move is one short line and its answer, the joint angles
/// reached. Angles are absolute, so that a move can be commanded again after doubt. The program
/// ends with [`Resident::end`] or when this is dropped.
///
/// An answer shows the angles only once, so that a changed digit would not be noticed. The angles
/// are accepted if they are those that the arm was sent to; otherwise the program is asked until it
/// shows the same ones twice in a row.
///
/// A motion that the controller refuses ends the program, and so does a restart or a line that is
/// lost in mid-move. Every further call is then an [`ArmError::Setting`];
/// [`Val2Client::last_known`] says where the arm stands if it could still be asked.
#[derive(Debug)]
pub struct Resident<'a, T: Transport> {
    client: &'a mut Val2Client<T>,
    ended: bool,
}

impl<T: Transport> Val2Client<T> {
    /// Stores a small program (`PGLOOP`) in the controller and starts it, for the fastest control
    /// over a slow line.
    ///
    /// # Errors
    /// [`ArmError::Setting`] on a line without echo, where nothing would check the angles on their
    /// way, and while a proximity guard is armed; otherwise what the line or the controller said.
    pub fn resident(&mut self) -> Result<Resident<'_, T>, ArmError> {
        if !self.wire.checks_echo() || self.guard.is_some() {
            return Err(ArmError::Setting {
                what: "a resident program",
                value: "started".into(),
                allowed: "only on a line whose echo is checked, without a proximity guard",
            });
        }
        self.type_program(NAME, &STEPS.map(str::to_owned))?;
        let line = format!("EXECUTE {NAME}");
        let timeout = self.wire.config.patience();
        let reply = self.wire.exchange_to_end(&line, timeout)?;
        self.without_message(&line, &reply)?;
        if reply.ending != Ending::Question {
            return Err(self.wire.garbled(&line, QUESTION, &reply.text));
        }
        let mut resident = Resident {
            client: self,
            ended: false,
        };
        resident.joints()?;
        Ok(resident)
    }
}

impl<T: Transport> Resident<'_, T> {
    /// Ends the program; the monitor has its prompt again.
    ///
    /// # Errors
    /// [`ArmError`] if the line fails or the controller does not answer.
    pub fn end(mut self) -> Result<(), ArmError> {
        self.finish()
    }

    /// The line.
    pub fn line(&self) -> &T {
        self.client.line()
    }

    /// The line, to press the buttons of an emulator at its other end.
    pub fn line_mut(&mut self) -> &mut T {
        self.client.line_mut()
    }

    fn finish(&mut self) -> Result<(), ArmError> {
        if std::mem::replace(&mut self.ended, true) {
            return Ok(());
        }
        let wire = &mut self.client.wire;
        let mut ending = Ending::Question;
        for _ in 0..=wire.config.retries {
            ending = match wire.exchange_to_end(END, wire.config.patience()) {
                Ok(reply) => reply.ending,
                Err(failed) if is_doubt(&failed.error) => wire.spoil()?.ending,
                Err(failed) => return Err(failed.error),
            };
            if ending == Ending::Idle {
                return Ok(());
            }
        }
        Err(wire.garbled(END, "the monitor's prompt", &format!("{ending:?}")))
    }

    fn check_alive(&self) -> Result<(), ArmError> {
        if !self.ended {
            return Ok(());
        }
        Err(ArmError::Setting {
            what: "a resident program",
            value: "used after it has ended".into(),
            allowed: "start another one",
        })
    }

    /// Sends a line to the program until it asks its question again, and returns its output before
    /// the question. Repeating a line is safe, since all angles in it are absolute.
    fn give(&mut self, answer: &str) -> Result<Reply, ArmError> {
        self.check_alive()?;
        let mut tries = 0;
        loop {
            let client = &mut *self.client;
            let timeout = client.longest_motion();
            let failed = match client.wire.exchange_to_end(answer, timeout) {
                Ok(reply) if reply.ending == Ending::Question => return Ok(reply),
                Ok(reply) => {
                    // A refused motion ends the program.
                    let refused = client.without_message(answer, &reply).err();
                    let garbled = || client.wire.garbled(answer, QUESTION, &reply.text);
                    let error = refused.unwrap_or_else(garbled);
                    return Err(self.over(error));
                }
                Err(failed) => failed,
            };
            if !is_doubt(&failed.error) {
                return Err(if failed.maybe_done || self.client.wire.restarted {
                    self.lost(failed.error)
                } else {
                    failed.error
                });
            }
            // Also before giving up: what comes next must find the program asking.
            match self.regain() {
                Ok(Ending::Question) if tries < self.client.wire.config.retries => tries += 1,
                Ok(Ending::Question) => return Err(failed.error),
                Ok(_) => return Err(self.over(failed.error)),
                Err(error) => return Err(self.lost(error)),
            }
        }
    }

    /// Waits until the program asks its question again or has ended.
    fn regain(&mut self) -> Result<Ending, ArmError> {
        let limit = self.client.longest_motion();
        let wire = &mut self.client.wire;
        let until = wire.after(limit);
        let mut ending = wire.spoil()?.ending;
        while ending == Ending::Running {
            ending = wire.read_reply("an empty line", wire.left(until))?.ending;
        }
        Ok(ending)
    }

    /// Gives the program a line and reads the joint angles that it shows, once.
    fn ask(&mut self, answer: &str) -> Result<Joints, ArmError> {
        let mut heard = String::new();
        for _ in 0..=self.client.wire.config.retries {
            let reply = self.give(answer)?;
            let lines = reply.text.split(['\r', '\n']);
            if let Some(values) = lines.filter_map(shown_values).next_back() {
                return Ok(Joints::from_degrees(values.map(|(value, _)| value)));
            }
            heard = reply.text;
        }
        Err(self.client.wire.garbled(answer, "six joint angles", &heard))
    }

    /// Returns the angles that the program shows twice in a row. The arm moves only between a line
    /// with a move and its answer.
    fn stands(&mut self, mut before: Option<Joints>) -> Result<Joints, ArmError> {
        for _ in 0..self.client.wire.config.retries.saturating_add(3) {
            let joints = self.ask(WHERE)?;
            if before.is_some_and(|before| furthest(&before, &joints).1 < STILL) {
                return Ok(joints);
            }
            before = Some(joints);
        }
        let expected = "the same joint angles twice in a row";
        let heard = before.map(|joints| joints.to_string()).unwrap_or_default();
        Err(self.client.wire.garbled(WHERE, expected, &heard))
    }

    /// The program has ended, the monitor has its prompt: it can say where the arm stands.
    fn over(&mut self, error: ArmError) -> ArmError {
        self.ended = true;
        match self.client.stand_anywhere() {
            Ok(_) => error,
            Err(_) => self.client.lost(error),
        }
    }

    fn lost(&mut self, cause: ArmError) -> ArmError {
        self.ended = true;
        self.client.lost(cause)
    }

    fn go(&mut self, target: Joints) -> Result<Joints, ArmError> {
        let values = target.degrees().map(plain).join(",");
        let shown = self.ask(&format!("{MOVE},{values},{MOVE}"))?;
        if furthest(&shown, &target).1 <= AS_SENT {
            return Ok(shown);
        }
        let reached = self.stands(Some(shown))?;
        if furthest(&reached, &target).1 <= self.client.wire.config.tolerance {
            return Ok(reached);
        }
        // Where it stands is certain, if not where it should.
        self.client.last_known = Some(reached);
        Err(self.client.not_reached(target, reached))
    }

    /// Keeps where the arm is known to stand after a call that may have moved it.
    fn kept(
        &mut self,
        call: impl FnOnce(&mut Self) -> Result<Joints, ArmError>,
    ) -> Result<Joints, ArmError> {
        self.check_alive()?;
        let before = self.client.last_known.take();
        let mut outcome = call(self);
        match &mut outcome {
            Ok(joints) => self.client.last_known = Some(*joints),
            Err(ArmError::Unconfirmed { last_known, .. }) => *last_known = before,
            Err(_) => {}
        }
        outcome
    }
}

impl<T: Transport> Manipulator for Resident<'_, T> {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        self.kept(|resident| resident.stands(None))
    }

    fn move_by(&mut self, delta: JointDelta) -> Result<Joints, ArmError> {
        let start = match self.client.last_known() {
            Some(joints) => joints,
            None => self.joints()?,
        };
        self.move_to(start + delta)
    }

    fn move_to(&mut self, target: Joints) -> Result<Joints, ArmError> {
        self.client.wire.config.params.check(&target)?;
        self.kept(|resident| resident.go(target))
    }

    fn set_gripper(&mut self, gripper: Gripper) -> Result<(), ArmError> {
        // The keys of the hand show nothing; the question after them is the answer.
        self.give(match gripper {
            Gripper::Open => OPEN,
            Gripper::Closed => CLOSE,
        })
        .map(drop)
    }

    fn stop(&mut self) -> Result<(), ArmError> {
        self.ended = true;
        self.client.panic_stop().and(self.client.abort())
    }
}

impl<T: Transport> Drop for Resident<'_, T> {
    fn drop(&mut self) {
        let _ = self.finish();
    }
}
