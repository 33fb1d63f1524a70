//! The line of the program to its controller.

use std::cell::Cell;
use std::fs::File;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use signal_hook::consts::{SIGINT, SIGTERM};

use crate::client::{ClientConfig, MoveWay, Val2Client};
use crate::emulator::profile::Profile;
use crate::kinematics::params::PumaParams;
use crate::program::failure::Failure;
use crate::program::{Command, Globals, commands, term};
use crate::transport::{Recorded, SerialLine, TcpLine, Transport};

/// What is said where a stop cannot reach the controller.
const UNHEARD: &str = "the arm may be moving: press the emergency stop on the panel";
const INTERRUPTED: &str = "interrupted by a signal";

/// A line that a signal interrupts: it fails once, so that what has been begun can still be cleared
/// away.
pub(super) struct Link {
    line: Box<dyn Transport>,
    interrupted: Arc<AtomicBool>,
    /// A person is asked: signals end the program at once.
    asking: Arc<AtomicBool>,
    failed: Cell<bool>,
}

impl Link {
    /// Returns `true` if a signal has come.
    #[cfg(unix)]
    pub(super) fn is_interrupted(&self) -> bool {
        self.interrupted.load(Ordering::Acquire) || self.failed.get()
    }

    /// Carries out a call that asks a person. No reply of the controller is awaited in it.
    pub(super) fn asking<R>(&self, ask: impl FnOnce() -> R) -> R {
        self.asking.store(true, Ordering::Release);
        let answer = ask();
        self.asking.store(false, Ordering::Release);
        answer
    }

    /// Returns `true` once for each signal.
    pub(super) fn take_interrupt(&self) -> bool {
        self.interrupted.swap(false, Ordering::AcqRel) | self.failed.replace(false)
    }
}

impl Transport for Link {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.line.send(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<Option<usize>> {
        let until = self.clock().saturating_add(timeout);
        loop {
            if self.interrupted.swap(false, Ordering::AcqRel) {
                self.failed.set(true);
                return Err(io::Error::other(INTERRUPTED));
            }
            let left = until.saturating_sub(self.clock());
            let slice = left.min(Duration::from_millis(50));
            match self.line.receive(buffer, slice)? {
                None if slice < left => {}
                outcome => return Ok(outcome),
            }
        }
    }

    fn clock(&self) -> Duration {
        self.line.clock()
    }

    fn name(&self) -> &str {
        self.line.name()
    }
}

/// Opens the line and carries out a command on it.
pub(super) fn with_line(globals: &Globals, command: &Command) -> Result<(), Failure> {
    commands::check(globals, command)?;
    let config = config(globals)?;
    let mut link = open(globals).map_err(|failure| match command {
        Command::Stop => Failure {
            text: format!("{}; {UNHEARD}", failure.text),
            code: 6,
        },
        _ => failure,
    })?;
    let interrupted = |signal| {
        #[cfg(unix)]
        signal_hook::flag::register_conditional_default(signal, Arc::clone(&link.asking))?;
        signal_hook::flag::register(signal, Arc::clone(&link.interrupted))
    };
    interrupted(SIGINT)?;
    // A terminal ends by the others at once; a Ctrl-C there is for the controller.
    if !matches!(command, Command::Term) {
        interrupted(SIGTERM)?;
        #[cfg(unix)]
        interrupted(signal_hook::consts::SIGQUIT)?;
        #[cfg(unix)]
        if !ignores_hangup() {
            interrupted(signal_hook::consts::SIGHUP)?;
        }
    }
    let outcome = match command {
        Command::Stop => {
            Val2Client::stop_on(&mut link, config.clone())?;
            commands::done(globals, "stopped")
        }
        Command::Term => term::run(&mut link, &config),
        _ => commands::run(globals, command, &mut link, config.clone()),
    };
    if outcome.is_ok() || !link.take_interrupt() {
        return outcome;
    }
    let mut text = INTERRUPTED.to_owned();
    if command.moves() {
        match Val2Client::stop_on(&mut link, config) {
            Ok(()) => text.push_str("; the arm has been stopped"),
            Err(error) => text = format!("{text}; {error}"),
        }
    }
    Err(Failure { text, code: 130 })
}

/// Returns `true` if the program was started to outlive its terminal, as by `nohup`.
#[cfg(unix)]
fn ignores_hangup() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    ignored.is_some_and(|mask| mask & 1 != 0)
}

fn config(globals: &Globals) -> Result<ClientConfig, Failure> {
    let name = globals.profile.as_deref().unwrap_or("val2");
    let profile = Profile::named(name).ok_or_else(|| {
        let names = Profile::all().map(|p| p.name).join(", ");
        Failure::usage(format!("no profile `{name}`: there are {names}"))
    })?;
    let usual = ClientConfig::for_baud(globals.baud.unwrap_or(9600));
    let arm = globals.arm.as_deref().unwrap_or("560");
    Ok(ClientConfig {
        params: PumaParams::numbered(arm).unwrap_or_else(PumaParams::unimation),
        // Half of what a program of its own may wait.
        connect_timeout: usual.connect_timeout / 2,
        control_characters: profile.control_characters,
        way: if profile.ppoint {
            MoveWay::Automatic
        } else {
            MoveWay::Point
        },
        ..usual
    })
}

fn open(globals: &Globals) -> Result<Link, Failure> {
    let variable = std::env::var("VAL2_PORT")
        .ok()
        .filter(|port| !port.is_empty());
    let mut line: Box<dyn Transport> =
        match (&globals.tcp, globals.port.as_ref().or(variable.as_ref())) {
            (Some(address), _) => Box::new(TcpLine::connect(address, Duration::from_secs(5))?),
            (None, Some(port)) => Box::new(SerialLine::open(port, globals.baud.unwrap_or(9600))?),
            (None, None) => {
                return Err(Failure::usage(
                    "which controller? --port DEV names a serial port, --tcp HOST:PORT an address",
                ));
            }
        };
    if let Some(path) = &globals.transcript {
        let file = File::create(path).map_err(|error| Failure {
            text: format!("{}: {error}", path.display()),
            code: 1,
        })?;
        line = Box::new(Recorded::new(line, file));
    }
    Ok(Link {
        line,
        interrupted: Arc::default(),
        asking: Arc::default(),
        failed: Cell::new(false),
    })
}
