//! Characters damaged in a move of the joints.

use puma_val2::{
    ArmError, ClientConfig, Emulator, Manipulator, MoveWay, Profile, PumaParams, Val2Client,
};
use rand::{SeedableRng, rngs::Xoshiro256PlusPlus};

use crate::faults::harness::{STEP, Subject, Tally, client, config, judge, truth};
use crate::faults::line::{CHARACTERS, Damage, FaultyLine, Way};

fn profiles_and_ways() -> Vec<(Profile, MoveWay)> {
    let silent = Profile {
        echo: false,
        ..Profile::val2()
    };
    vec![
        (Profile::val2(), MoveWay::Automatic),
        (Profile::val2(), MoveWay::Drive),
        (Profile::val2(), MoveWay::Point),
        (Profile::val2_strict_miz(), MoveWay::Automatic),
        (silent, MoveWay::Automatic),
    ]
}

#[test]
fn lost_doubled_and_flipped_characters_anywhere_in_a_move() {
    let mut sum = Tally::default();
    for (profile, way) in profiles_and_ways() {
        sum.add(&Subject::moving(profile, way).strike_both_ways(&CHARACTERS));
    }
    sum.show("single characters");
    assert!(sum.injected > 3000);
    assert!(sum.recovered * 10 > sum.injected * 9, "{sum:?}");
}

#[test]
fn a_line_cut_or_closed_anywhere_in_a_move_is_reported() {
    for (damage, what) in [(Damage::Cut, "cut line"), (Damage::Closed, "closed line")] {
        let mut sum = Tally::default();
        for (profile, way) in profiles_and_ways() {
            sum.add(&Subject::moving(profile, way).strike_both_ways(&[&|_| damage]));
        }
        sum.show(what);
        // Only a cut behind the last character that counts can be overlooked.
        assert!(sum.injected > 500 && sum.recovered < 20, "{sum:?}");
    }
}

#[test]
fn noise_on_the_line() {
    let mut sum = Tally::default();
    for seed in 0..300 {
        let (profile, way) = profiles_and_ways().swap_remove(seed % 5);
        let mut client = client(profile, way);
        let mut start = truth(&client);
        client.line_mut().noise = Some((0.004, Xoshiro256PlusPlus::seed_from_u64(seed as u64)));
        for turn in 0..3 {
            client.line_mut().struck = false;
            let outcome = client.move_by(STEP);
            let noise = client.line_mut().noise.take();
            let context = format!("seed {seed} turn {turn} {way:?}");
            let good = judge(&mut client, start, &outcome, &context);
            if client.line().struck {
                sum.count(good);
            }
            if client.joints().is_err() {
                client.reconnect().unwrap();
            }
            client.joints().unwrap();
            client.line_mut().noise = noise;
            start = truth(&client);
        }
    }
    sum.show("noise, moves with at least one damaged character");
    assert!(
        sum.injected > 200 && sum.recovered * 10 > sum.injected * 8,
        "{sum:?}"
    );
}

/// A call that gives up with its line typed and not ended leaves nothing behind that the next line
/// could be added to.
#[test]
fn a_half_typed_line_is_not_added_to_the_next() {
    let config = ClientConfig {
        retries: 0,
        ..config(MoveWay::Automatic)
    };
    let line = FaultyLine::new(Emulator::new(PumaParams::unimation(), Profile::val2()));
    let mut client = Val2Client::connect(line, config).unwrap();
    client
        .line_mut()
        .strike(Way::FromController, 3, Damage::Flipped(0));
    assert_matches!(client.set_speed(30.0), Err(ArmError::Garbled { .. }));
    assert!(client.line().struck);
    client.joints().unwrap();
}

/// `-1` and `0` do not become each other by one character.
#[test]
fn a_signal_is_read_right_whatever_happens_to_one_character() {
    let mut client = client(Profile::val2(), MoveWay::Automatic);
    for on in [false, true] {
        client
            .line_mut()
            .inner
            .emulator_mut()
            .set_signal(1001, on)
            .unwrap();
        for damage in CHARACTERS {
            for direction in [Way::ToController, Way::FromController] {
                for at in 0.. {
                    client.line_mut().heal();
                    client.joints().unwrap();
                    client.line_mut().struck = false;
                    client.line_mut().strike(direction, at, damage(at));
                    if let Ok(read) = client.signal(1001) {
                        assert_eq!(read, on, "{direction:?} {:?} at {at}", damage(at));
                    }
                    if !client.line().struck {
                        break;
                    }
                }
            }
        }
    }
}
