//! A command-line tool for PUMA robots with a VAL II controller.

use std::process::ExitCode;

fn main() -> ExitCode {
    puma_val2::val2(std::env::args_os())
}
