//! Faults on the line of a client that has moved the arm before: the controller holds old goals.

use puma_val2::{
    ArmError, ClientConfig, Emulator, Joint, JointDelta, Joints, Manipulator, MoveWay, Profile,
    PumaParams, Val2Client,
};

use crate::faults::harness::{STEP, Subject, Tally, client, config};
use crate::faults::line::{Damage, FaultyLine, Way};

fn silent() -> Profile {
    Profile {
        echo: false,
        ..Profile::val2()
    }
}

/// A move whose controller holds the goal of an earlier one, 60 degrees away.
fn used(profile: Profile, way: MoveWay) -> Subject<'static> {
    Subject {
        name: "move_by after other moves",
        prepare: &|client| {
            client
                .move_by(JointDelta::of(Joint::J1, -60_f64.to_radians()))
                .unwrap();
            let emulator = client.line_mut().inner.emulator_mut();
            emulator.place_arm(Subject::READY);
            client.joints().unwrap();
        },
        ..Subject::moving(profile, way)
    }
}

#[test]
fn a_flipped_bit_never_moves_the_arm_to_an_old_goal() {
    let mut sum = Tally::default();
    for (profile, way) in [
        (Profile::val2(), MoveWay::Automatic),
        (Profile::val2(), MoveWay::Point),
        (Profile::val2_strict_miz(), MoveWay::Automatic),
        (silent(), MoveWay::Automatic),
    ] {
        for bit in 0..8 {
            let to = used(profile.clone(), way);
            sum.add(&to.strike_everywhere(Way::ToController, &|_| Damage::Flipped(bit)));
            let from = Subject {
                stride: 17,
                ..used(profile.clone(), way)
            };
            sum.add(&from.strike_everywhere(Way::FromController, &|_| Damage::Flipped(bit)));
        }
        for damage in [Damage::Lost, Damage::Doubled] {
            let to = used(profile.clone(), way);
            sum.add(&to.strike_everywhere(Way::ToController, &|_| damage));
        }
    }
    sum.show("used client, single characters");
    assert!(sum.recovered * 10 > sum.injected * 9, "{sum:?}");
}

/// The arm and the abilities of a PUMA 260.
fn small(way: MoveWay) -> Subject<'static> {
    Subject {
        arm: PumaParams {
            ranges: PumaParams::unimation().ranges,
            ..PumaParams::puma_260([90.0; 6])
        },
        ..used(Profile::val2_strict_miz(), way)
    }
}

fn guarded(subject: Subject<'static>) -> Subject<'static> {
    Subject {
        name: "guarded move_by after other moves",
        act: &|client, strike| {
            client.arm_proximity(1001).unwrap();
            strike(client.line_mut());
            let outcome = client.move_by(STEP);
            client.disarm_proximity().unwrap();
            outcome
        },
        ..subject
    }
}

#[test]
fn a_flipped_bit_never_guides_a_guarded_move_to_an_old_goal() {
    let mut sum = Tally::default();
    let automatic = MoveWay::Automatic;
    for (subject, stride) in [
        (used(Profile::val2(), automatic), 1),
        (small(automatic), 5),
        (used(silent(), automatic), 5),
    ] {
        for bit in 0..8 {
            let subject = Subject {
                stride,
                ..subject.clone()
            };
            let damage = |_| Damage::Flipped(bit);
            sum.add(&guarded(subject).strike_everywhere(Way::ToController, &damage));
        }
    }
    sum.show("used client under guard, single characters");
    assert!(sum.recovered * 10 > sum.injected * 9, "{sum:?}");
}

#[test]
fn a_flipped_bit_never_moves_a_puma_260_to_an_old_goal() {
    let mut sum = Tally::default();
    for damage in (0..8)
        .map(Damage::Flipped)
        .chain([Damage::Lost, Damage::Doubled])
    {
        let to = Subject {
            stride: 3,
            ..small(MoveWay::Automatic)
        };
        sum.add(&to.strike_everywhere(Way::ToController, &|_| damage));
        let from = Subject {
            stride: 37,
            ..small(MoveWay::Automatic)
        };
        sum.add(&from.strike_everywhere(Way::FromController, &|_| damage));
    }
    sum.show("used client of a PUMA 260, single characters");
    assert!(sum.recovered * 10 > sum.injected * 9, "{sum:?}");
}

#[test]
fn bursts_bit_pairs_and_lost_lines_never_lead_to_an_old_goal() {
    let mut sum = Tally::default();
    let automatic = MoveWay::Automatic;
    for subject in [
        used(Profile::val2(), automatic),
        small(automatic),
        used(silent(), automatic),
        guarded(used(silent(), automatic)),
    ] {
        for damage in [
            Damage::Burst(2),
            Damage::Burst(7),
            Damage::Burst(40),
            Damage::Line,
            Damage::Masked(0x03),
            Damage::Masked(0x41),
        ] {
            for (direction, stride) in [(Way::ToController, 5), (Way::FromController, 41)] {
                let subject = Subject {
                    stride,
                    ..subject.clone()
                };
                sum.add(&subject.strike_everywhere(direction, &|_| damage));
            }
        }
    }
    sum.show("used client, bursts, pairs of bits and lost lines");
    assert!(sum.recovered * 10 > sum.injected * 8, "{sum:?}");
}

#[test]
fn a_refusal_by_noise_does_not_switch_ppoint_off() {
    let mut client = client(Profile::val2(), MoveWay::Automatic);
    let line = "DO MOVE #PPOINT(";
    client
        .line_mut()
        .strike(Way::ToController, line.len() - 2, Damage::Flipped(0));
    client.line_mut().struck = false;
    client.move_by(STEP).unwrap();
    assert!(client.line().struck);
    let before = client.line().inner.traffic().0;
    client.move_by(STEP).unwrap();
    let typed = client.line().inner.traffic().0 - before;
    assert!(typed < 60, "{typed} characters: a move by POINT");
}

#[test]
fn without_an_echo_motions_by_one_line_are_refused_unsent() {
    for way in [MoveWay::Drive, MoveWay::Ppoint] {
        let line = FaultyLine::new(Emulator::new(PumaParams::unimation(), silent()));
        let mut client = Val2Client::connect(line, config(way)).unwrap();
        client.calibrate().unwrap();
        let refused = client.move_by(STEP).unwrap_err();
        assert!(refused.to_string().contains("POINT"), "{refused}");
        assert_matches!(refused, ArmError::Setting { .. });
        assert_eq!(client.line().inner.emulator().joints(), Joints::READY);
    }
    let config = ClientConfig {
        check_echo: false,
        ..config(MoveWay::Automatic)
    };
    let line = FaultyLine::new(Emulator::new(PumaParams::unimation(), Profile::val2()));
    let mut client = Val2Client::connect(line, config).unwrap();
    client.calibrate().unwrap();
    client.move_by(STEP).unwrap();
    assert_matches!(
        client.drive(Joint::J1, 0.1, 100.0),
        Err(ArmError::Setting { .. })
    );
}
