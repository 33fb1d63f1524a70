//! Output, exit codes and counts of the programs.

use std::error::Error;
use std::fmt;
use std::process::ExitCode;
use std::str::FromStr;

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

/// Prints a formatted line. A closed pipe does not end the program.
#[macro_export]
macro_rules! say {
    ($($words:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stdout(), $($words)*);
    }};
}

/// Parses a count of at least one, for the command line.
///
/// # Errors
/// Text that is no such count.
pub fn at_least_one<N>(text: &str) -> Result<N, String>
where
    N: FromStr<Err: fmt::Display> + PartialEq + Default,
{
    match text.parse() {
        Ok(count) if count == N::default() => Err("at least one is needed".into()),
        Ok(count) => Ok(count),
        Err(error) => Err(error.to_string()),
    }
}
