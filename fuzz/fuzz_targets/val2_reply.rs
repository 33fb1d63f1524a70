//! Any text as a controller's reply to `WHERE`.
#![no_main]

use libfuzzer_sys::fuzz_target;

#[path = "../../crates/puma-val2/tests/it/fuzz_targets.rs"]
mod targets;

fuzz_target!(|data: &[u8]| targets::run("val2_reply", data));
