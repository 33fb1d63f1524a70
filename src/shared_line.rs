//! A line in memory whose controller can be looked at while a client talks to it.

use std::io;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use puma_val2::{Emulator, MemoryLine, Transport};

/// A line in memory. Clones are the same line.
#[derive(Clone, Debug)]
pub(crate) struct SharedLine(Arc<Mutex<MemoryLine>>);

impl SharedLine {
    pub(crate) fn new(emulator: Emulator) -> Self {
        Self(Arc::new(Mutex::new(MemoryLine::new(emulator))))
    }

    /// Looks at the controller.
    pub(crate) fn with_emulator<T>(&self, look: impl FnOnce(&Emulator) -> T) -> T {
        look(self.line().emulator())
    }

    fn line(&self) -> MutexGuard<'_, MemoryLine> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Transport for SharedLine {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.line().send(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<Option<usize>> {
        self.line().receive(buffer, timeout)
    }

    fn clock(&self) -> Duration {
        self.line().clock()
    }

    fn name(&self) -> &str {
        "memory"
    }
}
