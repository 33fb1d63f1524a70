//! Damage in moves of the hand.

use puma_val2::{Joints, MoveWay, Profile, PumaParams, Xyzoat};

use crate::harness::{STEP, Subject, Tally, client, off, truth};
use crate::line::{CHARACTERS, Damage};

/// A pose in which no two postures meet.
const HOME: [f64; 6] = [0.0, -45.0, 180.0, 10.0, 45.0, 0.0];

fn moving_the_hand(profile: Profile, stride: usize) -> Subject<'static> {
    Subject {
        name: "move_hand",
        act: &|client, strike| {
            let goal = PumaParams::unimation().forward(&(Joints::from_degrees(HOME) + STEP));
            strike(client.line_mut());
            client
                .move_hand(&Xyzoat::from_pose(&goal), false)
                .map(|location| location.joints)
        },
        home: Joints::from_degrees(HOME),
        stride,
        ..Subject::moving(profile, MoveWay::Automatic)
    }
}

fn silent() -> Profile {
    Profile {
        echo: false,
        ..Profile::val2()
    }
}

#[test]
fn damage_anywhere_in_a_move_of_the_hand() {
    let mut sum = Tally::default();
    for profile in [Profile::val2(), Profile::val2_strict_miz(), silent()] {
        sum.add(&moving_the_hand(profile, 2).strike_both_ways(&CHARACTERS));
    }
    sum.show("moves of the hand, single characters");
    assert!(
        sum.injected > 1000 && sum.recovered * 10 > sum.injected * 9,
        "{sum:?}"
    );
    let mut sum = Tally::default();
    for damage in [Damage::Cut, Damage::Closed] {
        sum.add(&moving_the_hand(Profile::val2(), 2).strike_both_ways(&[&|_| damage]));
    }
    sum.show("moves of the hand, cut and closed line");
    assert!(sum.injected > 200, "{sum:?}");
}

#[test]
fn damage_anywhere_in_a_guarded_move_of_the_hand() {
    let subject = Subject {
        name: "guarded move_hand",
        prepare: &|client| client.arm_proximity(1001).unwrap(),
        ..moving_the_hand(Profile::val2(), 7)
    };
    let sum = subject.strike_both_ways(&CHARACTERS);
    sum.show("guarded moves of the hand, single characters");
    assert!(
        sum.injected > 400 && sum.recovered * 10 > sum.injected * 9,
        "{sum:?}"
    );
}

#[test]
fn without_an_echo_the_pose_is_compared_before_the_hand_moves() {
    let mut client = client(silent(), MoveWay::Automatic);
    let goal = Joints::from_degrees([20.0, -45.0, 180.0, 0.0, 45.0, 0.0]);
    let pose = Xyzoat::from_pose(&PumaParams::unimation().forward(&goal));
    let before = truth(&client);
    client.line_mut().forge = Some(("90.000", "70.000"));
    client.move_hand(&pose, false).unwrap();
    assert!(client.line().forge.is_none());
    assert!(off(truth(&client), before) > 10.0);
}
