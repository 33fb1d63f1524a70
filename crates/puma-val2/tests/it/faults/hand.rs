//! Damage in moves of the hand.

use puma_val2::{Joints, Manipulator, MoveWay, Profile, PumaParams, Xyzoat};

use crate::faults::harness::{STEP, Subject, Tally, client, off, truth};
use crate::faults::line::{CHARACTERS, Damage, Way};

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
        sum.add(&moving_the_hand(profile, 3).strike_both_ways(&CHARACTERS));
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

/// A digit changed on its way is not found out by an echo that is not there, but before the hand
/// moves all the same.
#[test]
fn without_an_echo_the_pose_is_compared_before_the_hand_moves() {
    let goal = Joints::from_degrees([20.0, -45.0, 180.0, 0.0, 45.0, 0.0]);
    let pose = Xyzoat::from_pose(&PumaParams::unimation().forward(&goal));
    let home = Joints::from_degrees(HOME);
    for at in 0..70 {
        let mut client = client(silent(), MoveWay::Automatic);
        client.move_to(home).unwrap();
        client
            .line_mut()
            .strike(Way::ToController, at, Damage::Flipped(1));
        let outcome = client.move_hand(&pose, false);
        let stands = truth(&client);
        let near = if outcome.is_ok() { goal } else { home };
        assert!(off(stands, near) < 0.05, "{at}: {stands} after {outcome:?}");
    }
}
