//! The program that stays in the controller.

use puma_val2::{
    ArmError, Emulator, Gripper, Joint, JointDelta, Joints, Manipulator, MoveWay, Profile,
    PumaParams, Val2Client,
};

use crate::faults::harness::{
    STEP, Subject, Tally, assert_knows_where, assert_not_misled, client, config, judge, off, truth,
};
use crate::faults::line::{CHARACTERS, Damage, FaultyLine};

fn resident() -> Subject<'static> {
    Subject {
        name: "resident",
        act: &|client, strike| {
            let mut resident = client.resident().unwrap();
            strike(resident.line_mut());
            let outcome = resident.move_by(STEP);
            let struck = resident.line().struck;
            resident.line_mut().heal();
            drop(resident);
            client.line_mut().struck = struck;
            outcome
        },
        ..Subject::moving(Profile::val2(), MoveWay::Automatic)
    }
}

#[test]
fn damage_anywhere_in_a_move_of_the_resident_program() {
    let sum = resident().strike_both_ways(&CHARACTERS);
    sum.show("resident program, single characters");
    assert!(
        sum.injected > 300 && sum.recovered * 10 > sum.injected * 9,
        "{sum:?}"
    );
    let mut sum = Tally::default();
    for damage in [Damage::Cut, Damage::Closed] {
        sum.add(&resident().strike_both_ways(&[&|_| damage]));
    }
    sum.show("resident program, cut and closed line");
    assert!(sum.injected > 100, "{sum:?}");
}

#[test]
fn damage_anywhere_while_the_program_is_stored_and_started() {
    let subject = Subject {
        name: "start of the resident program",
        act: &|client, strike| {
            strike(client.line_mut());
            let mut resident = client.resident()?;
            let struck = resident.line().struck;
            resident.line_mut().heal();
            let outcome = resident.move_by(STEP);
            drop(resident);
            client.line_mut().struck = struck;
            outcome
        },
        stride: 11,
        ..resident()
    };
    let sum = subject.strike_both_ways(&CHARACTERS);
    sum.show("start of the resident program, single characters");
    assert!(
        sum.injected > 400 && sum.recovered * 10 > sum.injected * 9,
        "{sum:?}"
    );
}

/// The controller stops the arm in mid-move: the client does not go on from where the move began.
#[test]
fn a_refused_move_leaves_no_stale_position_behind() {
    let disturbances: [fn(&mut Emulator); 2] =
        [|e| e.envelope_error(Joint::J2), |e| e.set_arm_power(false)];
    for disturb in disturbances {
        let mut client = client(Profile::val2(), MoveWay::Automatic);
        let start = truth(&client);
        let mut resident = client.resident().unwrap();
        resident.line_mut().disturb = Some(Box::new(disturb));
        let outcome = resident.move_by(STEP);
        assert_matches!(outcome, Err(ArmError::Refused { .. }));
        // It has ended with that, and says so.
        assert_matches!(resident.joints(), Err(ArmError::Setting { .. }));
        assert_matches!(
            resident.set_gripper(Gripper::Open),
            Err(ArmError::Setting { .. })
        );
        drop(resident);
        judge(&mut client, start, &outcome, "resident refused");
        assert!(off(truth(&client), start) > 0.1, "stopped in mid-move");
        assert_knows_where(&client);
        client.line_mut().inner.emulator_mut().set_arm_power(true);
        let before = truth(&client);
        let by = JointDelta::from_degrees([-1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        client.move_by(by).unwrap();
        assert!(off(truth(&client), before + by) < 0.01);
    }
}

#[test]
fn limits_of_the_controller_that_are_narrower_than_ours() {
    let mut narrow = PumaParams::unimation();
    narrow.ranges[1].max = -85.0_f64.to_radians();
    let line = FaultyLine::new(Emulator::new(narrow, Profile::val2()));
    let mut client = Val2Client::connect(line, config(MoveWay::Automatic)).unwrap();
    client.calibrate().unwrap();
    let mut resident = client.resident().unwrap();
    let outcome = resident.move_by(STEP);
    assert_matches!(
        &outcome,
        Err(ArmError::Refused { message, .. }) if message == "Location out of range Jt 2"
    );
    drop(resident);
    assert_knows_where(&client);
}

#[test]
fn the_controller_restarts_under_the_program() {
    let mut client = client(Profile::val2(), MoveWay::Automatic);
    let start = truth(&client);
    let mut resident = client.resident().unwrap();
    resident.line_mut().disturb = Some(Box::new(Emulator::restart));
    let outcome = resident.move_by(STEP);
    assert_matches!(outcome, Err(ArmError::Restarted { .. }));
    assert_matches!(resident.move_by(STEP), Err(ArmError::Setting { .. }));
    drop(resident);
    judge(&mut client, start, &outcome, "restart");
    assert!(client.last_known().is_none());
    client.reconnect().unwrap();
    client.calibrate().unwrap();
    client
        .resident()
        .unwrap()
        .move_by(JointDelta::of(Joint::J1, -0.02))
        .unwrap();
}

#[test]
fn unasked_messages_between_and_during_its_moves() {
    for text in [
        "\r\nBreak time\r\n",
        "\r\n*Tape reader out of paper*\r\n",
        "?",
        "*\r\n",
    ] {
        let mut client = client(Profile::val2(), MoveWay::Automatic);
        let start = truth(&client);
        let mut resident = client.resident().unwrap();
        resident.line_mut().inner.emulator_mut().interject(text);
        resident.joints().unwrap();
        resident.line_mut().disturb = Some(Box::new(move |emulator: &mut Emulator| {
            emulator.interject(text);
        }));
        let outcome = resident.move_by(STEP);
        drop(resident);
        assert!(outcome.is_ok(), "{text:?}: {outcome:?}");
        judge(&mut client, start, &outcome, text);
    }
}

/// A digit changed in the one line that shows the angles is not believed, neither at the start nor
/// after a move.
#[test]
fn angles_that_were_shown_once_are_not_believed() {
    let by = JointDelta::from_degrees([0.0, 2.0, 0.0, 0.0, 0.0, 0.0]);
    let goal = Joints::from_degrees([0.0, -88.0, 90.0, 0.0, 0.0, 0.0]);

    let mut client = client(Profile::val2(), MoveWay::Automatic);
    client.execute("NOTHING").unwrap_err();
    let begun = client.line().inner.traffic();
    // Behind the listing of the program nothing shows this but its first answer.
    client.line_mut().forge = Some(("-90.000", "-80.000"));
    let mut resident = client.resident().unwrap();
    assert!(resident.line().forge.is_none() && resident.line().inner.traffic() > begun);
    let reached = resident.move_by(by).unwrap();
    assert!(off(reached, goal) < 1e-3);
    resident.line_mut().forge = Some(("-86.000", "-36.000"));
    let reached = resident.move_by(by).unwrap();
    assert!(off(reached, goal + by) < 1e-3 && resident.line().forge.is_none());
    resident.line_mut().forge = Some(("-86.000", "-86.020"));
    let shown = resident.joints().unwrap();
    assert!(off(shown, goal + by) < 1e-3 && resident.line().forge.is_none());
    resident.end().unwrap();
    assert!(off(truth(&client), goal + by) < 1e-6);
    assert_not_misled(&client, "end");
}
