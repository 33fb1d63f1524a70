//! A serial port as a line.

use std::io;
use std::time::{Duration, Instant};

use serial2::{CharSize, FlowControl, Parity, SerialPort, Settings, StopBits};

use crate::error::ArmError;
use crate::transport::{Transport, received};

/// A serial port, or a pseudo-terminal opened as one: 8 data bits, no parity, 1 stop bit, no flow
/// control.
///
/// On Unix the port is locked until this is dropped: another program that asks for the lock is
/// refused.
#[derive(Debug)]
pub struct SerialLine {
    port: SerialPort,
    name: String,
    opened: Instant,
}

impl SerialLine {
    /// Opens the port at `path`: `/dev/ttyUSB0`, `COM3`, or the path of an emulator's
    /// pseudo-terminal. PUMA controllers speak 9600 baud.
    ///
    /// # Errors
    /// [`ArmError::Open`]: no such port, no permission, or another program holds it.
    pub fn open(path: &str, baud: u32) -> Result<Self, ArmError> {
        let port = open(path, baud).map_err(|source| ArmError::Open {
            port: path.to_owned(),
            source,
        })?;
        // A real adapter signals that a terminal is there. A pseudo-terminal has no such wires and
        // says so.
        let _ = port.set_dtr(true);
        let _ = port.set_rts(true);
        Ok(Self {
            port,
            name: path.to_owned(),
            opened: Instant::now(),
        })
    }
}

#[cfg(unix)]
impl Drop for SerialLine {
    fn drop(&mut self) {
        // A pseudo-terminal stays open at the emulator, and the mode of exclusive use with it.
        let _ = rustix::termios::ioctl_tiocnxcl(&self.port);
    }
}

#[cfg(unix)]
fn open(path: &str, baud: u32) -> io::Result<SerialPort> {
    use rustix::fs::{FlockOperation, Mode, OFlags, flock};
    use rustix::termios::{ioctl_tiocexcl, isatty};

    let in_use = |_| {
        let who = holder(path).unwrap_or_else(|| "another program".to_owned());
        let why = format!("{who} holds the port: end that program first");
        io::Error::new(io::ErrorKind::ResourceBusy, why)
    };
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let file = match rustix::fs::open(path, flags, Mode::empty()) {
        Err(rustix::io::Errno::BUSY) => return Err(in_use(rustix::io::Errno::BUSY)),
        other => other?,
    };
    if !isatty(&file) {
        let why = "this is no serial port";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, why));
    }
    flock(&file, FlockOperation::NonBlockingLockExclusive).map_err(in_use)?;
    ioctl_tiocexcl(&file)?;
    let mut port = SerialPort::from(file);
    let mut settings = port.get_configuration()?;
    configure(&mut settings, baud)?;
    port.set_configuration(&settings)?;
    Ok(port)
}

/// Returns the name and number of the process that has locked a file, where Linux tells.
#[cfg(unix)]
fn holder(path: &str) -> Option<String> {
    use std::os::unix::fs::MetadataExt;

    let file = format!(":{}", std::fs::metadata(path).ok()?.ino());
    let locks = std::fs::read_to_string("/proc/locks").ok()?;
    // `1: FLOCK ADVISORY WRITE 1234 00:18:5 0 EOF`
    let of_file = |words: &Vec<&str>| words.get(1) == Some(&"FLOCK") && words[5].ends_with(&file);
    let lines = locks.lines().map(|line| line.split_whitespace().collect());
    let process = lines.filter(|w: &Vec<&str>| w.len() > 5).find(of_file)?[4];
    let name = std::fs::read_to_string(format!("/proc/{process}/comm")).ok()?;
    Some(format!("`{}` (process {process})", name.trim()))
}

#[cfg(not(unix))]
fn open(path: &str, baud: u32) -> io::Result<SerialPort> {
    SerialPort::open(path, |mut settings: Settings| {
        configure(&mut settings, baud)?;
        Ok(settings)
    })
}

fn configure(settings: &mut Settings, baud: u32) -> io::Result<()> {
    settings.set_raw();
    settings.set_baud_rate(baud)?;
    settings.set_char_size(CharSize::Bits8);
    settings.set_parity(Parity::None);
    settings.set_stop_bits(StopBits::One);
    settings.set_flow_control(FlowControl::None);
    Ok(())
}

impl Transport for SerialLine {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        // A line that takes no byte for this long is broken.
        self.port.set_write_timeout(Duration::from_secs(2))?;
        let mut rest = bytes;
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
        // The port counts whole milliseconds.
        let wait = timeout.saturating_add(Duration::from_nanos(999_999));
        self.port
            .set_read_timeout(wait.min(Duration::from_secs(3600)))?;
        received(self.port.read(buffer))
    }

    fn clock(&self) -> Duration {
        self.opened.elapsed()
    }

    fn name(&self) -> &str {
        &self.name
    }
}
