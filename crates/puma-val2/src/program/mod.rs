//! The program `val2`.
#![allow(clippy::print_stdout, clippy::print_stderr)] // Output of a program.

mod emulate;
mod files;
mod floppy;

use std::error::Error;
use std::ffi::OsString;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Drives PUMA robots with a VAL II controller, and emulates one.
#[derive(Debug, Parser)]
#[command(name = "val2", version)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Emulate a VAL II controller with a PUMA 560, for any terminal program.
    ///
    /// The first line printed is `listening on PATH`. Lines typed here are the controller's panel:
    /// `power on`, `power off`, `signal 1001 on`, `joints`, `restart`, `quit`.
    Emulate(emulate::Options),
}

/// Runs the program `val2` with these arguments, of which the first is its name.
pub fn val2(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let arguments = match Arguments::try_parse_from(arguments) {
        Ok(arguments) => arguments,
        Err(error) => {
            let _ = error.print();
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
        }
    };
    match carry_out(&arguments.command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn carry_out(command: &Command) -> Result<(), Box<dyn Error>> {
    match command {
        Command::Emulate(options) => emulate::run(options),
    }
}
