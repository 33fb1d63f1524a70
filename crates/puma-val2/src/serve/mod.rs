//! Emulated controllers served on pseudo-terminals and sockets.

mod config;
#[cfg(unix)]
mod pty;
mod server;
mod station;
mod tcp;

pub use config::ServeConfig;
pub use server::EmulatorServer;
