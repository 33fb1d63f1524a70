//! Compares all controllers on the same balls in the same cells with errors: the paper's learned
//! behaviours, its alternatives, and the hybrid.
//!
//! ```text
//! cargo run --release --example compare_controllers -- --help
//! ```

use example_support::compare_controllers::run;
use example_support::prelude::*;

fn main() -> ExitCode {
    start(run)
}
