//! An emulated controller served on a pseudo-terminal or a socket.

#[cfg(unix)]
mod pty;
mod station;
mod tcp;

#[cfg(unix)]
pub use pty::PtyServer;
pub use tcp::TcpServer;

use std::fmt;
use std::io::Write;
use std::path::PathBuf;

/// How an emulator is served.
#[derive(Default)]
pub struct ServeConfig {
    /// Whether the emulator's time is that of the clock on the wall (default: no). Otherwise its
    /// clock jumps ahead whenever it waits for nothing but time, and a session runs as fast as the
    /// machine; a program that never waits for the terminal keeps a processor busy then.
    pub realtime: bool,
    /// A symbolic link to make to the pseudo-terminal, for a path that stays the same (default:
    /// none). One that exists is replaced, anything else there is an error.
    pub link: Option<PathBuf>,
    /// Where to write what passes on the line (default: nowhere): lines that begin with `< ` for
    /// what the terminal sent and `> ` for what it got.
    pub transcript: Option<Box<dyn Write + Send>>,
}

impl fmt::Debug for ServeConfig {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ServeConfig")
            .field("realtime", &self.realtime)
            .field("link", &self.link)
            .field("transcript", &self.transcript.is_some())
            .finish()
    }
}
