//! Any text as stored programs, locations and variables.
#![no_main]

use libfuzzer_sys::fuzz_target;

#[path = "../../crates/puma-val2/tests/it/fuzz_targets.rs"]
mod targets;

fuzz_target!(|data: &[u8]| targets::run("val2_text", data));
