//! Jogging by keys: the arm moves while a key is held.

use crate::program::commands::{Client, turn};
use crate::program::failure::Failure;

/// Moves the arm as keys say until `q`.
///
/// A key that is held is repeated by the terminal. Each step is short, and keys that come during
/// it are forgotten: the arm stands within one step of the key's release.
#[cfg(unix)]
pub(super) fn jog(client: &mut Client<'_>) -> Result<(), Failure> {
    use crate::joints::Joint;
    use std::io::{self, IsTerminal, Write};

    if !io::stdin().is_terminal() {
        return Err(Failure::usage(
            "jogging by keys needs a terminal: `jog JOINT DEGREES` does not",
        ));
    }
    let keyboard = Keyboard::raw()?;
    let (mut joint, mut step) = (Joint::J1, 1.0_f64);
    let mut out = io::stdout();
    writeln!(out, "1-6 joint, hold + or - to move, [ ] step, q ends\r")?;
    let mut stands = client.where_()?.joints;
    loop {
        write!(out, "{joint}  step {step} degrees  {stands}   \r")?;
        out.flush()?;
        let key = keyboard.key()?;
        if client.line().is_interrupted() {
            // The caller stops the arm.
            return Err(Failure::usage("interrupted"));
        }
        let Some(key) = key else { continue };
        let sign = match key {
            digit @ b'1'..=b'6' => {
                joint = Joint::ALL[usize::from(digit - b'1')];
                continue;
            }
            b'[' => {
                step = (step / 2.0).max(0.125);
                continue;
            }
            b']' => {
                step = (step * 2.0).min(4.0);
                continue;
            }
            b'+' | b'=' => 1.0,
            b'-' | b'_' => -1.0,
            b'q' | 0x03 | 0x04 => break,
            _ => continue,
        };
        match turn(client, joint, sign * step) {
            Ok(joints) => stands = joints,
            Err(_) if client.line().is_interrupted() => {}
            Err(error) => writeln!(out, "\r\n{error}\r")?,
        }
        keyboard.forget()?;
    }
    Ok(writeln!(out, "\r")?)
}

#[cfg(not(unix))]
pub(super) fn jog(_: &mut Client<'_>) -> Result<(), Failure> {
    let text = "jogging by keys is only there on Unix: use `jog JOINT DEGREES`";
    Err(Failure::usage(text))
}

/// The keyboard without line editing, as it was again when this is dropped.
#[cfg(unix)]
struct Keyboard(rustix::termios::Termios);

#[cfg(unix)]
impl Keyboard {
    fn raw() -> Result<Self, Failure> {
        use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

        let stdin = std::io::stdin();
        let before = tcgetattr(&stdin).map_err(std::io::Error::from)?;
        let mut raw = before.clone();
        raw.make_raw();
        tcsetattr(&stdin, OptionalActions::Now, &raw).map_err(std::io::Error::from)?;
        Ok(Self(before))
    }

    /// Forgets the keys that have come.
    fn forget(&self) -> Result<(), Failure> {
        use rustix::termios::{QueueSelector, tcflush};

        let flushed = tcflush(std::io::stdin(), QueueSelector::IFlush);
        Ok(flushed.map_err(std::io::Error::from)?)
    }

    /// Waits for a key, a tenth of a second at most. Of several only the last counts.
    fn key(&self) -> Result<Option<u8>, Failure> {
        use rustix::event::{PollFd, PollFlags, Timespec, poll};

        let stdin = std::io::stdin();
        let wait = Timespec {
            tv_sec: 0,
            tv_nsec: 100_000_000,
        };
        match poll(&mut [PollFd::new(&stdin, PollFlags::IN)], Some(&wait)) {
            Ok(0) | Err(rustix::io::Errno::INTR) => return Ok(None),
            ready => ready.map_err(std::io::Error::from)?,
        };
        let mut keys = [0; 256];
        let count = rustix::io::read(&stdin, &mut keys).map_err(std::io::Error::from)?;
        Ok(Some(if count == 0 { b'q' } else { keys[count - 1] }))
    }
}

#[cfg(unix)]
impl Drop for Keyboard {
    fn drop(&mut self) {
        use rustix::termios::{OptionalActions, tcsetattr};

        let _ = tcsetattr(std::io::stdin(), OptionalActions::Now, &self.0);
    }
}
