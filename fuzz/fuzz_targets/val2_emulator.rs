//! Any bytes typed to an emulated controller that is past its start-up and calibrated.
#![no_main]

use std::time::Duration;

use libfuzzer_sys::fuzz_target;
use puma_val2::{Emulator, Profile, PumaParams};

fuzz_target!(|data: &[u8]| {
    let mut emulator = Emulator::new(PumaParams::unimation(), Profile::val2());
    let mut now = Duration::ZERO;
    emulator.feed(b"N\rN\rCAL\rY\r", now);
    for chunk in data.chunks(64) {
        now += Duration::from_secs(2);
        emulator.feed(chunk, now);
        assert!(emulator.joints().0.iter().all(|angle| angle.is_finite()));
    }
});
