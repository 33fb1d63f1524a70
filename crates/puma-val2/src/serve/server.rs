//! The thread that serves an emulated controller, as its owner sees it.

use std::io;
use std::net::ToSocketAddrs;
use std::thread::JoinHandle;

use crate::emulator::controller::Emulator;
use crate::serve::config::ServeConfig;
#[cfg(unix)]
use crate::serve::pty;
use crate::serve::station::Station;
use crate::serve::tcp;

/// An emulated controller on a pseudo-terminal or a TCP socket, served by a thread of its own until
/// this is dropped.
#[derive(Debug)]
pub struct EmulatorServer {
    station: Station,
    address: String,
    closing: Closing,
    thread: Option<JoinHandle<()>>,
}

/// Means of ending the thread.
#[derive(Debug)]
enum Closing {
    #[cfg(unix)]
    Pty(pty::Closing),
    Tcp(tcp::Closing),
}

impl EmulatorServer {
    /// Serves `emulator` on a new pseudo-terminal. Any program that opens its path as a serial port
    /// can talk to it, close it and open it again.
    ///
    /// # Errors
    /// The system has no pseudo-terminal to spare, or the link cannot be made.
    #[cfg(unix)]
    pub fn pty(emulator: Emulator, config: ServeConfig) -> io::Result<Self> {
        let link = config.link.clone();
        let station = Station::new(emulator, config.realtime, config.transcript);
        let (path, closing, thread) = pty::spawn(&station, link)?;
        Ok(Self {
            station,
            address: path.display().to_string(),
            closing: Closing::Pty(closing),
            thread: Some(thread),
        })
    }

    /// Serves `emulator` at `addr`, one terminal at a time. The next terminal finds the controller
    /// in the state that the last one left. `127.0.0.1:0` takes any free port of this machine
    /// alone; `config.link` has no effect.
    ///
    /// # Errors
    /// The address cannot be listened at.
    pub fn tcp(
        addr: impl ToSocketAddrs,
        emulator: Emulator,
        config: ServeConfig,
    ) -> io::Result<Self> {
        let station = Station::new(emulator, config.realtime, config.transcript);
        let (address, closing, thread) = tcp::spawn(addr, &station)?;
        Ok(Self {
            station,
            address: address.to_string(),
            closing: Closing::Tcp(closing),
            thread: Some(thread),
        })
    }

    /// Returns the path to open as a serial port (`/dev/pts/3`), or the address to connect to.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// Looks at or changes the emulator: its arm, its signals, its events.
    pub fn with_emulator<R>(&self, f: impl FnOnce(&mut Emulator) -> R) -> R {
        let result = self.station.with(f);
        match &self.closing {
            #[cfg(unix)]
            Closing::Pty(closing) => closing.wake(),
            Closing::Tcp(_) => {}
        }
        result
    }
}

impl Drop for EmulatorServer {
    fn drop(&mut self) {
        match &self.closing {
            #[cfg(unix)]
            Closing::Pty(closing) => closing.end(),
            Closing::Tcp(closing) => closing.end(),
        }
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
