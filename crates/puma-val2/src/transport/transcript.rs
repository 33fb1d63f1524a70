//! Transcripts of a line.

use std::io::{self, Write};
use std::time::Duration;

use crate::transport::Transport;

/// Writer of transcripts: `< ` begins bytes to the controller, `> ` bytes from it. Line ends are
/// shown by line ends, other control characters as `^C`, bytes beyond ASCII as `\xNN`.
#[derive(Debug)]
pub(crate) struct Transcript<W> {
    out: W,
    direction: Option<char>,
}

impl<W: Write> Transcript<W> {
    pub(crate) fn new(out: W) -> Self {
        Self {
            out,
            direction: None,
        }
    }

    pub(crate) fn sent(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.write('<', bytes)
    }

    pub(crate) fn received(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.write('>', bytes)
    }

    fn write(&mut self, direction: char, bytes: &[u8]) -> io::Result<()> {
        if bytes.is_empty() {
            return Ok(());
        }
        let mut text = String::new();
        for &byte in bytes {
            if self.direction != Some(direction) {
                if self.direction.is_some() {
                    text.push('\n');
                }
                self.direction = Some(direction);
                text.push(direction);
                text.push(' ');
            }
            match byte {
                // The line that follows begins anew, whoever speaks.
                b'\r' if direction == '<' => {
                    text.push_str("^M\n");
                    self.direction = None;
                }
                b'\r' => {}
                b'\n' => {
                    text.push('\n');
                    self.direction = None;
                }
                0..0x20 => text.extend(['^', (byte + 0x40) as char]),
                0x7f => text.push_str("^?"),
                0x80.. => text.push_str(&format!("\\x{byte:02x}")),
                _ => text.push(byte as char),
            }
        }
        self.out.write_all(text.as_bytes())?;
        self.out.flush()
    }
}

/// A line with a transcript of its traffic.
#[derive(Debug)]
pub struct Recorded<T, W> {
    line: T,
    transcript: Transcript<W>,
}

impl<T: Transport, W: Write> Recorded<T, W> {
    /// Writes the traffic of `line` to `out`: `< ` begins bytes sent, `> ` bytes received, control
    /// characters as `^C`.
    pub fn new(line: T, out: W) -> Self {
        Self {
            line,
            transcript: Transcript::new(out),
        }
    }
}

impl<T: Transport, W: Write> Transport for Recorded<T, W> {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.line.send(bytes)?;
        self.transcript.sent(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<Option<usize>> {
        let count = self.line.receive(buffer, timeout)?;
        self.transcript.received(&buffer[..count.unwrap_or(0)])?;
        Ok(count)
    }

    fn clock(&self) -> Duration {
        self.line.clock()
    }

    fn name(&self) -> &str {
        self.line.name()
    }
}
