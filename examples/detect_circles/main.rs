//! Finds circles in image files: the program `detect_circles` of the crate `hough-heuristic`.
//!
//! ```text
//! cargo run --release --example detect_circles -- --csv - --overlay out/circles photo.jpg folder/
//! ```

use std::process::ExitCode;

fn main() -> ExitCode {
    hough_heuristic::run_detect_circles(std::env::args_os())
}
