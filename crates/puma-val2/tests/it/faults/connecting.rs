//! Characters damaged while the client gets hold of the monitor.

use std::cell::RefCell;
use std::io;
use std::rc::Rc;
use std::time::Duration;

use puma_val2::{Emulator, Manipulator, MoveWay, Profile, PumaParams, Transport, Val2Client};

use crate::faults::harness::{STEP, Tally, config, off};
use crate::faults::line::{CHARACTERS, Damage, FaultyLine, Way};

/// A line that can still be looked at when a connection has failed.
struct Kept(Rc<RefCell<FaultyLine>>);

impl Transport for Kept {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.borrow_mut().send(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<Option<usize>> {
        self.0.borrow_mut().receive(buffer, timeout)
    }

    fn clock(&self) -> Duration {
        self.0.borrow().clock()
    }

    fn name(&self) -> &str {
        "kept"
    }
}

/// Connects with one character damaged after another, until a connection stays unhurt.
fn strike_everywhere(profile: &Profile, direction: Way, damage: &dyn Fn(usize) -> Damage) -> Tally {
    let mut tally = Tally::default();
    for at in 0.. {
        let damage = damage(at);
        let context = format!("{direction:?} {damage:?} at {at}, echo {}", profile.echo);
        let mut emulator = Emulator::new(PumaParams::unimation(), profile.clone());
        emulator.load_text(".REALS\nKEPT 1\n.END").unwrap();
        let mut line = FaultyLine::new(emulator);
        line.strike(direction, at, damage);
        let line = Rc::new(RefCell::new(line));
        let outcome = Val2Client::connect(Kept(Rc::clone(&line)), config(MoveWay::Automatic));
        let kept = line.borrow().inner.emulator().real("KEPT");
        assert_eq!(kept, Some(1.0), "{context}: the memory has been erased");
        let struck = line.borrow().struck;
        line.borrow_mut().heal();
        let Ok(mut client) = outcome else {
            assert!(struck, "{context}: a sound line");
            tally.count(false);
            continue;
        };
        assert_eq!(client.echoes(), profile.echo, "{context}");
        client
            .calibrate()
            .unwrap_or_else(|e| panic!("{context}: {e}"));
        let start = client.joints().unwrap_or_else(|e| panic!("{context}: {e}"));
        client
            .move_by(STEP)
            .unwrap_or_else(|e| panic!("{context}: {e}"));
        let there = line.borrow().inner.emulator().joints();
        assert!(off(there, start + STEP) < 0.013, "{context}");
        if !struck {
            return tally;
        }
        tally.count(true);
    }
    tally
}

/// The start-up dialogue never erases the memory, and what is found out about the echo is right.
#[test]
fn lost_doubled_and_flipped_characters_anywhere_in_a_connection() {
    let mut sum = Tally::default();
    for (echo, reversed) in [(true, false), (true, true), (false, false), (false, true)] {
        let mut profile = Profile {
            echo,
            ..Profile::val2()
        };
        if reversed {
            profile.boot.reverse();
        }
        for direction in [Way::ToController, Way::FromController] {
            for damage in CHARACTERS {
                sum.add(&strike_everywhere(&profile, direction, damage));
            }
        }
    }
    sum.show("connections, single characters");
    assert!(
        sum.injected > 1000 && sum.recovered * 10 > sum.injected * 9,
        "{sum:?}"
    );
}
