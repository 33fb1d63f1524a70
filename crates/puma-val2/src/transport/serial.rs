//! A serial port as a line.

use std::io;
use std::time::{Duration, Instant};

use serialport::{DataBits, FlowControl, Parity, SerialPort, StopBits};

use crate::error::ArmError;
use crate::transport::{Transport, received};

/// A serial port, or a pseudo-terminal opened as one: 8 data bits, no parity, 1 stop bit, no flow
/// control.
pub struct SerialLine {
    port: Box<dyn SerialPort>,
    name: String,
    opened: Instant,
}

impl std::fmt::Debug for SerialLine {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SerialLine")
            .field("name", &self.name)
            .finish_non_exhaustive()
    }
}

impl SerialLine {
    /// Opens the port at `path` (`/dev/ttyUSB0`, `COM3`, the path of an emulator's
    /// pseudo-terminal); PUMA controllers speak 9600 baud.
    ///
    /// # Errors
    /// [`ArmError::Open`]: no such port, no permission, or another program holds it.
    pub fn open(path: &str, baud: u32) -> Result<Self, ArmError> {
        let mut port = serialport::new(path, baud)
            .data_bits(DataBits::Eight)
            .parity(Parity::None)
            .stop_bits(StopBits::One)
            .flow_control(FlowControl::None)
            .timeout(Duration::from_millis(100))
            .open()
            .map_err(|error| ArmError::Open {
                port: path.to_owned(),
                source: error.into(),
            })?;
        // A real adapter signals that a terminal is there; a pseudo-terminal has no such wires and
        // says so.
        let _ = port.write_data_terminal_ready(true);
        let _ = port.write_request_to_send(true);
        Ok(Self {
            port,
            name: path.to_owned(),
            opened: Instant::now(),
        })
    }
}

impl Transport for SerialLine {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut rest = bytes;
        // A line that takes no byte for this long is not one any more.
        self.port.set_timeout(Duration::from_secs(2))?;
        while !rest.is_empty() {
            match self.port.write(rest) {
                Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
                Ok(count) => rest = &rest[count..],
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<Option<usize>> {
        self.port.set_timeout(timeout)?;
        received(self.port.read(buffer))
    }

    fn clock(&self) -> Duration {
        self.opened.elapsed()
    }

    fn name(&self) -> &str {
        &self.name
    }
}
