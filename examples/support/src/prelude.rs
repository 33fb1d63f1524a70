//! Names that nearly every program uses.

pub use crate::files::{Table, keep_run, lock_folder, write_png, write_whole};
pub use crate::program::{ExitCode, Outcome, STOP, at_least_one, go_on, progress_bar, start};
pub use crate::say;
