//! A TCP connection as a line.

use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};

use crate::error::ArmError;
use crate::transport::{Transport, received};

/// A TCP connection to a controller, or to a terminal server with a controller behind it.
#[derive(Debug)]
pub struct TcpLine {
    stream: TcpStream,
    name: String,
    opened: Instant,
}

impl TcpLine {
    /// Connects to `addr` (`host:port`). Each address of the name is tried for up to `timeout`.
    ///
    /// # Errors
    /// [`ArmError::Open`].
    pub fn connect(addr: &str, timeout: Duration) -> Result<Self, ArmError> {
        let fail = |source| ArmError::Open {
            port: addr.to_owned(),
            source,
        };
        let mut last = io::Error::new(io::ErrorKind::NotFound, "the name stands for no address");
        for address in addr.to_socket_addrs().map_err(fail)? {
            match TcpStream::connect_timeout(&address, timeout.max(Duration::from_millis(1))) {
                Ok(stream) => {
                    stream.set_nodelay(true).map_err(fail)?;
                    // A line that takes no byte for this long is not one any more.
                    stream
                        .set_write_timeout(Some(Duration::from_secs(2)))
                        .map_err(fail)?;
                    return Ok(Self {
                        stream,
                        name: addr.to_owned(),
                        opened: Instant::now(),
                    });
                }
                Err(error) => last = error,
            }
        }
        Err(fail(last))
    }
}

impl Transport for TcpLine {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.stream.set_nonblocking(false)?;
        self.stream.write_all(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<Option<usize>> {
        self.stream.set_nonblocking(timeout.is_zero())?;
        if !timeout.is_zero() {
            self.stream.set_read_timeout(Some(timeout))?;
        }
        received(self.stream.read(buffer))
    }

    fn clock(&self) -> Duration {
        self.opened.elapsed()
    }

    fn name(&self) -> &str {
        &self.name
    }
}
