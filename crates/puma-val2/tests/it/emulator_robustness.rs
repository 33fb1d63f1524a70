//! Bytes of any kind: no panic, no endless loop, bounded memory.

use std::time::Duration;

use proptest::prelude::*;
use puma_val2::{Emulator, Location, Profile, PumaParams};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use crate::fuzz_targets::{TARGETS, run};

/// Pieces of VAL II in which chance finds more than in bytes.
const WORDS: &str = r#"
    WHERE DO CAL Y N SPEED HERE POINT EDIT EXECUTE ABORT A #P P 10 -3.5 , ( ) = [ ] : + *
    MOVE MOVES DRIVE TRANS #PPOINT IF THEN GOTO FOR TO END WHILE CASE OF VALUE UNTIL TYPE
    PROMPT "x" /X9 REACTI 1001 SIG WAIT CALL DELAY E I D S STORE LOAD TOOL BASE SHIFT BY
    FRAME READY ; DECOMPOSE SET DELETE LISTP RETRY PROCEED NEXT DRAW
"#;

/// A line of such pieces.
fn line() -> impl Strategy<Value = String> {
    let word = prop::sample::select(WORDS.split_whitespace().collect::<Vec<_>>());
    prop::collection::vec(word, 0..10).prop_map(|words| words.join(" "))
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 256,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn the_controller_takes_any_lines(
        lines in prop::collection::vec(line(), 0..60),
        step in 0_u64..5000,
    ) {
        let mut emulator = Emulator::new(PumaParams::unimation(), Profile::val2());
        let mut now = Duration::ZERO;
        emulator.feed(b"N\rN\rCAL\rY\r", now);
        now += Duration::from_secs(10);
        for line in lines {
            emulator.feed(format!("{line}\r").as_bytes(), now);
            now += Duration::from_millis(step);
            let said = emulator.poll(now);
            prop_assert!(said.len() < 1 << 21);
            prop_assert!(emulator.joints().0.iter().all(|j| j.is_finite()));
            let limits = emulator.params();
            for (angle, range) in emulator.joints().0.iter().zip(limits.ranges) {
                prop_assert!(*angle > range.min - 1e-3 && *angle < range.max + 1e-3);
            }
        }
        // What was stored can be stored and read again.
        let text = emulator.text();
        let mut other = Emulator::new(PumaParams::unimation(), Profile::val2());
        prop_assert!(other.load_text(&text).is_ok(), "{text}");
    }

    #[test]
    fn where_is_read_from_any_numbers(
        values in prop::array::uniform12(-1000.0_f64..1000.0),
        width in 0_usize..12,
    ) {
        let show = |v: &[f64]| v.iter().map(|x| format!(" {x:>width$.3}")).collect::<String>();
        let reply = format!(
            "WHERE\r\nX Y Z O A T\r\n{}\r\nJT1 JT2 JT3 JT4 JT5 JT6\r\n{}\r\n.",
            show(&values[..6]),
            show(&values[6..])
        );
        let location = Location::parse(&reply).expect("a sound reply");
        for (read, sent) in location.joints.degrees().iter().zip(&values[6..]) {
            prop_assert!((read - sent).abs() < 0.001);
        }
        for (read, sent) in location.hand.val().iter().zip(&values[..6]) {
            prop_assert!((read - sent).abs() < 0.001);
        }
    }
}

const SIGNS: &[u8] = b"\r\n .,;:#()[]=-0159\"EAPS";

/// Changes, doubles, leaves out or moves some bytes of a text.
fn mutated(rng: &mut StdRng, texts: &[&str]) -> Vec<u8> {
    let mut bytes = texts[rng.random_range(0..texts.len())].as_bytes().to_vec();
    for _ in 0..rng.random_range(1..8) {
        let at = rng.random_range(0..=bytes.len());
        let end = (at + rng.random_range(1..24)).min(bytes.len());
        let piece = bytes[at..end].to_vec();
        let to = rng.random_range(0..=bytes.len());
        match rng.random_range(0..5) {
            0 => drop(bytes.drain(at..end)),
            1 => drop(bytes.splice(to..to, piece)),
            2 => bytes.insert(at, rng.random()),
            3 => bytes.insert(at, SIGNS[rng.random_range(0..SIGNS.len())]),
            _ if at < end => bytes[at] ^= 1 << rng.random_range(0..8),
            _ => {}
        }
    }
    bytes
}

/// The number of inputs of each target is `PUMA_VAL2_FUZZ` (default 150). Their first texts are
/// written to folders of the folder `PUMA_VAL2_SEEDS`, if it is given, for `cargo fuzz`.
#[test]
fn fuzz_targets_take_damaged_texts() {
    let inputs = std::env::var("PUMA_VAL2_FUZZ").map_or(150, |n| n.parse().unwrap());
    let seeds = std::env::var_os("PUMA_VAL2_SEEDS");
    for (name, _, texts) in TARGETS {
        for (i, text) in texts.iter().enumerate() {
            run(name, text.as_bytes());
            if let Some(folder) = &seeds {
                let folder = std::path::Path::new(folder).join(name);
                std::fs::create_dir_all(&folder).unwrap();
                std::fs::write(folder.join(i.to_string()), text).unwrap();
            }
        }
        let mut rng = StdRng::seed_from_u64(16);
        let start = std::time::Instant::now();
        for _ in 0..inputs {
            run(name, &mutated(&mut rng, texts));
        }
        println!("{name}: {inputs} inputs in {:.1?}", start.elapsed());
    }
}
