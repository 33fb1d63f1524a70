//! A command-line tool for PUMA robots with a VAL II controller.

use std::process::ExitCode;

fn main() -> ExitCode {
    puma_val2::program::run(std::env::args_os())
}
