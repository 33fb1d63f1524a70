//! Lines to a controller.

mod memory;
#[cfg(feature = "serial")]
mod serial;
mod tcp;
mod transcript;

use std::io;
use std::ops::DerefMut;
use std::time::Duration;

pub use memory::MemoryLine;
#[cfg(feature = "serial")]
pub use serial::SerialLine;
pub use tcp::TcpLine;
pub use transcript::Recorded;
pub(crate) use transcript::Transcript;

/// A line to a controller: bytes out, bytes in within a time, and a clock.
pub trait Transport {
    /// Sends all of `bytes`.
    ///
    /// # Errors
    /// The line is closed or broken.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Waits until bytes come and puts them at the start of `buffer`: `Some(count)` with at least
    /// one byte, or `None` if nothing came within `timeout`. A timeout of zero takes only what is
    /// already there.
    ///
    /// # Errors
    /// The line is closed or broken; its end is [`io::ErrorKind::UnexpectedEof`].
    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<Option<usize>>;

    /// Returns the time by this line's clock, since any fixed origin. It never runs backwards.
    fn clock(&self) -> Duration;

    /// Returns the name of the line for messages: a device path, an address.
    fn name(&self) -> &str;
}

impl<P: DerefMut<Target: Transport>> Transport for P {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        (**self).send(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<Option<usize>> {
        (**self).receive(buffer, timeout)
    }

    fn clock(&self) -> Duration {
        (**self).clock()
    }

    fn name(&self) -> &str {
        (**self).name()
    }
}

/// Turns the result of a read into bytes, nothing, or the end of the line.
fn received(outcome: io::Result<usize>) -> io::Result<Option<usize>> {
    match outcome {
        Ok(0) => Err(io::Error::new(
            io::ErrorKind::UnexpectedEof,
            "the other side closed the line",
        )),
        Ok(count) => Ok(Some(count)),
        Err(error) => match error.kind() {
            io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted => {
                Ok(None)
            }
            _ => Err(error),
        },
    }
}
