//! The subcommand `emulate` of the program `val2`: a PUMA 560 controller to talk to with any
//! terminal program.
//!
//! ```text
//! cargo run --example val2_emulator -- --link /tmp/puma
//! screen /tmp/puma 9600
//! ```

use std::ffi::OsString;
use std::process::ExitCode;

fn main() -> ExitCode {
    let words = ["val2", "emulate"].map(OsString::from);
    puma_val2::val2(words.into_iter().chain(std::env::args_os().skip(1)))
}
