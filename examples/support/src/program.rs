//! How a program ends.

use std::error::Error;
use std::process::ExitCode;

/// The exit code of a program that has done its work, or could not and says why.
pub fn ended(done: Result<(), Box<dyn Error>>) -> ExitCode {
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
