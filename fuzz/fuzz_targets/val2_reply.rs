//! Any bytes as a controller's reply.
#![no_main]

use libfuzzer_sys::fuzz_target;
use puma_val2::{Location, PumaParams, ReplyReader};

fuzz_target!(|data: &[u8]| {
    let mut reader = ReplyReader::new(4096, '.', '*');
    for chunk in data.chunks(16) {
        reader.push(chunk);
        let _ = reader.ending();
        assert!(reader.text().len() <= 4096 + 48);
    }
    if let Some(location) = Location::parse(reader.text()) {
        let _ = location.agrees(&PumaParams::unimation());
    }
});
