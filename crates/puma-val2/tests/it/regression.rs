//! Faults from the field, one test each.

use std::time::Duration;

use crate::faults::line::{Damage, FaultyLine, Way};
use puma_val2::{
    ArmError, ClientConfig, Emulator, Joint, Joints, Manipulator, MemoryLine, Profile, PumaParams,
    Val2Client,
};

/// A line to a controller that is calibrated and has been typed these lines.
fn line_after(profile: Profile, lines: &str) -> MemoryLine {
    let mut emulator = Emulator::new(PumaParams::unimation(), profile);
    emulator.feed(b"N\rN\rCAL\rY\r", Duration::ZERO);
    emulator.feed(lines.as_bytes(), Duration::from_secs(10));
    emulator.poll(Duration::from_secs(11));
    MemoryLine::new(emulator)
}

/// A line to a controller on which a program without end moves the arm.
fn running(lines: &str) -> MemoryLine {
    let mut line = line_after(Profile::val2(), lines);
    let text = ".PROGRAM W\n 10 MOVE #PPOINT(40,-90,90)\n MOVE #PPOINT(0,-90,90)\n GOTO 10\n.END";
    line.emulator_mut().load_text(text).unwrap();
    let now = line.emulator().now();
    line.emulator_mut().feed(b"EXECUTE W\r", now);
    line
}

fn waist(line: &MemoryLine) -> f64 {
    line.emulator().joints().degrees()[0]
}

#[test]
fn looking_at_a_moving_arm_does_not_stop_it() {
    for profile in Profile::all() {
        let line = line_after(profile, "SPEED 10\rDO DRIVE 1,60,100\r");
        assert!(line.emulator().moving());
        let mut client = Val2Client::connect(line, ClientConfig::default()).unwrap();
        client.joints().unwrap();
        assert!((waist(client.line()) - 60.0).abs() < 0.01);
    }
}

#[test]
fn a_running_program_and_the_speed_survive_a_connection() {
    let line = running("SPEED 7\r");
    let mut client = Val2Client::connect(line, ClientConfig::default()).unwrap();
    client.joints().unwrap();
    let status = client.send_line("STATUS").unwrap();
    assert!(
        status.contains("MONITOR SPEED 7") && status.contains("PROGRAM W"),
        "{status}"
    );
    assert_matches!(client.ready(), Err(ArmError::Refused { .. }));
    assert!(client.line().emulator().moving());
}

const PICKS: &str = ".PROGRAM PICK1\n MOVE #PPOINT(10,-90,90)\n.END\n\
    .PROGRAM PICK3\n MOVE #PPOINT(99,-90,90)\n.END\n";

/// A client of a controller that holds the programs of [`PICKS`], on a line that can be damaged.
fn picking(echo: bool) -> Val2Client<FaultyLine> {
    let profile = Profile {
        echo,
        ..Profile::val2()
    };
    let mut line = FaultyLine::new(Emulator::new(PumaParams::unimation(), profile.clone()));
    line.inner = line_after(profile, "");
    line.inner.emulator_mut().load_text(PICKS).unwrap();
    Val2Client::connect(line, ClientConfig::for_emulator()).unwrap()
}

#[test]
fn a_damaged_name_starts_no_other_program_without_an_echo() {
    for at in 0.. {
        let mut client = picking(false);
        // The 1 of PICK1 becomes a 3.
        client
            .line_mut()
            .strike(Way::ToController, at, Damage::Flipped(1));
        let outcome = if at % 2 == 0 {
            client.execute("PICK1").map(drop)
        } else {
            client.start("PICK1", 1)
        };
        let struck = client.line().struck;
        client.line_mut().heal();
        if outcome.is_ok() {
            while client.line().inner.emulator().moving() {
                client.joints().unwrap();
            }
        }
        let waist = client.line().inner.emulator().joints().degrees()[0];
        assert!(waist < 10.1, "character {at}: {waist} after {outcome:?}");
        if !struck {
            assert!(waist > 9.9, "{outcome:?}");
            break;
        }
    }
}

#[test]
fn a_program_that_may_run_is_reported_as_such() {
    let mut client = picking(true);
    // The end of the line is heard, nothing more.
    let line = client.line_mut();
    line.strike(
        Way::FromController,
        "EXECUTE PICK1,1 \r\n".len(),
        Damage::Cut,
    );
    let outcome = client.start("PICK1", 1);
    assert_matches!(outcome, Err(ArmError::Unconfirmed { .. }));
    assert!(outcome.unwrap_err().to_string().contains("may be moving"));
}

#[test]
fn a_line_that_fails_once_leaves_no_half_of_the_programs() {
    let new = PICKS.replace("90)", "80)");
    let (mut old_ones, mut new_ones) = (0, 0);
    for number in (0..).step_by(7) {
        let mut client = picking(true);
        client.line_mut().fails_once = Some(number);
        let outcome = client.restore(&new, true);
        let spent = client.line().fails_once.is_none();
        client.line_mut().fails_once = None;
        client.reconnect().unwrap();
        let [one, three] = ["PICK1", "PICK3"].map(|name| client.program(name).unwrap());
        let is_new = |steps: &[String]| steps[0].contains("80)");
        assert_eq!(
            is_new(&one),
            is_new(&three),
            "receipt {number}: {outcome:?}"
        );
        assert!(is_new(&one) || outcome.is_err());
        assert_eq!(
            client.programs().unwrap(),
            ["PICK1", "PICK3"],
            "receipt {number}"
        );
        *(if is_new(&one) {
            &mut new_ones
        } else {
            &mut old_ones
        }) += 1;
        if !spent {
            break;
        }
    }
    assert!(
        old_ones > 5 && new_ones > 5,
        "{old_ones} old, {new_ones} new"
    );
}

#[test]
fn a_controller_without_a_prompt_is_called_busy() {
    let line = line_after(Profile::val2(), "SPEED 1\rDO DRIVE 1,60,100\r");
    let outcome = Val2Client::connect(line, ClientConfig::default()).map(drop);
    assert_matches!(outcome, Err(ArmError::Busy { .. }));
    assert!(
        outcome
            .unwrap_err()
            .to_string()
            .contains("press the emergency stop")
    );
}

#[test]
fn a_fresh_process_stops_a_moving_arm() {
    for (profile, control_characters, heard) in [
        (Profile::val2(), true, true),
        (Profile::val2(), false, true),
        (Profile::val2_hardware(), true, true),
        (Profile::val2_strict_miz(), false, false),
    ] {
        for motion in ["DO DRIVE 1,60,100\r", "DO DRIVE 1,60,100\rDO DRIVE 2,40,"] {
            let mut line = line_after(profile.clone(), &format!("SPEED 10\r{motion}"));
            let config = ClientConfig {
                control_characters,
                ..ClientConfig::default()
            };
            let outcome = Val2Client::stop_on(&mut line, config);
            assert_eq!(outcome.is_ok(), heard, "{} {outcome:?}", profile.name);
            assert_eq!(line.emulator().moving(), !heard);
            assert!(waist(&line) < 40.0);
        }
    }
}

#[test]
fn a_fresh_process_stops_a_running_program() {
    let mut line = running("");
    Val2Client::stop_on(&mut line, ClientConfig::default()).unwrap();
    let mut client = Val2Client::connect(line, ClientConfig::default()).unwrap();
    let status = client.send_line("STATUS").unwrap();
    assert!(
        status.contains("NO PROGRAM") && !client.line().emulator().moving(),
        "{status}"
    );
}

#[test]
fn a_slow_move_is_given_its_time() {
    let line = line_after(Profile::val2(), "SPEED 1\r");
    let mut client = Val2Client::connect(line, ClientConfig::default()).unwrap();
    client.joints().unwrap();
    let sent = client.line().traffic().0;
    client.drive(Joint::J1, 90_f64.to_radians(), 100.0).unwrap();
    assert!((waist(client.line()) - 90.0).abs() < 0.01);
    let typed = client.line().traffic().0 - sent;
    assert!(typed < 60, "{typed} characters");
}

#[test]
fn an_overdue_move_names_its_setting_without_line_ends() {
    let line = line_after(Profile::val2(), "");
    let config = ClientConfig {
        speed_percent: Some(100.0),
        ..ClientConfig::default()
    };
    let mut client = Val2Client::connect(line, config).unwrap();
    client.joints().unwrap();
    // Somebody else makes the controller slower than this client knows.
    let now = client.line().emulator().now();
    client.line_mut().emulator_mut().feed(b"SPEED 0.1\r", now);
    let error = client.move_to(Joints::from_degrees([90.0, -90.0, 90.0, 0.0, 0.0, 0.0]));
    let text = error.unwrap_err().to_string();
    assert!(text.contains("`motion_timeout`"), "{text}");
    assert!(text.matches("\\n").count() < 4, "{text}");
    assert!(!client.line().emulator().moving());
}

#[test]
fn lines_of_any_speed_connect_with_defaults() {
    for baud in [110, 150, 300, 600, 1200, 2400, 4800, 9600] {
        let profile = Profile {
            baud: Some(baud),
            ..Profile::val2()
        };
        let line = MemoryLine::new(Emulator::new(PumaParams::unimation(), profile));
        let mut client = Val2Client::connect(line, ClientConfig::for_baud(baud))
            .unwrap_or_else(|error| panic!("{baud} baud: {error}"));
        client.calibrate().unwrap();
        client.drive(Joint::J1, 0.3, 100.0).unwrap();
        client.ready().unwrap();
    }
}

#[test]
fn a_program_that_asks_is_left_alone_at_connection() {
    let mut line = line_after(Profile::val2(), "");
    let text = ".PROGRAM ASK\n PROMPT \"angle? \",A\n DRIVE 1,A,100\n.END";
    line.emulator_mut().load_text(text).unwrap();
    let now = line.emulator().now();
    line.emulator_mut().feed(b"EXECUTE ASK\r", now);
    let outcome = Val2Client::connect(&mut line, ClientConfig::default()).map(drop);
    assert_matches!(outcome, Err(ArmError::Asked { question, .. }) if question.contains("angle"));
    line.emulator_mut()
        .feed(b"5\r", now + Duration::from_secs(60));
    line.emulator_mut().poll(now + Duration::from_secs(90));
    assert!((waist(&line) - 5.0).abs() < 0.01);
}

#[test]
fn an_arm_pushed_beyond_a_limit_can_come_back_by_any_amount() {
    let mut line = line_after(Profile::val2(), "");
    let pushed = Joints::from_degrees([161.0, -90.0, 90.0, 0.0, 0.0, 0.0]);
    line.emulator_mut().place_arm(pushed);
    let mut client = Val2Client::connect(line, ClientConfig::default()).unwrap();
    let outwards = client.drive(Joint::J1, 0.01, 100.0);
    assert_matches!(outwards, Err(ArmError::JointLimit { .. }));
    for degrees in [-0.5_f64, -0.5, -10.0] {
        client
            .drive(Joint::J1, degrees.to_radians(), 100.0)
            .unwrap();
    }
    assert!((waist(client.line()) - 150.0).abs() < 0.01);
}
