//! Start, output and end of the programs.

use std::error::Error;
pub use std::process::ExitCode;
use std::sync::Mutex;
use std::thread;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Result of a program or a part of it.
pub type Outcome<T = ()> = Result<T, Box<dyn Error>>;

/// Returns the exit code of a program, after printing the error if there is one.
#[allow(clippy::print_stderr, reason = "the error of a program")]
pub fn ended(done: Outcome) -> ExitCode {
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
pub fn at_least_one(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(0) => Err("at least one is needed".into()),
        Ok(count) => Ok(count),
        Err(error) => Err(error.to_string()),
    }
}

/// Returns a bar that counts `length` of `unit` on the terminal, if there is one.
pub fn progress_bar(length: u64, unit: &str, quiet: bool) -> ProgressBar {
    let target = if quiet {
        ProgressDrawTarget::hidden()
    } else {
        ProgressDrawTarget::stderr()
    };
    let style =
        ProgressStyle::with_template("  {bar:40} {pos}/{len} {msg}  {elapsed} ({eta} left)")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::with_draw_target(Some(length), target)
        .with_style(style)
        .with_message(unit.to_owned())
}

/// Returns the results of `work` for each of `0..count`, in order, computed on all processor cores.
///
/// # Errors
/// The first error that occurred. Work begun by then is finished, no other is begun.
pub fn on_all_cores<T: Send>(
    count: usize,
    work: impl Fn(usize) -> Outcome<T> + Sync,
) -> Outcome<Vec<T>> {
    let (todo, done) = (Mutex::new(0..count), Mutex::new((Vec::new(), None)));
    let next = || todo.lock().ok()?.next();
    let worker = || {
        while let Some(index) = next() {
            let result = work(index).map_err(|error| error.to_string());
            let Ok(mut done) = done.lock() else { return };
            match result {
                Ok(result) => done.0.push((index, result)),
                Err(error) => {
                    done.1.get_or_insert(error);
                }
            }
            if done.1.is_some() {
                return;
            }
        }
    };
    let cores = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        for _ in 0..cores.min(count) {
            scope.spawn(worker);
        }
    });
    let (mut results, error) = done.into_inner().map_err(|error| error.to_string())?;
    if let Some(error) = error {
        return Err(error.into());
    }
    results.sort_by_key(|(index, _)| *index);
    Ok(results.into_iter().map(|(_, result)| result).collect())
}
