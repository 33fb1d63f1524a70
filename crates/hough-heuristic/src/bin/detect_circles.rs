//! Finds circles in image files.

use std::process::ExitCode;

fn main() -> ExitCode {
    hough_heuristic::program::run(std::env::args_os())
}
