//! The emulated controller: a VAL II monitor, its programs and its arm, without threads and without
//! a clock of its own.

mod console;
pub(crate) mod controller;
mod language;
mod machine;
pub(crate) mod message;
pub(crate) mod profile;

pub use console::files::TextError;
pub use controller::{Emulator, Event};
pub use language::place::Place;
pub use message::{Fault, Message};
pub use profile::Profile;
