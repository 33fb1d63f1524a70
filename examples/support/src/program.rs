//! Start, output and end of the programs.

use std::error::Error;
use std::io::Write as _;
pub use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock, Mutex};
use std::thread;

use clap::Parser;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

/// Result of a program or a part of it.
pub type Outcome<T = ()> = Result<T, Box<dyn Error>>;

/// Exit code of a program that a signal has stopped.
const STOPPED: u8 = 130;

/// Reason of a run that a signal has stopped.
const BY_SIGNAL: &str = "stopped by a signal";

/// Flag that the first SIGINT (Ctrl-C), SIGTERM or SIGHUP (a terminal that closes) sets.
pub static STOP: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);

/// Runs a program with the options of its command line, and returns its exit code after printing
/// the error if there is one. A first signal sets [`STOP`], a second one ends the program at once.
pub fn start<O: Parser>(run: impl FnOnce(&O) -> Outcome) -> ExitCode {
    let options = O::parse();
    for signal in signals() {
        // Without them a signal ends the program, as it does by default.
        let _ = flag::register_conditional_shutdown(signal, STOPPED.into(), Arc::clone(&STOP));
        let _ = flag::register(signal, Arc::clone(&STOP));
    }
    match run(&options) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let words = error.to_string();
            // A fault may come of the stop, such as an order that did not end.
            let reason = match stopped() && !words.contains(BY_SIGNAL) {
                true => format!("{BY_SIGNAL}: {words}"),
                false => words,
            };
            // The terminal may be gone.
            let _ = writeln!(std::io::stderr(), "error: {reason}");
            ExitCode::from(if stopped() { STOPPED } else { 1 })
        }
    }
}

/// Signals that stop the program. A program that was started to outlive its terminal, as by
/// `nohup`, ignores the last.
fn signals() -> Vec<i32> {
    let mut signals = vec![SIGINT, SIGTERM];
    #[cfg(unix)]
    {
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
        let ignored = ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
        if ignored.is_none_or(|mask| mask & 1 == 0) {
            signals.push(signal_hook::consts::SIGHUP);
        }
    }
    signals
}

/// Returns whether the program is to stop.
pub fn stopped() -> bool {
    STOP.load(Ordering::Relaxed)
}

/// Fails if the program is to stop.
///
/// # Errors
/// A signal.
pub fn go_on() -> Outcome {
    if stopped() {
        return Err(BY_SIGNAL.into());
    }
    Ok(())
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

/// Does `work` for each of `0..count` on a number of threads, by default one for each processor
/// core, and adds the results to `done` in order.
///
/// # Errors
/// The first error that occurred. Work that others have begun by then is finished and added.
pub fn on_threads<T: Send>(
    threads: Option<usize>,
    count: usize,
    done: &mut Vec<T>,
    work: impl Fn(usize) -> Outcome<T> + Sync,
) -> Outcome {
    let (todo, results) = (Mutex::new(0..count), Mutex::new((Vec::new(), None)));
    let next = || todo.lock().ok()?.next();
    let worker = || {
        while let Some(index) = next() {
            let result = go_on().and_then(|()| work(index));
            let Ok(mut results) = results.lock() else {
                return;
            };
            match result {
                Ok(result) => results.0.push((index, result)),
                Err(error) => {
                    results.1.get_or_insert(error.to_string());
                }
            }
            if results.1.is_some() {
                return;
            }
        }
    };
    let cores = || thread::available_parallelism().map_or(1, usize::from);
    let threads = threads.unwrap_or_else(cores);
    thread::scope(|scope| {
        for _ in 0..threads.min(count) {
            scope.spawn(worker);
        }
    });
    let (mut results, error) = results.into_inner().map_err(|error| error.to_string())?;
    results.sort_by_key(|(index, _)| *index);
    done.extend(results.into_iter().map(|(_, result)| result));
    error.map_or(Ok(()), |error| Err(error.into()))
}
