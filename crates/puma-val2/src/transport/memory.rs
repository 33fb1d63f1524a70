//! A line in memory.

use std::io;
use std::time::Duration;

use crate::emulator::controller::Emulator;
use crate::transport::Transport;

/// An emulated controller as a line, without thread or clock. Time passes only while the other side
/// waits, and then as fast as the machine.
#[derive(Debug)]
pub struct MemoryLine {
    emulator: Emulator,
    now: Duration,
    coming: Vec<u8>,
    sent: u64,
    received: u64,
}

impl MemoryLine {
    /// Creates a line to `emulator`.
    pub fn new(emulator: Emulator) -> Self {
        let now = emulator.now();
        Self {
            emulator,
            now,
            coming: Vec::new(),
            sent: 0,
            received: 0,
        }
    }

    /// Returns the controller at the other end.
    pub fn emulator(&self) -> &Emulator {
        &self.emulator
    }

    /// Returns the controller at the other end, to press its buttons.
    pub fn emulator_mut(&mut self) -> &mut Emulator {
        &mut self.emulator
    }

    /// Returns the numbers of bytes sent to the controller and received from it.
    pub fn traffic(&self) -> (u64, u64) {
        (self.sent, self.received)
    }
}

impl Transport for MemoryLine {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.sent += bytes.len() as u64;
        let said = self.emulator.feed(bytes, self.now);
        self.coming.extend(said);
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<Option<usize>> {
        let until = self.now.saturating_add(timeout);
        self.coming.extend(self.emulator.poll(self.now));
        while self.coming.is_empty() {
            match self.emulator.next_deadline() {
                Some(at) if at <= until => self.now = self.now.max(at),
                _ => {
                    self.now = until;
                    self.coming.extend(self.emulator.poll(until));
                    break;
                }
            }
            self.coming.extend(self.emulator.poll(self.now));
        }
        let count = self.coming.len().min(buffer.len());
        buffer[..count].copy_from_slice(&self.coming[..count]);
        self.coming.drain(..count);
        self.received += count as u64;
        Ok((count > 0).then_some(count))
    }

    fn clock(&self) -> Duration {
        self.now
    }

    fn name(&self) -> &str {
        "memory"
    }
}
