//! Exchanges with the controller: lines typed, replies read.

use std::io;
use std::time::Duration;

use crate::client::config::ClientConfig;
use crate::client::dialogue::{CANCEL, NUDGE, SPOIL, is_boot_question, shortened, way_out};
use crate::client::reader;
use crate::client::reader::{Ending, ReplyReader};
use crate::error::ArmError;
use crate::transport::Transport;

/// A reply that has ended.
#[derive(Debug)]
pub(super) struct Reply {
    pub(super) text: String,
    pub(super) ending: Ending,
}

/// Failure of an exchange, with the possibility that the line has taken effect.
#[derive(Debug)]
pub(super) struct Failed {
    pub(super) error: ArmError,
    pub(super) maybe_done: bool,
}

impl Failed {
    fn before(error: ArmError) -> Self {
        Self {
            error,
            maybe_done: false,
        }
    }

    fn after(error: ArmError) -> Self {
        Self {
            error,
            maybe_done: true,
        }
    }
}

/// Returns `true` if an exchange can be tried again: the line garbled or swallowed something.
pub(super) fn is_doubt(error: &ArmError) -> bool {
    matches!(error, ArmError::Silence { .. } | ArmError::Garbled { .. })
}

/// Most characters without meaning (NUL, bell) in an echo.
const FILLERS: usize = 256;

#[derive(Debug)]
pub(super) struct Wire<T> {
    pub(super) line: T,
    /// The controller echoes; `None` until found out.
    pub(super) echo: Option<bool>,
    /// Messages that came unasked.
    pub(super) notices: Vec<String>,
    /// A line has been begun that was neither ended nor deleted.
    pub(super) half_typed: bool,
    /// Bytes that ask again for a reply that does not come. The program of another user may take an
    /// empty line for an answer.
    pub(super) nudge: &'static [u8],
    /// The start-up dialogue has been met since the monitor was last reached.
    pub(super) restarted: bool,
}

impl<T: Transport> Wire<T> {
    pub(super) fn new(line: T) -> Self {
        Self {
            line,
            echo: None,
            notices: Vec::new(),
            half_typed: false,
            nudge: NUDGE,
            restarted: false,
        }
    }

    pub(super) fn port(&self) -> String {
        self.line.name().to_owned()
    }

    fn broken(&self, doing: &str, source: io::Error) -> ArmError {
        ArmError::Line {
            port: self.port(),
            doing: doing.to_owned(),
            source,
        }
    }

    pub(super) fn send(&mut self, bytes: &[u8], doing: &str) -> Result<(), ArmError> {
        #[cfg(feature = "tracing")]
        tracing::trace!(port = self.line.name(), bytes = %bytes.escape_ascii(), "sent");
        self.line
            .send(bytes)
            .map_err(|source| self.broken(doing, source))
    }

    /// Returns what comes within `wait`, at least one byte, or nothing.
    fn receive(&mut self, wait: Duration, doing: &str) -> Result<Option<Vec<u8>>, ArmError> {
        let mut buffer = [0; 512];
        match self.line.receive(&mut buffer, wait) {
            Ok(Some(count)) => {
                #[cfg(feature = "tracing")]
                tracing::trace!(
                    port = self.line.name(),
                    bytes = %buffer[..count].escape_ascii(),
                    "received"
                );
                Ok(Some(buffer[..count].to_vec()))
            }
            Ok(None) => Ok(None),
            Err(source) => Err(self.broken(doing, source)),
        }
    }

    fn reader(config: &ClientConfig) -> ReplyReader {
        ReplyReader::new(
            config.reply_limit.max(256),
            config.idle_prompt,
            config.run_prompt,
        )
    }

    /// Returns the error of a controller that asks its start-up questions in mid-session.
    fn restart(&mut self, text: &str) -> ArmError {
        self.restarted = true;
        ArmError::Restarted {
            port: self.port(),
            heard: shortened(text),
        }
    }

    /// Types `line` at a prompt or question, ends it and reads the reply for up to `timeout`.
    pub(super) fn exchange(
        &mut self,
        line: &str,
        timeout: Duration,
        config: &ClientConfig,
    ) -> Result<Reply, Failed> {
        self.take_unasked(config).map_err(Failed::before)?;
        if self.half_typed {
            // Left by a call that failed: what is typed now must not be added to it.
            self.spoil(config).map_err(Failed::before)?;
        }
        let typed = padded(line);
        let mut tries = 0;
        loop {
            match self.type_text(&typed, config) {
                Ok(()) => break,
                Err(error) if is_doubt(&error) && tries < config.retries => {
                    tries += 1;
                    let reply = self.spoil(config).map_err(Failed::before)?;
                    if reply.ending == Ending::Question {
                        // The dialogue that the line belongs to has to begin again.
                        return Err(Failed::before(error));
                    }
                }
                Err(error) => return Err(Failed::before(error)),
            }
        }
        self.send(b"\r", line).map_err(Failed::after)?;
        let mut reader = Self::reader(config);
        if self.checks_echo(config) && !self.hears_line_end(&mut reader, line, config)? {
            // The line may still be open at the other end. An empty line would complete whatever
            // its damaged end has made of it.
            self.spoil(config).map_err(Failed::after)?;
            let wait = config.reply_timeout;
            return Err(Failed::after(self.silence(
                line,
                "the echo of its end",
                "",
                wait,
            )));
        }
        self.half_typed = false;
        let reply = self
            .read_on(reader, line, timeout, config)
            .map_err(Failed::after)?;
        if reply.ending == Ending::Question && is_boot_question(&reply.text) {
            return Err(Failed::after(self.restart(&reply.text)));
        }
        Ok(reply)
    }

    /// Returns `true` if typed lines are compared with their echo.
    pub(super) fn checks_echo(&self, config: &ClientConfig) -> bool {
        self.echo == Some(true) && config.check_echo
    }

    /// Waits until the end of a line has come back, and keeps what comes with it in `reader`.
    fn hears_line_end(
        &mut self,
        reader: &mut ReplyReader,
        line: &str,
        config: &ClientConfig,
    ) -> Result<bool, Failed> {
        let wait = config.reply_timeout;
        for _ in 0..FILLERS {
            let Some(bytes) = self.receive(wait, line).map_err(Failed::after)? else {
                return Ok(false);
            };
            reader.push(&bytes);
            if bytes.iter().any(|byte| matches!(byte, b'\r' | b'\n')) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Reads away unasked output and keeps its messages.
    fn take_unasked(&mut self, config: &ClientConfig) -> Result<(), ArmError> {
        let mut reader = Self::reader(config);
        // A line that never falls silent is left to the echo check.
        for _ in 0..64 {
            match self.receive(Duration::ZERO, "listening")? {
                Some(bytes) => reader.push(&bytes),
                None => break,
            }
        }
        if reader.ending() == Some(Ending::Question) && is_boot_question(reader.text()) {
            return Err(self.restart(reader.text()));
        }
        self.notice(reader.text());
        Ok(())
    }

    pub(super) fn notice(&mut self, text: &str) {
        self.notices.extend(reader::messages(text));
        let excess = self.notices.len().saturating_sub(100);
        self.notices.drain(..excess);
    }

    /// Sends the text and, where there is an echo, waits until it has come back unchanged. The line
    /// is not ended.
    fn type_text(&mut self, text: &str, config: &ClientConfig) -> Result<(), ArmError> {
        self.half_typed = true;
        self.send(text.as_bytes(), text)?;
        if !self.checks_echo(config) {
            return Ok(());
        }
        let patience = config.patience().saturating_mul(1 + text.len() as u32 / 16);
        let until = self.line.clock().saturating_add(patience);
        let mut heard = Vec::new();
        let mut fillers = 0;
        while heard.len() < text.len() {
            let Some(bytes) = self.receive(config.reply_timeout, text)? else {
                break;
            };
            let count = bytes.len();
            let before = heard.len();
            heard.extend(bytes.into_iter().filter(|b| !matches!(b, 0 | 0x07)));
            fillers += count - (heard.len() - before);
            if fillers > FILLERS || self.line.clock() >= until {
                break;
            }
        }
        if heard.eq_ignore_ascii_case(text.as_bytes()) {
            return Ok(());
        }
        let heard_text = shortened(&String::from_utf8_lossy(&heard));
        if heard.len() < text.len() && fillers <= FILLERS {
            return Err(self.silence(text, "its echo", &heard_text, config.reply_timeout));
        }
        Err(self.garbled(text, "its echo", &heard_text))
    }

    /// Reads until a prompt or question is followed by silence.
    ///
    /// After a silence of `config.reply_timeout` an empty line is sent. It brings back a lost
    /// prompt, and a busy controller answers it later. A line that says too much, or never falls
    /// silent, is given up.
    pub(super) fn read_reply(
        &mut self,
        sent: &str,
        timeout: Duration,
        config: &ClientConfig,
    ) -> Result<Reply, ArmError> {
        self.read_on(Self::reader(config), sent, timeout, config)
    }

    /// Continues a reply of which `reader` holds the beginning.
    fn read_on(
        &mut self,
        mut reader: ReplyReader,
        sent: &str,
        timeout: Duration,
        config: &ClientConfig,
    ) -> Result<Reply, ArmError> {
        let until = self.line.clock().saturating_add(timeout);
        let at_the_latest =
            until.saturating_add(config.reply_timeout.max(config.quiet.saturating_mul(4)));
        let mut taken = 0;
        loop {
            let ending = reader.ending();
            let left = until.saturating_sub(self.line.clock());
            let wait = match ending {
                Some(_) => config.quiet,
                None => config.reply_timeout.min(left).max(Duration::from_millis(1)),
            };
            if let Some(bytes) = self.receive(wait, sent)? {
                reader.push(&bytes);
                taken += bytes.len();
                if reader.overflowed() || taken > config.reply_limit.max(256) {
                    return Err(self.garbled(
                        sent,
                        "a reply of bounded length",
                        &shortened(reader.text()),
                    ));
                }
                if left.is_zero() && ending.is_none() || self.line.clock() >= at_the_latest {
                    return Err(self.garbled(sent, "a reply that ends", &shortened(reader.text())));
                }
                continue;
            }
            if let Some(ending) = ending {
                return Ok(Reply {
                    text: reader.text().to_owned(),
                    ending,
                });
            }
            if self.line.clock() >= until {
                let expected = format!("the prompt `{}`", config.idle_prompt);
                return Err(self.silence(sent, &expected, &shortened(reader.text()), timeout));
            }
            if !self.nudge.is_empty() {
                self.send(self.nudge, sent)?;
            }
        }
    }

    /// Carries out a line that starts a program, until the program ends or asks.
    pub(super) fn exchange_to_end(
        &mut self,
        line: &str,
        timeout: Duration,
        config: &ClientConfig,
    ) -> Result<Reply, Failed> {
        let until = self.line.clock().saturating_add(timeout);
        let mut reply = self.exchange(line, timeout, config)?;
        while reply.ending == Ending::Running {
            let left = until.saturating_sub(self.line.clock());
            let more = self.read_reply(line, left, config).map_err(Failed::after)?;
            reply.text.push_str(&more.text);
            reply.ending = more.ending;
            if reply.text.len() > config.reply_limit {
                let heard = shortened(&reply.text);
                return Err(Failed::after(self.garbled(
                    line,
                    "output of bounded length",
                    &heard,
                )));
            }
        }
        Ok(reply)
    }

    /// Makes a half-typed line harmless and reads the reply.
    pub(super) fn spoil(&mut self, config: &ClientConfig) -> Result<Reply, ArmError> {
        let doing = "clearing the line";
        let patience = config.patience();
        let until = self.line.clock().saturating_add(patience);
        let mut reader = Self::reader(config);
        let mut taken = 0;
        while let Some(bytes) = self.receive(config.quiet, doing)? {
            reader.push(&bytes);
            taken += bytes.len();
            if taken > config.reply_limit.max(256).saturating_mul(2) || self.line.clock() >= until {
                return Err(self.garbled("an empty line", "silence", &shortened(reader.text())));
            }
        }
        self.send(SPOIL, doing)?;
        let reply = self.read_reply("an empty line", patience, config)?;
        self.half_typed = false;
        if reply.ending == Ending::Question && is_boot_question(&reply.text) {
            return Err(self.restart(&reply.text));
        }
        Ok(reply)
    }

    /// Leaves whatever dialogue the line is in, and says no to everything.
    pub(super) fn settle(&mut self, config: &ClientConfig) -> Result<Ending, ArmError> {
        let patience = config.patience();
        let mut reply = self.spoil(config)?;
        for attempt in 0..8 {
            if reply.ending != Ending::Question {
                return Ok(reply.ending);
            }
            let answer = way_out(&reply.text, attempt);
            self.send(answer, "leaving a dialogue")?;
            reply = self.read_reply("a refusal", patience, config)?;
            if answer == CANCEL && reply.ending == Ending::Running {
                // The program that asked would wait for ever.
                self.send(b"ABORT\r", "leaving a dialogue")?;
                reply = self.read_reply("ABORT", patience, config)?;
            }
            if reply.ending == Ending::Question && is_boot_question(&reply.text) {
                return Err(self.restart(&reply.text));
            }
        }
        Err(self.garbled(
            "an empty line",
            "the monitor's prompt",
            "one question after another",
        ))
    }

    pub(super) fn silence(
        &self,
        sent: &str,
        expected: &str,
        heard: &str,
        waited: Duration,
    ) -> ArmError {
        ArmError::Silence {
            port: self.port(),
            sent: sent.to_owned(),
            expected: expected.to_owned(),
            heard: heard.to_owned(),
            waited,
        }
    }

    pub(super) fn garbled(&self, sent: &str, expected: &str, heard: &str) -> ArmError {
        ArmError::Garbled {
            port: self.port(),
            sent: sent.to_owned(),
            expected: expected.to_owned(),
            heard: heard.to_owned(),
        }
    }
}

/// Returns a command with a blank at its end, so that a doubled or changed last character cannot
/// make another name or number of its last word.
fn padded(line: &str) -> String {
    let command = line.starts_with(|c: char| c.is_ascii_alphabetic()) && line.contains(' ');
    if command && line.ends_with(|c: char| c.is_ascii_alphanumeric()) {
        format!("{line} ")
    } else {
        line.to_owned()
    }
}
