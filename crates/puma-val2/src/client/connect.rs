//! Connection with the monitor, and calibration of the arm.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::client::config::ClientConfig;
use crate::client::dialogue::{
    CANCEL, Mode, STOP, State, at_silence, is_boot_question, is_own_echo, last_line, last_question,
    shortened, way_out,
};
use crate::client::number::check_percent;
use crate::client::reader;
use crate::client::reader::Ending;
use crate::client::val2_client::Val2Client;
use crate::client::whereabouts::Location;
use crate::client::wire::{Wire, is_doubt};
use crate::error::ArmError;
use crate::transport::Transport;

impl<T: Transport> Val2Client<T> {
    /// Connects to the monitor. A start-up dialogue is answered, any other dialogue is left, and a
    /// half-typed line is deleted. Nothing is sent that stops the arm or a program, or sets the
    /// speed, unless `config` says so.
    ///
    /// # Errors
    /// [`ArmError::Busy`] after `config.connect_timeout` if the controller sends back what is typed
    /// and no prompt; [`ArmError::Silence`] or [`ArmError::Garbled`] if there is no VAL monitor at
    /// the other end; [`ArmError::Asked`] if a program asks for values.
    pub fn connect(transport: T, config: ClientConfig) -> Result<Self, ArmError> {
        check(&config)?;
        let mut client = Self {
            wire: Wire::new(transport, config),
            last_known: None,
            points: BTreeMap::new(),
            goal_program: None,
            lacks_ppoint: false,
            frames: Default::default(),
            speed: None,
            guard: None,
        };
        client.reconnect()?;
        Ok(client)
    }

    /// Connects anew, after [`ArmError::Restarted`] for instance. The arm has to be calibrated
    /// again.
    ///
    /// # Errors
    /// Those of [`Val2Client::connect`].
    pub fn reconnect(&mut self) -> Result<(), ArmError> {
        self.last_known = None;
        self.guard = None;
        self.points.clear();
        self.goal_program = None;
        self.lacks_ppoint = false;
        self.frames = Default::default();
        self.speed = None;
        self.wire.cancelled = false;
        self.wire.mode = Mode::Connecting;
        let outcome = self.find_prompt();
        self.wire.mode = Mode::Session;
        outcome?;
        self.find_echo()?;
        match self.wire.config.speed_percent {
            Some(percent) => self.set_speed(percent),
            None => Ok(()),
        }
    }

    /// Stops the arm and a running program over any line, without waiting for a prompt first: for a
    /// program that has just been started, while the arm moves for another one.
    ///
    /// `Ok` says that the controller has answered. `PANIC` is sent twice and Ctrl-C, if the
    /// controller understands it, then `ABORT`.
    ///
    /// # Errors
    /// [`ArmError::Busy`] if the controller has not shown a prompt within 1.5 seconds, or some more
    /// on a line below 600 baud: the arm may be moving; [`ArmError::Asked`] if a program still asks
    /// for values, on a controller without control characters; [`ArmError::Line`] if the line did
    /// not take it.
    pub fn stop_on(transport: T, config: ClientConfig) -> Result<(), ArmError> {
        let waited = config
            .quiet
            .saturating_mul(20)
            .max(Duration::from_millis(1500));
        let mut wire = Wire::new(transport, config);
        wire.mode = Mode::Stopping;
        wire.send(STOP, "PANIC")?;
        let mut outcome = wire.read_reply("PANIC", waited);
        if matches!(&outcome, Ok(reply) if reply.ending == Ending::Running) {
            wire.send(b"ABORT\r", "ABORT")?;
            outcome = wire.read_reply("ABORT", waited);
        }
        let port = wire.port();
        match outcome {
            Ok(reply) if reply.ending == Ending::Idle => Ok(()),
            Ok(reply) if reply.ending == Ending::Question && !is_boot_question(&reply.text) => {
                let question = shortened(last_line(&reply.text));
                Err(ArmError::Asked { port, question })
            }
            Err(error @ ArmError::Line { .. }) => Err(error),
            Ok(reply) if reply.ending == Ending::Question => Ok(()),
            _ => Err(ArmError::Busy { port, waited }),
        }
    }

    fn find_prompt(&mut self) -> Result<(), ArmError> {
        let timeout = self.wire.config.connect_timeout;
        let until = self.wire.after(timeout);
        self.wire.state = State::Open;
        let spoil = at_silence(self.wire.state, self.wire.mode);
        self.wire.send(spoil, "connecting")?;
        let expected = "the prompt `.` of the VAL monitor or a start-up question";
        let mut ways = 0;
        for questions in 0.. {
            let left = self.wire.left(until);
            let reply = match self.wire.read_reply("CR", left) {
                Ok(reply) => reply,
                Err(ArmError::Silence { heard, .. }) if heard.is_empty() => {
                    return Err(ArmError::Silence {
                        port: self.wire.port(),
                        sent: "CR".to_owned(),
                        expected: format!(
                            "{expected} (limit: `connect_timeout`; off, another baud rate, or \
                             another program on the line?)"
                        ),
                        heard,
                        waited: timeout,
                    });
                }
                Err(ArmError::Silence { heard, .. }) if is_own_echo(&heard) => {
                    return Err(ArmError::Busy {
                        port: self.wire.port(),
                        waited: timeout,
                    });
                }
                Err(ArmError::Silence { heard, .. } | ArmError::Garbled { heard, .. }) => {
                    return Err(self.wire.garbled("CR", expected, &heard));
                }
                Err(other) => return Err(other),
            };
            let answer: &[u8] = match reply.ending {
                Ending::Idle => break,
                Ending::Running if self.wire.config.abort_running_program => b"ABORT\r",
                Ending::Running => break,
                Ending::Question if is_boot_question(&reply.text) => {
                    // Whatever may be the question that erases the memory is answered as that one.
                    let config = &self.wire.config;
                    let yes = if last_question(&reply.text).contains("INIT") {
                        config.initialize
                    } else {
                        config.load_from_floppy
                    };
                    if yes { b"Y\r" } else { b"N\r" }
                }
                Ending::Question => {
                    let way = way_out(&reply.text, ways);
                    ways += 1;
                    if ways == 1 && way == CANCEL && !self.wire.config.abort_running_program {
                        return Err(ArmError::Asked {
                            port: self.wire.port(),
                            question: shortened(last_line(&reply.text)),
                        });
                    }
                    way
                }
            };
            if questions >= 20 || left.is_zero() {
                return Err(self.wire.garbled("CR", expected, &reply.text));
            }
            self.wire.send(answer, "connecting")?;
        }
        self.wire.restarted = false;
        Ok(())
    }

    /// Types a command that does no harm and listens for its echo before the line is ended.
    fn find_echo(&mut self) -> Result<(), ArmError> {
        self.wire.echo = Some(false);
        let retries = self.wire.config.retries;
        for attempt in 0..=retries {
            self.wire.send(b"WHERE", "WHERE")?;
            let wait = self.wire.config.quiet.saturating_mul(3);
            let mut heard = Vec::new();
            while heard.len() < 5
                && let Some(bytes) = self.wire.receive(wait, "WHERE")?
            {
                heard.extend(bytes);
            }
            self.wire.send(b"\r", "WHERE")?;
            let patience = self.wire.config.patience();
            match self.wire.read_reply("WHERE", patience) {
                Ok(reply) => {
                    // An echo may come late, behind a message that nobody asked for, or damaged.
                    // What looks like neither echo nor silence is listened to again.
                    let said = String::from_utf8_lossy(&heard).to_ascii_uppercase();
                    let echoed = said.contains("WHERE")
                        || reply.text.to_ascii_uppercase().contains("WHERE\r");
                    let plain = echoed || heard.is_empty() || attempt == retries;
                    let answered = Location::parse(&reply.text).is_some()
                        || !reader::messages(&reply.text).is_empty();
                    if answered && plain {
                        self.wire.echo = Some(echoed || !heard.is_empty());
                        return Ok(());
                    }
                }
                Err(error) if is_doubt(&error) => {}
                Err(error) => return Err(error),
            }
            self.wire.settle()?;
        }
        let expected = "X Y Z O A T and six joint angles";
        let heard = "nothing of the kind, several times";
        Err(self.wire.garbled("WHERE", expected, heard))
    }

    /// Calibrates the arm: `CALIBRATE`, the answer yes, and the small moves that follow.
    ///
    /// # Errors
    /// [`ArmError::Setting`] while a proximity guard is armed, which does not watch these moves;
    /// [`ArmError::Refused`] with the controller's message, arm power off for instance, after
    /// `config.power_retries` further tries.
    pub fn calibrate(&mut self) -> Result<(), ArmError> {
        self.refuse_under_guard("calibration")?;
        // What the arm has shown until now was counted from another zero.
        self.last_known = None;
        let (mut doubts, mut refusals) = (0, 0);
        loop {
            match self.calibrate_once() {
                Ok(()) => return Ok(()),
                Err(ArmError::Refused { message, .. })
                    if message.to_ascii_uppercase().contains("POWER")
                        && refusals < self.wire.config.power_retries =>
                {
                    refusals += 1;
                    self.pause(self.wire.config.power_retry_delay)?;
                }
                Err(error) => self.wire.retry(error, &mut doubts)?,
            }
        }
    }

    fn calibrate_once(&mut self) -> Result<(), ArmError> {
        let reply = self.say("CAL")?;
        self.without_message("CAL", &reply)?;
        if reply.ending != Ending::Question {
            return Err(self.wire.garbled("CAL", "a question", &reply.text));
        }
        self.command_once("Y", self.wire.config.motion_timeout)?;
        Ok(())
    }

    /// Lets time pass on the line's own clock. Messages that come meanwhile become notices.
    pub(super) fn pause(&mut self, time: Duration) -> Result<(), ArmError> {
        let until = self.wire.after(time);
        let mut heard = String::new();
        while !self.wire.left(until).is_zero() {
            let bytes = self.wire.receive(self.wire.left(until), "waiting")?;
            if heard.len() < self.wire.config.reply_limit {
                heard.push_str(&String::from_utf8_lossy(&bytes.unwrap_or_default()));
            }
        }
        self.wire.notice(&heard);
        Ok(())
    }
}

/// Refuses settings that would make the client send nonsense or wait for ever.
fn check(config: &ClientConfig) -> Result<(), ArmError> {
    if let Some(percent) = config.speed_percent {
        check_percent(percent)?;
    }
    let name = &config.point_name;
    let sound = (1..=6).contains(&name.len())
        && name.starts_with(|c: char| c.is_ascii_alphabetic())
        && name.chars().all(|c| c.is_ascii_alphanumeric());
    if !sound {
        return Err(ArmError::Setting {
            what: "the name of a point",
            value: name.clone(),
            allowed: "one to six letters and digits, a letter first",
        });
    }
    if !(config.tolerance > 0.0 && config.tolerance.is_finite()) {
        return Err(ArmError::Setting {
            what: "the tolerance",
            value: config.tolerance.to_string(),
            allowed: "a positive angle in radians",
        });
    }
    Ok(())
}
