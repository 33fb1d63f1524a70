//! The client itself: its settings, its line and the calls that do not move the arm.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::client::config::ClientConfig;
use crate::client::dialogue::STOP;
use crate::client::number::{check_percent, plain};
use crate::client::reader;
use crate::client::reader::Ending;
use crate::client::whereabouts::Location;
use crate::client::wire::{Failed, Reply, Wire, is_doubt};
use crate::error::ArmError;
use crate::joints::{JointDelta, Joints};
use crate::kinematics::frames::Frames;
use crate::manipulator::{Gripper, Manipulator};
use crate::transport::Transport;

/// A client of a VAL II controller.
///
/// Every call waits until the controller has answered. A call that moves the arm waits until
/// `WHERE` shows it at its goal.
///
/// **The rule for faults on the line.** A relative motion is never repeated blindly: after any
/// doubt about an exchange, the client reads the position and commands only the rest of the way. A
/// call ends with the arm at its goal, or with a typed error, the arm stopped and its last known
/// joint angles kept ([`Val2Client::last_known`]).
///
/// A move starts from the joint angles that the arm reported last, which saves a reply of a quarter
/// of a second on a slow line. If the arm is moved by other means (the teach pendant, a program),
/// call [`Manipulator::joints`] before the next [`Manipulator::move_by`].
#[derive(Debug)]
pub struct Val2Client<T: Transport> {
    pub(super) wire: Wire<T>,
    pub(super) last_known: Option<Joints>,
    /// Values that the controller has shown for points defined by this client, by name. A display
    /// of other values betrays a damaged name.
    pub(super) points: BTreeMap<String, [f64; 6]>,
    /// Motion in the stored program that serves where nothing is echoed.
    pub(super) goal_program: Option<String>,
    /// The controller has turned out not to know `#PPOINT`.
    pub(super) lacks_ppoint: bool,
    /// Tool or base that the controller seems to have.
    pub(super) frames: [Frames; 2],
    /// Monitor speed in percent, if this client has set it.
    pub(super) speed: Option<f64>,
    /// Signal that stops the next motions.
    pub(super) guard: Option<u16>,
}

impl<T: Transport> Val2Client<T> {
    /// Returns the settings.
    pub fn config(&self) -> &ClientConfig {
        &self.wire.config
    }

    /// Returns the line.
    pub fn line(&self) -> &T {
        &self.wire.line
    }

    /// Returns the line, to press the buttons of an emulator at its other end. The client misses
    /// bytes that are read or written here.
    pub fn line_mut(&mut self) -> &mut T {
        &mut self.wire.line
    }

    /// Returns the joint angles that the arm reported last, without asking it. `None`: it may have
    /// moved since, or the controller was started again.
    pub fn last_known(&self) -> Option<Joints> {
        self.last_known.filter(|_| !self.wire.restarted)
    }

    /// Returns `true` if the controller echoes what is typed.
    pub fn echoes(&self) -> bool {
        self.wire.echo == Some(true)
    }

    /// Takes out the messages of the controller that belong to no command, oldest first, at most a
    /// hundred.
    pub fn take_notices(&mut self) -> Vec<String> {
        std::mem::take(&mut self.wire.notices)
    }

    /// Carries out a line that neither moves the arm nor opens a dialogue, tries again after doubt,
    /// and returns the reply.
    pub(super) fn command(&mut self, line: &str) -> Result<String, ArmError> {
        let mut tries = 0;
        loop {
            match self.command_once(line, self.wire.config.patience()) {
                Ok(text) => return Ok(text),
                Err(failed) => self.wire.retry(failed.error, &mut tries)?,
            }
        }
    }

    /// Carries out a line once. The reply must end with the monitor's prompt and hold no message.
    pub(super) fn command_once(&mut self, line: &str, timeout: Duration) -> Result<String, Failed> {
        let reply = self.wire.exchange(line, timeout)?;
        self.answered(line, reply, "the monitor's prompt")
    }

    /// Returns the text of a reply without a message that ends with a prompt.
    pub(super) fn answered(
        &self,
        line: &str,
        reply: Reply,
        expected: &str,
    ) -> Result<String, Failed> {
        self.without_message(line, &reply)?;
        if reply.ending == Ending::Question {
            let error = self.wire.garbled(line, expected, &reply.text);
            return Err(Failed::after(error));
        }
        Ok(reply.text)
    }

    /// Exchanges a line for a reply that waits for no motion.
    pub(super) fn say(&mut self, line: &str) -> Result<Reply, ArmError> {
        let patience = self.wire.config.patience();
        self.wire.exchange(line, patience).map_err(ArmError::from)
    }

    pub(super) fn without_message(&self, line: &str, reply: &Reply) -> Result<(), ArmError> {
        match reader::messages(&reply.text).pop() {
            None => Ok(()),
            Some(message) => Err(ArmError::Refused {
                port: self.wire.port(),
                sent: line.to_owned(),
                message,
            }),
        }
    }

    /// Sets the monitor's speed in percent, above 0, at most 327.67.
    ///
    /// # Errors
    /// [`ArmError::Setting`] before anything is sent; otherwise errors of the line or the
    /// controller.
    pub fn set_speed(&mut self, percent: f64) -> Result<(), ArmError> {
        check_percent(percent)?;
        self.command(&format!("SPEED {}", plain(percent)))?;
        self.speed = Some(percent);
        Ok(())
    }

    /// Reads the arm's position.
    ///
    /// A reply is accepted if its joint angles and its hand pose belong together. With a tool or
    /// base set in the controller they do not; then two equal replies in a row are required, which
    /// a notice says, and the tool or base that explains them is expected from then on.
    ///
    /// # Errors
    /// Errors of the line or the controller; [`ArmError::Garbled`] if no two replies agree.
    pub fn where_(&mut self) -> Result<Location, ArmError> {
        let mut before: Option<Location> = None;
        let mut last_error = None;
        for _ in 0..self.wire.config.retries.saturating_add(3) {
            match self.where_once() {
                Ok(location) => {
                    let params = &self.wire.config.params;
                    let agrees = |frames: &Frames| location.agrees(params, frames);
                    let certain = agrees(&Frames::default()) || self.frames.iter().any(agrees);
                    if certain || before == Some(location) {
                        if !certain {
                            self.frames = location.explanations(params);
                            self.notice_frames();
                        }
                        self.last_known = Some(location.joints);
                        return Ok(location);
                    }
                    before = Some(location);
                }
                Err(error) if is_doubt(&error) => {
                    last_error = Some(error);
                    self.wire.settle()?;
                }
                Err(error) => return Err(error),
            }
        }
        Err(last_error.unwrap_or_else(|| {
            self.wire
                .garbled("WHERE", "two equal replies in a row", "none")
        }))
    }

    /// Says that every `WHERE` was asked twice, if a tool or base is the reason.
    fn notice_frames(&mut self) {
        let tool = self.frames[0].tool;
        let none = tool.translation.vector.norm() < 1e-4 && tool.rotation.angle() < 1e-3;
        if !none {
            let notice = "TOOL or BASE is set on the controller, or the arm is another model";
            self.wire.notices.push(notice.to_owned());
        }
    }

    fn where_once(&mut self) -> Result<Location, ArmError> {
        let reply = self.say("WHERE")?;
        if let Some(location) = Location::parse(&reply.text) {
            // A message beside a whole answer was not meant for it.
            self.wire.notice(&reply.text);
            return Ok(location);
        }
        self.without_message("WHERE", &reply)?;
        let expected = "a heading and six numbers each for X Y Z O A T and JT1 to JT6";
        Err(self.wire.garbled("WHERE", expected, &reply.text))
    }

    /// Returns `true` if a signal is on: 1 and up are outputs, 1001 and up inputs.
    ///
    /// # Errors
    /// Errors of the line or the controller; [`ArmError::Garbled`] if the answer is no number.
    pub fn signal(&mut self, number: u16) -> Result<bool, ArmError> {
        self.truth(&format!("SIG({number})"))
    }

    /// Returns the value of a condition, -1 for true and 0 for false.
    ///
    /// No single character that changes, gets lost or comes twice turns one into the other. Any
    /// other number must be shown twice in a row.
    pub(super) fn truth(&mut self, condition: &str) -> Result<bool, ArmError> {
        let line = format!("DO TYPE {condition}");
        let mut before = None;
        let mut heard = String::new();
        for _ in 0..self.wire.config.retries.saturating_add(3) {
            heard = self.command(&line)?;
            let shown = heard
                .split(['\r', '\n'])
                .filter_map(|l| l.trim().parse::<f64>().ok())
                .rfind(|value| value.is_finite());
            let is = |value: f64| shown.is_some_and(|s| s.total_cmp(&value).is_eq());
            if is(-1.0) || is(0.0) || shown.is_some() && shown == before {
                return Ok(shown.is_some_and(|value| value != 0.0));
            }
            before = shown;
        }
        Err(self.wire.garbled(&line, "-1 or 0", &heard))
    }

    /// Refuses a motion that the armed guard would not watch.
    pub(super) fn refuse_under_guard(&self, what: &'static str) -> Result<(), ArmError> {
        match self.guard {
            None => Ok(()),
            Some(signal) => Err(ArmError::Setting {
                what,
                value: format!("started while signal {signal} guards the motions"),
                allowed: "disarm the proximity guard first",
            }),
        }
    }

    /// Stops the arm by `PANIC` and Ctrl-C, without waiting for a prompt first. The client can be
    /// used again afterwards.
    ///
    /// # Errors
    /// [`ArmError::Line`] if the line did not take it.
    pub(super) fn panic_stop(&mut self) -> Result<(), ArmError> {
        self.wire.send(STOP, "PANIC")?;
        // Whatever is said to that, in whichever number of prompts, is of no interest; only a dead
        // line is.
        match self.wire.settle() {
            Err(error @ ArmError::Line { .. }) => Err(error),
            _ => Ok(()),
        }
    }
}

impl<T: Transport> Manipulator for Val2Client<T> {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        self.where_().map(|location| location.joints)
    }

    fn move_by(&mut self, delta: JointDelta) -> Result<Joints, ArmError> {
        self.move_joints_by(delta)
    }

    fn move_to(&mut self, target: Joints) -> Result<Joints, ArmError> {
        self.move_joints_to(target)
    }

    fn set_gripper(&mut self, gripper: Gripper) -> Result<(), ArmError> {
        self.command(match gripper {
            Gripper::Open => "DO OPENI",
            Gripper::Closed => "DO CLOSEI",
        })
        .map(drop)
    }

    fn stop(&mut self) -> Result<(), ArmError> {
        self.panic_stop()
    }
}
