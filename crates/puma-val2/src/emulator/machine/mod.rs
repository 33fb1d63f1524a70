//! The emulated machine: arm, signals, memory, and the jobs that work on them.

pub(crate) mod arm;
mod call;
mod control;
mod interpreter;
pub(crate) mod job;
pub(crate) mod memory;
mod motion;
mod path;
pub(crate) mod process;
pub(crate) mod reaction;
pub(crate) mod scope;
pub(crate) mod signals;
