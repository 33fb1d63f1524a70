//! The controller's end of the line: characters in, lines out; text in, characters out, each in its
//! time.

use std::collections::VecDeque;
use std::time::Duration;

use crate::emulator::profile::Profile;

/// Effect of a character that came in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Typed {
    /// Nothing to act on yet.
    Nothing,
    /// A line is complete.
    Line,
    /// Ctrl-C.
    Cancel,
    /// Ctrl-Z.
    EndOfInput,
    /// The character was lost: the input buffer is full.
    Lost,
}

/// Most characters that wait to be sent.
const OUTPUT_LIMIT: usize = 1 << 20;

/// Most characters on their way in; further ones are lost.
const INPUT_LIMIT: usize = 1 << 16;

/// Longest line whatever the profile allows.
const LONGEST_LINE: usize = 4096;

/// Most complete lines that wait, whatever their length.
const LINE_LIMIT: usize = 64;

/// Complete line.
#[derive(Clone, Debug)]
pub(crate) struct Line {
    pub(crate) text: String,
    /// More was typed than the line buffer holds.
    pub(crate) too_long: bool,
}

#[derive(Debug)]
pub(crate) struct Terminal {
    arriving: VecDeque<(Duration, u8)>,
    line_busy_until: Duration,
    typed: String,
    /// The line being typed has outgrown the line buffer.
    too_long: bool,
    /// Complete lines, oldest first.
    lines: VecDeque<Line>,
    sending: VecDeque<u8>,
    sent_at: Duration,
    at_line_start: bool,
    held: bool,
    dropped: bool,
}

impl Terminal {
    pub(crate) fn new() -> Self {
        Self {
            arriving: VecDeque::new(),
            line_busy_until: Duration::ZERO,
            typed: String::new(),
            too_long: false,
            lines: VecDeque::new(),
            sending: VecDeque::new(),
            sent_at: Duration::ZERO,
            at_line_start: true,
            held: false,
            dropped: false,
        }
    }

    /// Takes bytes off the wire. Each is complete a character's time after the one before.
    pub(crate) fn arrive(&mut self, bytes: &[u8], now: Duration, profile: &Profile) {
        for &byte in bytes {
            if self.arriving.len() >= INPUT_LIMIT {
                return;
            }
            let at = match profile.char_time() {
                Some(time) => self.line_busy_until.max(now).saturating_add(time),
                None => now,
            };
            self.line_busy_until = at;
            self.arriving.push_back((at, byte));
        }
    }

    /// Returns the time at which the next character is complete.
    pub(crate) fn next_arrival(&self) -> Option<Duration> {
        self.arriving.front().map(|(at, _)| *at)
    }

    /// Handles the next character if it is complete by `now`.
    pub(crate) fn take_character(&mut self, now: Duration, profile: &Profile) -> Option<Typed> {
        let (at, byte) = *self.arriving.front()?;
        if at > now {
            return None;
        }
        self.arriving.pop_front();
        Some(self.character(byte, now, profile))
    }

    fn character(&mut self, byte: u8, now: Duration, profile: &Profile) -> Typed {
        let control = profile.control_characters;
        match byte {
            b'\r' => {
                if profile.echo {
                    self.print(profile.eol, now);
                } else {
                    // The terminal's own local echo is off too: the cursor still stands behind the
                    // prompt.
                    self.at_line_start = false;
                }
                let line = Line {
                    text: std::mem::take(&mut self.typed),
                    too_long: std::mem::take(&mut self.too_long),
                };
                if self.lines.len() >= LINE_LIMIT {
                    return Typed::Lost;
                }
                self.lines.push_back(line);
                Typed::Line
            }
            0x03 if control => {
                self.clear_typed();
                self.forget_lines();
                self.echo("^C", now, profile);
                self.fresh_line(profile, now);
                Typed::Cancel
            }
            0x1a if control => {
                self.echo("^Z", now, profile);
                Typed::EndOfInput
            }
            0x15 if control => {
                self.clear_typed();
                self.echo("^U", now, profile);
                self.fresh_line(profile, now);
                Typed::Nothing
            }
            0x08 | 0x7f if control => {
                self.too_long = false;
                if self.typed.pop().is_some() {
                    self.echo("\x08 \x08", now, profile);
                }
                Typed::Nothing
            }
            0x13 if control => {
                self.held = true;
                Typed::Nothing
            }
            0x11 if control => {
                self.held = false;
                Typed::Nothing
            }
            0x0f if control => {
                self.dropped = !self.dropped;
                Typed::Nothing
            }
            b'\t' => self.character(b' ', now, profile),
            0x20..=0x7e => {
                self.too_long |= self.typed.len() >= profile.max_line.min(LONGEST_LINE);
                if !self.too_long && self.can_wait(profile) {
                    self.typed.push(byte as char);
                    let mut text = [0; 4];
                    self.echo((byte as char).encode_utf8(&mut text), now, profile);
                    Typed::Nothing
                } else {
                    self.echo("\x07", now, profile);
                    Typed::Lost
                }
            }
            // LF after CR, NUL as filler, and noise with the eighth bit set.
            _ => Typed::Nothing,
        }
    }

    fn clear_typed(&mut self) {
        self.typed.clear();
        self.too_long = false;
    }

    /// Returns `true` if a further character can wait behind the waiting lines, each of which takes
    /// its characters and its end.
    fn can_wait(&self, profile: &Profile) -> bool {
        let waiting: usize = self.lines.iter().map(|line| line.text.len() + 1).sum();
        self.lines.is_empty() || waiting + self.typed.len() < profile.input_buffer
    }

    /// Takes the oldest complete line.
    pub(crate) fn next_line(&mut self) -> Option<Line> {
        self.lines.pop_front()
    }

    /// Returns the newest complete line without taking it.
    pub(crate) fn newest_line(&self) -> Option<&str> {
        self.lines.back().map(|line| line.text.as_str())
    }

    /// Returns `true` if complete lines wait.
    pub(crate) fn has_line(&self) -> bool {
        !self.lines.is_empty()
    }

    /// Drops complete lines.
    pub(crate) fn forget_lines(&mut self) {
        self.lines.clear();
    }

    fn echo(&mut self, text: &str, now: Duration, profile: &Profile) {
        if profile.echo {
            self.print(text, now);
        }
    }

    /// Queues text for the line.
    pub(crate) fn print(&mut self, text: &str, now: Duration) {
        if text.is_empty() || self.dropped {
            return;
        }
        self.at_line_start = text.ends_with(['\n', '\r']);
        if self.sending.is_empty() {
            self.sent_at = self.sent_at.max(now);
        }
        if self.sending.len() + text.len() <= OUTPUT_LIMIT {
            self.sending.extend(text.bytes());
        }
    }

    /// Ends the line of the output, unless it is at the start of one.
    pub(crate) fn fresh_line(&mut self, profile: &Profile, now: Duration) {
        if !self.at_line_start {
            self.print(profile.eol, now);
        }
    }

    /// Resumes output that Ctrl-O has suppressed.
    pub(crate) fn resume(&mut self) {
        self.dropped = false;
    }

    /// Returns the time at which the next character goes out, if output waits.
    pub(crate) fn next_departure(&self, profile: &Profile) -> Option<Duration> {
        let waits = !self.sending.is_empty() && !self.held;
        waits.then(|| {
            self.sent_at
                .saturating_add(profile.char_time().unwrap_or_default())
        })
    }

    /// Returns the characters that have gone out by `now`.
    pub(crate) fn departed(&mut self, now: Duration, profile: &Profile) -> Vec<u8> {
        if self.held {
            return Vec::new();
        }
        let Some(time) = profile.char_time().filter(|t| !t.is_zero()) else {
            return self.sending.drain(..).collect();
        };
        let due = now.saturating_sub(self.sent_at).as_nanos() / time.as_nanos();
        let count = usize::try_from(due)
            .unwrap_or(usize::MAX)
            .min(self.sending.len());
        self.sent_at += time * u32::try_from(count).unwrap_or(u32::MAX);
        self.sending.drain(..count).collect()
    }
}
