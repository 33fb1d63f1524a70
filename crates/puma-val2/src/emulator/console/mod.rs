//! The operator's end of the emulated controller: terminal, monitor, editor, floppy disk.

pub(crate) mod dialogue;
mod display;
mod editor;
pub(crate) mod files;
mod listing;
pub(crate) mod mode;
mod monitor;
mod output;
pub(crate) mod terminal;
