//! Things that happen to the controller.

use puma_val2::{
    ArmError, Emulator, Joint, JointDelta, Joints, Manipulator, MoveWay, Profile, PumaParams,
    Val2Client,
};

use crate::faults::harness::{Client, STEP, assert_knows_where, client, config, judge, truth};
use crate::faults::line::FaultyLine;

/// Runs a move during which something happens to the controller as soon as the arm has begun to
/// move.
fn disturbed(
    way: MoveWay,
    disturb: impl FnOnce(&mut Emulator) + 'static,
) -> (Client, Result<Joints, ArmError>) {
    let mut client = client(Profile::val2(), way);
    let start = truth(&client);
    client.line_mut().disturb = Some(Box::new(disturb));
    let outcome = client.move_by(STEP);
    assert!(client.line().disturb.is_none(), "the arm never moved");
    judge(&mut client, start, &outcome, &format!("{way:?}"));
    (client, outcome)
}

const WAYS: [MoveWay; 3] = [MoveWay::Drive, MoveWay::Ppoint, MoveWay::Point];

#[test]
fn arm_power_lost_in_mid_move() {
    for way in WAYS {
        let (client, outcome) = disturbed(way, |emulator| emulator.set_arm_power(false));
        assert_matches!(
            &outcome,
            Err(ArmError::Refused { message, .. }) if message == "Arm power off"
        );
        assert_knows_where(&client);
    }
}

#[test]
fn envelope_error_in_mid_move() {
    for way in WAYS {
        let (client, outcome) = disturbed(way, |emulator| emulator.envelope_error(Joint::J2));
        assert_matches!(
            &outcome,
            Err(ArmError::Refused { message, .. }) if message == "Envelope error Jt 2"
        );
        assert_knows_where(&client);
    }
}

#[test]
fn the_controller_restarts_in_mid_move() {
    for way in WAYS {
        let (mut client, outcome) = disturbed(way, Emulator::restart);
        assert_matches!(outcome, Err(ArmError::Restarted { .. }));
        assert_matches!(client.joints(), Err(ArmError::Restarted { .. }));
        client.reconnect().unwrap();
        client.calibrate().unwrap();
        client
            .move_by(JointDelta::from_degrees([-1.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
            .unwrap();
    }
}

#[test]
fn the_controller_restarts_between_commands() {
    let mut client = client(Profile::val2(), MoveWay::Automatic);
    client.line_mut().inner.emulator_mut().restart();
    assert_matches!(client.move_by(STEP), Err(ArmError::Restarted { .. }));
    client.reconnect().unwrap();
    // It knows its position again only after calibration, and says so.
    assert_matches!(client.move_by(STEP), Err(ArmError::Refused { .. }));
    client.calibrate().unwrap();
    client.move_by(STEP).unwrap();
}

#[test]
fn unasked_messages_during_a_move_and_between_commands() {
    for way in WAYS {
        for text in [
            "\r\nBreak time\r\n",
            "\r\n*Tape reader out of paper*\r\n.",
            "?",
            "\r\n.",
            "*\r\n",
        ] {
            let start_of = |client: &Client| truth(client);
            let (mut client, _) = disturbed(way, move |emulator| emulator.interject(text));
            client.joints().unwrap();
            let start = start_of(&client);
            client.line_mut().inner.emulator_mut().interject(text);
            let outcome = client.move_by(STEP);
            assert!(outcome.is_ok(), "{way:?} {text:?}: {outcome:?}");
            judge(&mut client, start, &outcome, text);
        }
    }
    let mut client = client(Profile::val2(), MoveWay::Automatic);
    client
        .line_mut()
        .inner
        .emulator_mut()
        .interject("\r\n*Tape reader out of paper*\r\n.");
    client.joints().unwrap();
    assert_eq!(client.take_notices(), ["Tape reader out of paper"]);
}

#[test]
fn limits_of_the_controller_that_are_narrower_than_ours() {
    for way in WAYS {
        let mut narrow = PumaParams::unimation();
        narrow.ranges[1].max = -85.0_f64.to_radians();
        let line = FaultyLine::new(Emulator::new(narrow, Profile::val2()));
        let mut client = Val2Client::connect(line, config(way)).unwrap();
        client.calibrate().unwrap();
        let start = client.joints().unwrap();
        let outcome = client.move_by(STEP);
        assert_matches!(
            &outcome,
            Err(ArmError::Refused { message, .. }) if message == "Location out of range Jt 2"
        );
        judge(&mut client, start, &outcome, "narrow");
        assert_knows_where(&client);
    }
}

#[test]
fn a_controller_that_stops_short_is_found_out() {
    let profile = Profile {
        drive_error_degrees: 0.5,
        ..Profile::val2()
    };
    let mut client = client(profile, MoveWay::Drive);
    let outcome = client.drive(Joint::J1, 0.2, 100.0);
    assert_matches!(
        outcome,
        Err(ArmError::NotReached { joint: Joint::J1, wanted_degrees, reported_degrees, .. })
            if (wanted_degrees - reported_degrees - 0.5).abs() < 1e-3
    );
}

#[test]
fn a_motion_that_never_ends_is_stopped() {
    let mut client = client(Profile::val2(), MoveWay::Automatic);
    let emulator = client.line_mut().inner.emulator_mut();
    // Somebody else makes the controller slower than this client knows.
    emulator.feed(b"SPEED 0.05\r", emulator.now());
    let start = truth(&client);
    let outcome = client.move_by(STEP);
    assert_matches!(outcome, Err(ArmError::Silence { .. }));
    judge(&mut client, start, &outcome, "slow");
    assert_knows_where(&client);
}
