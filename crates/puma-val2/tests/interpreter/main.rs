//! Every instruction and function, in stored programs and through `DO`.
#![allow(clippy::unwrap_used, clippy::panic)] // Functions that serve tests may fail as tests do.

#[path = "../console/mod.rs"]
mod console;
mod motions;
mod programs;
mod reactions;
mod texts;
