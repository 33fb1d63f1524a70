//! The program `compare_controllers` as a function.

use std::iter;
use std::sync::atomic::Ordering;
use std::thread;
use std::time::Duration;

use clap::Parser;
use example_support::compare_controllers::{Options, run};
use example_support::program::STOP;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

/// Time between two checks for signals.
const POLL: Duration = Duration::from_millis(20);

/// Runs the program in this process. A signal for which Python raises an exception stops it as on
/// the command line.
#[pyfunction]
pub fn compare_controllers(py: Python<'_>, arguments: Vec<String>) -> PyResult<()> {
    let name = iter::once("compare_controllers".to_owned());
    let options = match Options::try_parse_from(name.chain(arguments)) {
        Ok(options) => options,
        Err(help) if help.exit_code() == 0 => {
            return help.print().map_err(PyErr::from);
        }
        Err(wrong) => return Err(PyValueError::new_err(wrong.to_string())),
    };
    let program = thread::spawn(move || run(&options).map_err(|error| error.to_string()));
    let mut signal = Ok(());
    while !program.is_finished() {
        py.detach(|| thread::sleep(POLL));
        if signal.is_ok() {
            signal = py.check_signals();
            STOP.store(signal.is_err(), Ordering::Relaxed);
        }
    }
    STOP.store(false, Ordering::Relaxed);
    signal?;
    let ended = program.join();
    ended
        .map_err(|_| PyRuntimeError::new_err("the program panicked"))?
        .map_err(PyRuntimeError::new_err)
}
