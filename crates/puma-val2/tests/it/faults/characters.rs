//! Characters damaged in a move of the joints.

use puma_val2::{
    ArmError, ClientConfig, Emulator, Joint, JointDelta, Manipulator, MoveWay, Profile, PumaParams,
    Val2Client,
};

use crate::faults::harness::{STEP, Subject, Tally, client, config, judge, truth};
use crate::faults::line::{CHARACTERS, Damage, FaultyLine, Noise, Way};

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

/// Moves of a client whose controller holds goals 60 degrees away, with any character damaged at
/// random. `PUMA_VAL2_MOVES` sets the number of moves of each row.
#[test]
fn noise_never_moves_the_arm_beyond_its_goal() {
    let moves = std::env::var("PUMA_VAL2_MOVES").ok();
    let moves: usize = moves.and_then(|n| n.parse().ok()).unwrap_or(60);
    let mut rows: Vec<_> = profiles_and_ways()
        .into_iter()
        .map(|row| (row, true))
        .collect();
    rows.push(((Profile::val2_hardware(), MoveWay::Automatic), true));
    rows.push(((Profile::val2(), MoveWay::Ppoint), true));
    rows.push(((Profile::val2(), MoveWay::Automatic), false));
    let mut all = Tally::default();
    for ((profile, way), check_echo) in rows {
        let row = format!(
            "{} {way:?} echo {} checked {check_echo}",
            profile.name, profile.echo
        );
        let line = FaultyLine::new(Emulator::new(PumaParams::unimation(), profile));
        let config = ClientConfig {
            check_echo,
            ..config(way)
        };
        let mut client = Val2Client::connect(line, config).unwrap();
        client.calibrate().unwrap();
        let mut sum = Tally::default();
        for turn in 0..moves {
            if client.joints().is_err() {
                client.reconnect().unwrap();
            }
            if turn % 10 == 0 {
                let old_goal = JointDelta::of(Joint::J1, -60_f64.to_radians());
                client.move_by(old_goal).unwrap();
            }
            client
                .line_mut()
                .inner
                .emulator_mut()
                .place_arm(Subject::READY);
            client.joints().unwrap();
            let (start, rate) = (truth(&client), [0.001, 0.004][turn % 2]);
            client.line_mut().noise = Some(Noise::of_all_kinds(rate, turn as u64));
            client.line_mut().struck = false;
            let outcome = client.move_by(STEP);
            client.line_mut().heal();
            let good = judge(&mut client, start, &outcome, &format!("{row}, move {turn}"));
            if client.line().struck {
                sum.count(good);
            }
        }
        sum.show(&format!("noise, {row}"));
        all.add(&sum);
    }
    assert!(all.recovered * 10 > all.injected * 8, "{all:?}");
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
