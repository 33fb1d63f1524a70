//! Tests of the whole chain and of the example programs.

#![allow(clippy::print_stdout, reason = "figures and notes of skipped tests")]

mod command_line;
mod emulator_floppy;
mod end_to_end;
mod exported_policy;
mod faults;
mod guard;
mod literal_reward;
mod taught_goal;
