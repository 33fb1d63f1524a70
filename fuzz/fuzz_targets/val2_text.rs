//! Any text as stored programs, locations and variables.
#![no_main]

use libfuzzer_sys::fuzz_target;
use puma_val2::{Emulator, Profile, PumaParams};

fuzz_target!(|text: &str| {
    let mut emulator = Emulator::new(PumaParams::unimation(), Profile::val2());
    if emulator.load_text(text).is_ok() {
        let stored = emulator.text();
        emulator
            .load_text(&stored)
            .expect("what was written is read");
    }
});
