//! Settings of a server.

use std::fmt;
use std::io::Write;
use std::path::PathBuf;

/// Settings of an [`EmulatorServer`](super::EmulatorServer).
#[derive(Default)]
pub struct ServeConfig {
    /// Runs the emulator in real time (default: no). Otherwise its clock jumps ahead whenever it
    /// waits for nothing but time, and a session runs as fast as the machine; a program that never
    /// waits for the terminal then keeps a processor busy.
    pub realtime: bool,
    /// Symbolic link to the pseudo-terminal, for a path that stays the same (default: none). A link
    /// that exists is replaced; anything else at its place is an error.
    pub link: Option<PathBuf>,
    /// Receiver of a transcript (default: none). Lines that begin with `< ` came from the terminal,
    /// those with `> ` went to it.
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
