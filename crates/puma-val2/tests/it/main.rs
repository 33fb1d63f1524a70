//! Tests of the crate through its public interface.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout)] // Functions that serve tests may fail as tests do.

mod budget;
mod client;
mod client_robustness;
mod console;
mod emulator_robustness;
mod faults;
mod interpreter;
mod oracles;
mod profiles;
#[cfg(all(unix, feature = "serial"))]
mod pty;
#[cfg(unix)]
mod pyserial;
mod session;
mod tcp;
