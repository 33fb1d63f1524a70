//! Moves that a signal may stop.

use puma_val2::{
    ArmError, Joint, JointDelta, Joints, Manipulator, MoveWay, Profile, ProximitySensor,
    PumaParams, Xyzoat,
};

use crate::faults::harness::{
    Client, STEP, Subject, Tally, assert_knows_where, client, judge, off, truth,
};
use crate::faults::line::{CHARACTERS, Damage};

/// An object beside the path of joint 1 that the sensors see in passing, between these angles in
/// degrees.
fn put_object(client: &mut Client, from: f64, to: f64) {
    client
        .line_mut()
        .inner
        .emulator_mut()
        .attach_sensor(1001, move |joints| {
            (from..to).contains(&joints[Joint::J1].to_degrees())
        })
        .unwrap();
}

fn profiles() -> [Profile; 2] {
    [Profile::val2(), Profile::val2_strict_miz()]
}

#[test]
fn proximity_stops_a_move_and_uses_the_guard_up() {
    for profile in profiles() {
        let mut client = client(profile.clone(), MoveWay::Automatic);
        put_object(&mut client, 5.0, 1000.0);
        client.arm_proximity(1001).unwrap();
        let start = truth(&client);
        let outcome = client.move_by(STEP);
        let Err(ArmError::ProximityStop {
            signal: 1001,
            joints,
            ..
        }) = outcome
        else {
            panic!("{}: {outcome:?}", profile.name)
        };
        let stands = truth(&client);
        assert!((5.0..9.0).contains(&stands.degrees()[0]), "{stands}");
        assert!(off(stands, joints) < 1e-3);
        judge(&mut client, start, &outcome, "proximity");
        // The way back is free.
        client.move_to(start).unwrap();
        assert!(!client.object_near().unwrap());
        // Armed again and nothing near: moves as ever.
        client.arm_proximity(1001).unwrap();
        client
            .move_by(JointDelta::from_degrees([-10.0, 3.0, 0.0, 0.0, 0.0, 0.0]))
            .unwrap();
        client.disarm_proximity().unwrap();
        client
            .move_by(JointDelta::from_degrees([20.0, 3.0, 0.0, 0.0, 0.0, 0.0]))
            .unwrap();
        assert!(client.object_near().unwrap());
    }
}

#[test]
fn a_signal_that_has_gone_again_is_not_lost() {
    for profile in profiles() {
        // So near to the goal that the arm still gets there, and in mid-move.
        for (from, to) in [(11.40, 11.44), (5.0, 6.0)] {
            let mut client = client(profile.clone(), MoveWay::Automatic);
            // Slow enough to be seen in the narrow place.
            client.set_speed(2.0).unwrap();
            put_object(&mut client, from, to);
            client.arm_proximity(1001).unwrap();
            let start = truth(&client);
            let outcome = client.move_by(STEP);
            assert_matches!(
                outcome,
                Err(ArmError::ProximityStop { signal: 1001, .. }),
                "{} {from}",
                profile.name
            );
            judge(&mut client, start, &outcome, "pulse");
            assert_knows_where(&client);
        }
        // On before the move begins.
        let mut client = client(profile, MoveWay::Automatic);
        put_object(&mut client, -1.0, 1.0);
        client.arm_proximity(1001).unwrap();
        let start = truth(&client);
        assert_matches!(client.move_by(STEP), Err(ArmError::ProximityStop { .. }));
        assert!(off(truth(&client), start) < 1e-6);
    }
}

type Motion = (&'static str, fn(&mut Client) -> Result<Joints, ArmError>);

#[test]
fn every_motion_is_guarded() {
    let motions: [Motion; 6] = [
        ("move_by", |c| {
            c.move_by(JointDelta::of(Joint::J1, 20_f64.to_radians()))
        }),
        ("move_to", |c| {
            c.move_to(Joints::from_degrees([20.0, -45.0, 180.0, 0.0, 45.0, 0.0]))
        }),
        ("drive", |c| c.drive(Joint::J1, 20_f64.to_radians(), 50.0)),
        ("ready", |c| {
            // READY lies beyond the object, seen from here.
            c.line_mut()
                .inner
                .emulator_mut()
                .attach_sensor(1001, |joints| joints[Joint::J1].to_degrees() < 5.0)
                .unwrap();
            c.ready()
        }),
        ("move_hand", |c| {
            c.move_hand(&beyond(), false).map(|l| l.joints)
        }),
        ("move_hand straight", |c| {
            c.move_hand(&beyond(), true).map(|l| l.joints)
        }),
    ];
    for profile in profiles() {
        for (name, motion) in motions {
            let context = format!("{} {name}", profile.name);
            let mut client = client(profile.clone(), MoveWay::Drive);
            let first = if name == "ready" { 10.0 } else { 0.0 };
            client
                .move_to(Joints::from_degrees([first, -45.0, 180.0, 0.0, 45.0, 0.0]))
                .unwrap();
            put_object(&mut client, 5.0, 8.5);
            client.arm_proximity(1001).unwrap();
            let outcome = motion(&mut client);
            assert_matches!(outcome, Err(ArmError::ProximityStop { .. }), "{context}");
            let stands = truth(&client).degrees()[0];
            assert!((1.0..9.0).contains(&stands), "{context}: {stands}");
            assert_knows_where(&client);
            // And without the object each gets there, guard or no guard.
            client.disarm_proximity().unwrap();
            client
                .move_to(Joints::from_degrees([first, -45.0, 180.0, 0.0, 45.0, 0.0]))
                .unwrap();
            put_object(&mut client, 500.0, 600.0);
            client.arm_proximity(1001).unwrap();
            if name != "ready" {
                let reached = motion(&mut client).unwrap_or_else(|e| panic!("{context}: {e}"));
                assert!(
                    (reached.degrees()[0] - 20.0).abs() < 0.05,
                    "{context}: {reached}"
                );
            }
        }
    }
}

/// The hand's pose with the arm at 20 degrees of joint 1.
fn beyond() -> Xyzoat {
    let joints = Joints::from_degrees([20.0, -45.0, 180.0, 0.0, 45.0, 0.0]);
    Xyzoat::from_pose(&PumaParams::unimation().forward(&joints))
}

#[test]
fn a_guarded_drive_keeps_its_speed() {
    let mut client = client(Profile::val2(), MoveWay::Automatic);
    client.arm_proximity(1001).unwrap();
    let mut time = |speed| {
        let begun = client.line().inner.emulator().now();
        client.drive(Joint::J1, 20_f64.to_radians(), speed).unwrap();
        (client.line().inner.emulator().now() - begun).as_secs_f64()
    };
    let (slow, quick) = (time(2.0), time(100.0));
    assert!(slow > 10.0 && quick < 5.0, "{slow} {quick}");
}

#[test]
fn what_cannot_be_guarded_is_refused_and_nothing_is_sent() {
    let mut client = client(Profile::val2(), MoveWay::Automatic);
    client
        .store_program("MINE", &["MOVE #PPOINT(40,-90,90)".to_owned()])
        .unwrap();
    client.arm_proximity(1001).unwrap();
    let before = client.line().inner.traffic();
    assert_matches!(client.execute("MINE"), Err(ArmError::Setting { .. }));
    assert_matches!(client.calibrate(), Err(ArmError::Setting { .. }));
    assert_matches!(client.resident().map(drop), Err(ArmError::Setting { .. }));
    assert_eq!(client.line().inner.traffic(), before);
    client.disarm_proximity().unwrap();
    client.execute("MINE").unwrap();
    assert!((truth(&client).degrees()[0] - 40.0).abs() < 1e-6);
}

#[test]
fn a_signal_that_there_is_not_is_refused_at_once() {
    let mut client = client(Profile::val2(), MoveWay::Automatic);
    assert_matches!(
        client.arm_proximity(5000),
        Err(ArmError::Refused { message, .. }) if message == "Illegal signal number"
    );
    client.move_by(STEP).unwrap();
}

fn guarded(profile: Profile) -> Subject<'static> {
    Subject {
        name: "guarded move_by",
        prepare: &|client| client.arm_proximity(1001).unwrap(),
        stride: 3,
        ..Subject::moving(profile, MoveWay::Automatic)
    }
}

#[test]
fn damage_anywhere_in_a_guarded_move() {
    let mut sum = Tally::default();
    for profile in profiles() {
        sum.add(&guarded(profile).strike_both_ways(&CHARACTERS));
    }
    sum.show("guarded moves, single characters");
    assert!(
        sum.injected > 1000 && sum.recovered * 10 > sum.injected * 9,
        "{sum:?}"
    );
    let mut sum = Tally::default();
    for damage in [Damage::Cut, Damage::Closed] {
        sum.add(&guarded(Profile::val2()).strike_both_ways(&[&|_| damage]));
    }
    sum.show("guarded moves, cut and closed line");
    assert!(sum.injected > 200, "{sum:?}");
}

/// A move that the signal stops, on a damaged line: it never passes for one that has arrived, and
/// the arm does not go on.
#[test]
fn damage_anywhere_in_a_move_that_is_stopped() {
    let mut sum = Tally::default();
    for damage in CHARACTERS {
        for direction in [
            crate::faults::line::Way::ToController,
            crate::faults::line::Way::FromController,
        ] {
            let mut client = client(Profile::val2(), MoveWay::Automatic);
            for at in (0..).step_by(5) {
                let context = format!("stopped {direction:?} {:?} at {at}", damage(at));
                client.line_mut().heal();
                if client.joints().is_err() {
                    client.reconnect().unwrap();
                }
                client.disarm_proximity().unwrap();
                client.move_to(Subject::READY).unwrap();
                put_object(&mut client, 5.0, 8.5);
                client.arm_proximity(1001).unwrap();
                let start = truth(&client);
                client.line_mut().struck = false;
                client.line_mut().strike(direction, at, damage(at));
                let outcome = client.move_by(STEP);
                assert!(outcome.is_err(), "{context}: went through");
                judge(&mut client, start, &outcome, &context);
                let stands = truth(&client).degrees()[0];
                assert!(stands < 9.0, "{context}: {stands} after {outcome:?}");
                if !client.line().struck {
                    assert_matches!(outcome, Err(ArmError::ProximityStop { .. }));
                    break;
                }
                sum.count(matches!(outcome, Err(ArmError::ProximityStop { .. })));
            }
        }
    }
    sum.show("moves stopped by the signal");
    assert!(
        sum.injected > 400 && sum.recovered * 10 > sum.injected * 9,
        "{sum:?}"
    );
}
