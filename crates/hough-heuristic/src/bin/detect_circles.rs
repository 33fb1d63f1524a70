//! Finds circles in image files.

use std::process::ExitCode;

fn main() -> ExitCode {
    hough_heuristic::run_detect_circles(std::env::args_os())
}
