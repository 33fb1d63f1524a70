//! A program that stays in the controller and moves the arm as it is told: the fewest characters per move.

use super::motion::{furthest, shown_values};
use super::wire::{Failed, is_doubt};
use super::{Ending, Val2Client, degrees, plain, shortened};
use crate::{ArmError, Gripper, JointDelta, Joints, Manipulator, Transport};

/// Its name.
const NAME: &str = "PGLOOP";

/// It asks for a key and six angles. Only the key 7 moves the arm: an empty or damaged answer asks again.
const STEPS: [&str; 17] = [
    "10 PROMPT \"GO? \",PGK,PGA,PGB,PGC,PGD,PGE,PGF",
    "IF PGK == 9 GOTO 20",
    "IF PGK == 8 GOTO 15",
    "IF PGK == 5 THEN",
    "OPENI",
    "END",
    "IF PGK == 6 THEN",
    "CLOSEI",
    "END",
    "IF PGK <> 7 GOTO 10",
    "MOVE #PPOINT(PGA,PGB,PGC,PGD,PGE,PGF)",
    "BREAK",
    "15 HERE #PGN",
    "DECOMPOSE PGQ[1] = #PGN",
    "TYPE /F1.3,PGQ[1],PGQ[2],PGQ[3],PGQ[4],PGQ[5],PGQ[6]",
    "GOTO 10",
    "20 TYPE \"BYE\"",
];

/// The arm through a program that runs in its controller. While this lives, the monitor is not used.
///
/// A move is one short line and its answer, the joint angles reached. Angles are absolute, so that a move can be commanded again after doubt. The
/// program ends with [`Resident::end`] or when this is dropped.
#[derive(Debug)]
pub struct Resident<'a, T: Transport> {
    client: &'a mut Val2Client<T>,
    ended: bool,
}

impl<T: Transport> Val2Client<T> {
    /// Stores a small program (`PGLOOP`) in the controller and starts it, for the fastest control over a slow line.
    ///
    /// # Errors
    /// [`ArmError::Setting`] on a line without echo, where nothing would check the angles on their way, and while a proximity guard is armed;
    /// otherwise what the line or the controller said.
    pub fn resident(&mut self) -> Result<Resident<'_, T>, ArmError> {
        if !self.echoes() || !self.config.check_echo || self.guard.is_some() {
            return Err(ArmError::Setting {
                what: "a resident program",
                value: "started".into(),
                allowed: "only on a line whose echo is checked, without a proximity guard",
            });
        }
        self.store_program(NAME, &STEPS.map(str::to_owned))?;
        let line = format!("EXECUTE {NAME}");
        let timeout = self.config.reply_timeout * 4;
        let reply = self
            .wire
            .exchange_to_end(&line, timeout, &self.config)
            .map_err(|f| f.error)?;
        self.without_message(&line, &reply).map_err(|f| f.error)?;
        let mut resident = Resident {
            client: self,
            ended: reply.ending != Ending::Question,
        };
        if resident.ended {
            return Err(resident.client.wire.garbled(
                &line,
                "the program's question",
                &shortened(&reply.text),
            ));
        }
        resident.ask("8")?;
        Ok(resident)
    }
}

impl<T: Transport> Resident<'_, T> {
    /// Ends the program; the monitor has its prompt again.
    ///
    /// # Errors
    /// What the line said.
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
        let config = &self.client.config;
        let patience = config.reply_timeout * 4;
        let mut ending = Ending::Question;
        for _ in 0..=config.retries {
            ending = match wire.exchange_to_end("9", patience, config) {
                Ok(reply) => reply.ending,
                Err(failed) if is_doubt(&failed.error) => wire.spoil(config)?,
                Err(failed) => return Err(failed.error),
            };
            if ending == Ending::Idle {
                return Ok(());
            }
        }
        Err(wire.garbled("9", "the monitor's prompt", &format!("{ending:?}")))
    }

    /// Gives the program a line and reads the joint angles that it shows, again after doubt: nothing in a line is relative.
    fn ask(&mut self, answer: &str) -> Result<Joints, ArmError> {
        let mut tries = 0;
        loop {
            match self.ask_once(answer) {
                Ok(joints) => {
                    self.client.last_known = Some(joints);
                    return Ok(joints);
                }
                Err(failed) if is_doubt(&failed.error) && tries < self.client.config.retries => {
                    tries += 1;
                    match self.client.wire.spoil(&self.client.config) {
                        Ok(Ending::Question) => {}
                        Ok(_) => {
                            self.ended = true;
                            return Err(failed.error);
                        }
                        Err(error) => return Err(self.lost(error)),
                    }
                }
                Err(failed) if failed.maybe_done => return Err(self.lost(failed.error)),
                Err(failed) => return Err(failed.error),
            }
        }
    }

    fn ask_once(&mut self, answer: &str) -> Result<Joints, Failed> {
        let client = &mut *self.client;
        let reply = client
            .wire
            .exchange_to_end(answer, client.config.motion_timeout, &client.config)?;
        if reply.ending != Ending::Question {
            // A refused motion ends the program.
            self.ended = true;
            client.without_message(answer, &reply)?;
        }
        let shown = reply
            .text
            .split(['\r', '\n'])
            .filter_map(shown_values)
            .next_back();
        match shown {
            Some(values) => Ok(Joints::from_degrees(values.map(|(value, _)| value))),
            None => Err(Failed {
                error: client
                    .wire
                    .garbled(answer, "six joint angles", &shortened(&reply.text)),
                maybe_done: true,
            }),
        }
    }

    fn lost(&mut self, cause: ArmError) -> ArmError {
        self.ended = true;
        self.client.lost(cause)
    }

    fn go(&mut self, target: Joints) -> Result<Joints, ArmError> {
        let client = &mut *self.client;
        client.config.params.check(&target)?;
        let values = target.degrees().map(plain).join(",");
        let answer = format!("7,{}", values.trim_end_matches(",0"));
        let mut reached = self.ask(&answer)?;
        let is_off = |joints: &Joints, tolerance| furthest(joints, &target).1 > tolerance;
        let tolerance = self.client.config.tolerance;
        if is_off(&reached, tolerance) {
            // A digit may have changed on its way back.
            reached = self.ask("8")?;
        }
        if is_off(&reached, tolerance) {
            let (joint, _) = furthest(&reached, &target);
            return Err(ArmError::NotReached {
                port: self.client.wire.port(),
                joint,
                wanted_degrees: degrees(&target, joint),
                reported_degrees: degrees(&reached, joint),
            });
        }
        Ok(reached)
    }
}

impl<T: Transport> Manipulator for Resident<'_, T> {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        self.ask("8")
    }

    fn move_by(&mut self, delta: JointDelta) -> Result<Joints, ArmError> {
        let start = match self.client.last_known {
            Some(joints) => joints,
            None => self.ask("8")?,
        };
        self.go(start + delta)
    }

    fn move_to(&mut self, target: Joints) -> Result<Joints, ArmError> {
        self.go(target)
    }

    fn set_gripper(&mut self, gripper: Gripper) -> Result<(), ArmError> {
        // The keys of the hand show nothing; the question after them is the answer.
        let key = match gripper {
            Gripper::Open => "5",
            Gripper::Closed => "6",
        };
        let client = &mut *self.client;
        let mut tries = 0;
        loop {
            match client
                .wire
                .exchange_to_end(key, client.config.motion_timeout, &client.config)
            {
                Ok(reply) if reply.ending == Ending::Question => return Ok(()),
                Ok(reply) => {
                    self.ended = true;
                    return Err(client
                        .wire
                        .garbled(key, "the program's question", &shortened(&reply.text)));
                }
                Err(failed) if is_doubt(&failed.error) && tries < client.config.retries => {
                    tries += 1;
                    client.wire.spoil(&client.config)?;
                }
                Err(failed) => return Err(failed.error),
            }
        }
    }

    fn stop(&mut self) -> Result<(), ArmError> {
        self.ended = true;
        self.client.abort().and(self.client.panic_stop())
    }
}

impl<T: Transport> Drop for Resident<'_, T> {
    fn drop(&mut self) {
        let _ = self.finish();
    }
}
