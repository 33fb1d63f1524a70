//! Any text as a controller's reply to `WHERE`.
#![no_main]

use libfuzzer_sys::fuzz_target;
use puma_val2::Location;

fuzz_target!(|data: &[u8]| {
    if let Some(location) = Location::parse(&String::from_utf8_lossy(data)) {
        assert!(location.joints.0.iter().all(|angle| angle.is_finite()));
    }
});
