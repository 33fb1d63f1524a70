//! Exchanges with the controller: lines typed, replies read.

use std::io;
use std::time::Duration;

use crate::client::config::ClientConfig;
use crate::client::dialogue::{
    CANCEL, Mode, State, at_silence, is_boot_question, shortened, way_out,
};
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
    pub(super) fn after(error: ArmError) -> Self {
        let maybe_done = true;
        Self { error, maybe_done }
    }
}

impl From<ArmError> for Failed {
    /// A failure before the line took effect.
    fn from(error: ArmError) -> Self {
        let maybe_done = false;
        Self { error, maybe_done }
    }
}

impl From<Failed> for ArmError {
    fn from(failed: Failed) -> Self {
        failed.error
    }
}

/// Returns `true` if an exchange can be tried again: the line garbled or swallowed something.
pub(super) fn is_doubt(error: &ArmError) -> bool {
    matches!(error, ArmError::Silence { .. } | ArmError::Garbled { .. })
}

/// Most characters without meaning in an echo.
const FILLERS: usize = 256;

#[derive(Debug)]
pub(super) struct Wire<T> {
    pub(super) line: T,
    pub(super) config: ClientConfig,
    /// The controller echoes; `None` until found out.
    pub(super) echo: Option<bool>,
    /// Messages that came unasked.
    pub(super) notices: Vec<String>,
    /// State of the line.
    pub(super) state: State,
    /// Task at hand.
    pub(super) mode: Mode,
    /// The start-up dialogue has been met since the monitor was last reached.
    pub(super) restarted: bool,
    /// The question of a program has been cancelled, and the program not yet been ended.
    pub(super) cancelled: bool,
}

impl<T: Transport> Wire<T> {
    pub(super) fn new(line: T, config: ClientConfig) -> Self {
        Self {
            line,
            config,
            echo: None,
            notices: Vec::new(),
            state: State::Open,
            mode: Mode::Session,
            restarted: false,
            cancelled: false,
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
        let mut bytes = bytes.to_vec();
        if !self.config.control_characters {
            bytes.retain(|byte| *byte == b'\r' || !byte.is_ascii_control());
        }
        #[cfg(feature = "tracing")]
        tracing::trace!(port = self.line.name(), bytes = %bytes.escape_ascii(), "sent");
        let sent = self.line.send(&bytes);
        sent.map_err(|source| self.broken(doing, source))
    }

    /// Returns what comes within `wait`, at least one byte, or nothing.
    pub(super) fn receive(
        &mut self,
        wait: Duration,
        doing: &str,
    ) -> Result<Option<Vec<u8>>, ArmError> {
        let mut buffer = [0; 512];
        let received = self.line.receive(&mut buffer, wait);
        let bytes = received
            .map_err(|source| self.broken(doing, source))?
            .map(|count| buffer[..count].to_vec());
        #[cfg(feature = "tracing")]
        if let Some(bytes) = &bytes {
            tracing::trace!(port = self.line.name(), bytes = %bytes.escape_ascii(), "received");
        }
        Ok(bytes)
    }

    /// Returns the time by the line's clock at which `wait` is over.
    pub(super) fn after(&self, wait: Duration) -> Duration {
        self.line.clock().saturating_add(wait)
    }

    /// Returns the time that is left until `until`.
    pub(super) fn left(&self, until: Duration) -> Duration {
        until.saturating_sub(self.line.clock())
    }

    fn reader(&self) -> ReplyReader {
        let ClientConfig {
            idle_prompt,
            run_prompt,
            ..
        } = self.config;
        ReplyReader::new(self.reply_limit(), idle_prompt, run_prompt)
    }

    fn reply_limit(&self) -> usize {
        self.config.reply_limit.max(256)
    }

    /// Returns the reply, or the error of a controller that asks its start-up questions in
    /// mid-session.
    fn not_restarted(&mut self, reply: Reply) -> Result<Reply, ArmError> {
        if reply.ending != Ending::Question || !is_boot_question(&reply.text) {
            return Ok(reply);
        }
        self.restarted = true;
        Err(ArmError::Restarted {
            port: self.port(),
            heard: shortened(&reply.text),
        })
    }

    /// Types `line` at a prompt or question, ends it and reads the reply for up to `timeout`.
    pub(super) fn exchange(&mut self, line: &str, timeout: Duration) -> Result<Reply, Failed> {
        self.take_unasked()?;
        if self.cancelled {
            self.settle()?;
        } else if matches!(self.state, State::Open | State::Ended) {
            // Left by a call that failed: what is typed now must not be added to it.
            self.spoil()?;
        }
        let typed = padded(line);
        let mut tries = 0;
        while let Err(error) = self.type_text(&typed) {
            tries += 1;
            // At a question the dialogue that the line belongs to has to begin again.
            let again = is_doubt(&error)
                && tries <= self.config.retries
                && self.spoil()?.ending != Ending::Question;
            if !again {
                return Err(error.into());
            }
        }
        self.end_line(line, timeout).map_err(Failed::after)
    }

    fn end_line(&mut self, line: &str, timeout: Duration) -> Result<Reply, ArmError> {
        self.state = State::Ended;
        self.send(b"\r", line)?;
        let mut reader = self.reader();
        if self.checks_echo() && !self.hears_line_end(&mut reader, line)? {
            self.spoil()?;
            return Err(self.silence(line, "the echo of its end", "", self.config.reply_timeout));
        }
        self.state = State::Replying;
        let reply = self.read_on(reader, line, timeout)?;
        self.not_restarted(reply)
    }

    /// Returns `true` if typed lines are compared with their echo.
    pub(super) fn checks_echo(&self) -> bool {
        self.echo == Some(true) && self.config.check_echo
    }

    /// Waits until the end of a line has come back, and keeps what comes with it in `reader`.
    fn hears_line_end(&mut self, reader: &mut ReplyReader, line: &str) -> Result<bool, ArmError> {
        for _ in 0..FILLERS {
            let Some(bytes) = self.receive(self.config.reply_timeout, line)? else {
                return Ok(false);
            };
            reader.push(&bytes);
            if bytes.iter().any(|byte| matches!(byte, b'\r' | b'\n')) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Discards output that no command asked for, and keeps the messages in it as notices.
    fn take_unasked(&mut self) -> Result<(), ArmError> {
        let mut reader = self.reader();
        // A line that never falls silent is left to the echo check.
        for _ in 0..64 {
            match self.receive(Duration::ZERO, "listening")? {
                Some(bytes) => reader.push(&bytes),
                None => break,
            }
        }
        if let Some(ending) = reader.ending() {
            let text = reader.text().to_owned();
            self.not_restarted(Reply { text, ending })?;
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
    fn type_text(&mut self, text: &str) -> Result<(), ArmError> {
        self.state = State::Open;
        self.send(text.as_bytes(), text)?;
        if !self.checks_echo() {
            return Ok(());
        }
        let patience = self.config.patience();
        let until = self.after(patience.saturating_mul(1 + text.len() as u32 / 16));
        let mut heard = Vec::new();
        let mut fillers = 0;
        while heard.len() < text.len() {
            let Some(bytes) = self.receive(self.config.reply_timeout, text)? else {
                break;
            };
            let (before, count) = (heard.len(), bytes.len());
            // NUL, bell, and the characters of flow control.
            heard.extend(
                bytes
                    .into_iter()
                    .filter(|b| !matches!(b, 0 | 0x07 | 0x11 | 0x13)),
            );
            fillers += count - (heard.len() - before);
            if fillers > FILLERS || self.left(until).is_zero() {
                break;
            }
        }
        if heard.eq_ignore_ascii_case(text.as_bytes()) {
            return Ok(());
        }
        let heard_text = String::from_utf8_lossy(&heard);
        if heard.len() < text.len() && fillers <= FILLERS {
            return Err(self.silence(text, "its echo", &heard_text, self.config.reply_timeout));
        }
        Err(self.garbled(text, "its echo", &heard_text))
    }

    /// Reads until a prompt or question is followed by silence.
    pub(super) fn read_reply(&mut self, sent: &str, timeout: Duration) -> Result<Reply, ArmError> {
        self.state = State::Replying;
        self.read_on(self.reader(), sent, timeout)
    }

    /// Continues a reply of which `reader` holds the beginning.
    ///
    /// A silence of `config.reply_timeout` is answered by [`at_silence`]. A line that says too
    /// much, or never falls silent, is given up.
    fn read_on(
        &mut self,
        mut reader: ReplyReader,
        sent: &str,
        timeout: Duration,
    ) -> Result<Reply, ArmError> {
        let ClientConfig {
            quiet,
            reply_timeout,
            ..
        } = self.config;
        let until = self.after(timeout);
        let at_the_latest = until.saturating_add(reply_timeout.max(quiet.saturating_mul(4)));
        let mut taken = 0;
        // A busy controller answers every empty line later: each waits longer than the one before.
        let mut patience = reply_timeout;
        loop {
            let ending = reader.ending();
            let left = self.left(until);
            let wait = match ending {
                Some(_) => quiet,
                None => patience.min(left).max(Duration::from_millis(1)),
            };
            if let Some(bytes) = self.receive(wait, sent)? {
                reader.push(&bytes);
                taken += bytes.len();
                if reader.overflowed() || taken > self.reply_limit() {
                    return Err(self.garbled(sent, "a reply of bounded length", reader.text()));
                }
                if left.is_zero() && ending.is_none() || self.left(at_the_latest).is_zero() {
                    return Err(self.garbled(sent, "a reply that ends", reader.text()));
                }
                continue;
            }
            if let Some(ending) = ending {
                let text = reader.text().to_owned();
                self.state = State::Asking(ending);
                return Ok(Reply { text, ending });
            }
            if self.left(until).is_zero() {
                let expected = format!("the prompt `{}`", self.config.idle_prompt);
                return Err(self.silence(sent, &expected, reader.text(), timeout));
            }
            self.send(at_silence(self.state, self.mode), sent)?;
            patience = patience.saturating_mul(2);
        }
    }

    /// Carries out a line that starts a program, until the program ends or asks.
    pub(super) fn exchange_to_end(
        &mut self,
        line: &str,
        timeout: Duration,
    ) -> Result<Reply, Failed> {
        let until = self.after(timeout);
        let mut reply = self.exchange(line, timeout)?;
        while reply.ending == Ending::Running {
            let more = self.read_reply(line, self.left(until));
            let more = more.map_err(Failed::after)?;
            reply.text.push_str(&more.text);
            reply.ending = more.ending;
            if reply.text.len() > self.config.reply_limit {
                let error = self.garbled(line, "output of bounded length", &reply.text);
                return Err(Failed::after(error));
            }
        }
        Ok(reply)
    }

    /// Makes an open line harmless and reads the reply.
    pub(super) fn spoil(&mut self) -> Result<Reply, ArmError> {
        let doing = "clearing the line";
        let patience = self.config.patience();
        let until = self.after(patience);
        let mut reader = self.reader();
        let mut taken = 0;
        self.state = State::Open;
        while let Some(bytes) = self.receive(self.config.quiet, doing)? {
            reader.push(&bytes);
            taken += bytes.len();
            if taken > self.reply_limit().saturating_mul(2) || self.left(until).is_zero() {
                return Err(self.garbled("an empty line", "silence", reader.text()));
            }
        }
        self.send(at_silence(self.state, self.mode), doing)?;
        let reply = self.read_on(self.reader(), "an empty line", patience)?;
        self.not_restarted(reply)
    }

    /// Leaves whatever dialogue the line is in, and says no to everything.
    pub(super) fn settle(&mut self) -> Result<Ending, ArmError> {
        let patience = self.config.patience();
        let mut reply = self.spoil()?;
        for attempt in 0..8 {
            let answer = match reply.ending {
                Ending::Question => way_out(&reply.text, attempt),
                // The program that asked would wait for ever.
                Ending::Running if self.cancelled => b"ABORT\r",
                ending => {
                    self.cancelled = false;
                    return Ok(ending);
                }
            };
            self.cancelled |= answer == CANCEL;
            self.send(answer, "leaving a dialogue")?;
            reply = self.read_reply("a refusal", patience)?;
            reply = self.not_restarted(reply)?;
        }
        let heard = "one question after another";
        Err(self.garbled("an empty line", "the monitor's prompt", heard))
    }

    /// Leaves the doubt of a failed exchange, so that it can be tried again. Returns the error if
    /// it is another one, or if `tries` has reached `config.retries`.
    pub(super) fn retry(&mut self, error: ArmError, tries: &mut usize) -> Result<(), ArmError> {
        if !is_doubt(&error) || *tries >= self.config.retries {
            return Err(error);
        }
        *tries += 1;
        self.settle().map(drop)
    }

    pub(super) fn silence(
        &self,
        sent: &str,
        expected: &str,
        heard: &str,
        waited: Duration,
    ) -> ArmError {
        let setting = if waited > self.config.patience() {
            "motion_timeout"
        } else {
            "reply_timeout"
        };
        ArmError::Silence {
            port: self.port(),
            sent: sent.to_owned(),
            expected: format!("{expected} (limit: `{setting}`)"),
            heard: shortened(heard),
            waited,
        }
    }

    pub(super) fn garbled(&self, sent: &str, expected: &str, heard: &str) -> ArmError {
        ArmError::Garbled {
            port: self.port(),
            sent: sent.to_owned(),
            expected: expected.to_owned(),
            heard: shortened(heard),
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
