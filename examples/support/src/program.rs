//! Output, exit codes and counts of the programs.

use std::error::Error;
use std::io::Write as _;
use std::process::ExitCode;

/// Returns the exit code of a program, after printing the error if there is one.
#[allow(clippy::print_stderr, reason = "the error of a program")]
pub fn ended(done: Result<(), Box<dyn Error>>) -> ExitCode {
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Prints a line. A reader that has gone away is no reason to stop.
pub fn say(words: &str) {
    let _ = writeln!(std::io::stdout(), "{words}");
}

/// Parses a count of at least one, for the command line.
///
/// # Errors
/// Text that is no such count.
pub fn at_least_one(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(0) => Err("at least one is needed".into()),
        Ok(count) => Ok(count),
        Err(error) => Err(format!("{error}")),
    }
}
