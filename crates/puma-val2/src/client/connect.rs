//! Connection with the monitor, and calibration of the arm.

use std::collections::BTreeMap;

use crate::client::config::ClientConfig;
use crate::client::dialogue::{NUDGE, SPOIL, is_boot_question, last_question, shortened, way_out};
use crate::client::number::check_percent;
use crate::client::reader;
use crate::client::reader::Ending;
use crate::client::val2_client::Val2Client;
use crate::client::whereabouts::Location;
use crate::client::wire::{Wire, is_doubt};
use crate::error::ArmError;
use crate::transport::Transport;

impl<T: Transport> Val2Client<T> {
    /// Connects to the monitor and sets the speed of `config`. A start-up dialogue is answered, any
    /// other dialogue is left, and a half-typed line is deleted.
    ///
    /// # Errors
    /// [`ArmError::Silence`] or [`ArmError::Garbled`] within `config.connect_timeout` if there is
    /// no VAL monitor at the other end.
    pub fn connect(transport: T, config: ClientConfig) -> Result<Self, ArmError> {
        check(&config)?;
        let mut client = Self {
            wire: Wire::new(transport),
            config,
            last_known: None,
            points: BTreeMap::new(),
            goal_program: None,
            lacks_ppoint: false,
            guard: None,
        };
        client.reach_monitor()?;
        client.find_echo()?;
        if let Some(percent) = client.config.speed_percent {
            client.set_speed(percent)?;
        }
        Ok(client)
    }

    /// Connects anew, after [`ArmError::Restarted`] for instance. The arm has to be calibrated
    /// again.
    ///
    /// # Errors
    /// Those of [`Val2Client::connect`].
    pub fn reconnect(&mut self) -> Result<(), ArmError> {
        self.wire.echo = None;
        self.last_known = None;
        self.guard = None;
        self.points.clear();
        self.goal_program = None;
        self.lacks_ppoint = false;
        self.reach_monitor()?;
        self.find_echo()?;
        match self.config.speed_percent {
            Some(percent) => self.set_speed(percent),
            None => Ok(()),
        }
    }

    fn reach_monitor(&mut self) -> Result<(), ArmError> {
        self.wire.nudge = SPOIL;
        let outcome = self.find_prompt();
        self.wire.nudge = NUDGE;
        outcome
    }

    fn find_prompt(&mut self) -> Result<(), ArmError> {
        let begun = self.wire.line.clock();
        let until = begun.saturating_add(self.config.connect_timeout);
        // Something that is no command and no answer: a half-typed line is spoilt by it, a question
        // asked again.
        self.wire.send(SPOIL, "connecting")?;
        let (mut questions, mut ways) = (0, 0);
        loop {
            let left = until.saturating_sub(self.wire.line.clock());
            let expected = "the prompt `.` of the VAL monitor or a start-up question";
            let reply = match self.wire.read_reply("CR", left, &self.config) {
                Ok(reply) => reply,
                Err(ArmError::Silence { heard, waited, .. }) if heard.is_empty() => {
                    return Err(self.wire.silence(
                        "CR",
                        expected,
                        "",
                        waited.max(self.config.connect_timeout),
                    ));
                }
                Err(ArmError::Silence { heard, .. } | ArmError::Garbled { heard, .. }) => {
                    return Err(self.wire.garbled("CR", expected, &heard));
                }
                Err(other) => return Err(other),
            };
            let answer: &[u8] = match reply.ending {
                Ending::Idle => {
                    self.wire.half_typed = false;
                    self.wire.restarted = false;
                    return Ok(());
                }
                Ending::Running if self.config.abort_running_program => b"ABORT\r",
                Ending::Running => {
                    let heard = "the prompt of a monitor under which a program runs";
                    return Err(self.wire.garbled("CR", "an idle monitor", heard));
                }
                Ending::Question if is_boot_question(&reply.text) => {
                    // Whatever may be the question that erases the memory is answered as that one.
                    let initializes = last_question(&reply.text).contains("INIT");
                    let yes = if initializes {
                        self.config.initialize
                    } else {
                        self.config.load_from_floppy
                    };
                    if yes { b"Y\r" } else { b"N\r" }
                }
                Ending::Question => {
                    ways += 1;
                    way_out(&reply.text, ways - 1)
                }
            };
            questions += 1;
            if questions > 20 || left.is_zero() {
                return Err(self.wire.garbled("CR", expected, &shortened(&reply.text)));
            }
            self.wire.send(answer, "connecting")?;
        }
    }

    /// Types a command that does no harm and listens for its echo before the line is ended.
    fn find_echo(&mut self) -> Result<(), ArmError> {
        self.wire.echo = Some(false);
        for attempt in 0..=self.config.retries {
            self.wire.send(b"WHERE", "WHERE")?;
            let mut buffer = [0; 64];
            let mut heard = Vec::new();
            let wait = self.config.quiet.saturating_mul(3);
            loop {
                match self.wire.line.receive(&mut buffer, wait) {
                    Ok(Some(count)) => heard.extend_from_slice(&buffer[..count]),
                    Ok(None) => break,
                    Err(source) => {
                        return Err(ArmError::Line {
                            port: self.wire.port(),
                            doing: "WHERE".into(),
                            source,
                        });
                    }
                }
                if heard.len() >= 5 {
                    break;
                }
            }
            self.wire.send(b"\r", "WHERE")?;
            match self
                .wire
                .read_reply("WHERE", self.config.patience(), &self.config)
            {
                Ok(reply) => {
                    // An echo may come late, behind a message that nobody asked for, or damaged.
                    // What looks like neither echo nor silence is listened to again.
                    let said = String::from_utf8_lossy(&heard).to_ascii_uppercase();
                    let echoed = said.contains("WHERE")
                        || reply.text.to_ascii_uppercase().contains("WHERE\r");
                    let plain = echoed || heard.is_empty() || attempt == self.config.retries;
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
            self.wire.settle(&self.config)?;
        }
        let expected = "X Y Z O A T and six joint angles";
        Err(self
            .wire
            .garbled("WHERE", expected, "nothing of the kind, several times"))
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
                Err(error) if is_doubt(&error) && doubts < self.config.retries => {
                    doubts += 1;
                    self.wire.settle(&self.config)?;
                }
                Err(ArmError::Refused { message, .. })
                    if message.to_ascii_uppercase().contains("POWER")
                        && refusals < self.config.power_retries =>
                {
                    refusals += 1;
                    self.pause(self.config.power_retry_delay)?;
                }
                Err(error) => return Err(error),
            }
        }
    }

    fn calibrate_once(&mut self) -> Result<(), ArmError> {
        let patience = self.config.patience();
        let reply = self
            .wire
            .exchange("CAL", patience, &self.config)
            .map_err(|failed| failed.error)?;
        self.without_message("CAL", &reply)
            .map_err(|failed| failed.error)?;
        if reply.ending != Ending::Question {
            return Err(self
                .wire
                .garbled("CAL", "a question", &shortened(&reply.text)));
        }
        self.command_once("Y", self.config.motion_timeout)
            .map(drop)
            .map_err(|failed| failed.error)
    }

    /// Lets time pass on the line's own clock. Messages that come meanwhile become notices.
    pub(super) fn pause(&mut self, time: std::time::Duration) -> Result<(), ArmError> {
        let until = self.wire.line.clock().saturating_add(time);
        let mut heard = String::new();
        loop {
            let left = until.saturating_sub(self.wire.line.clock());
            if left.is_zero() {
                self.wire.notice(&heard);
                return Ok(());
            }
            let mut buffer = [0; 256];
            match self.wire.line.receive(&mut buffer, left) {
                Ok(Some(count)) if heard.len() < self.config.reply_limit => {
                    heard.push_str(&String::from_utf8_lossy(&buffer[..count]));
                }
                Ok(_) => {}
                Err(source) => {
                    return Err(ArmError::Line {
                        port: self.wire.port(),
                        doing: "waiting".into(),
                        source,
                    });
                }
            }
        }
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
