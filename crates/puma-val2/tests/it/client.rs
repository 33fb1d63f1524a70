//! The client against an emulator in memory.

use std::time::Duration;

use puma_val2::{
    ArmError, ClientConfig, Emulator, Gripper, Joint, JointDelta, Joints, Manipulator, MemoryLine,
    MoveWay, Profile, PumaParams, Val2Client,
};

fn emulator(profile: Profile) -> Emulator {
    Emulator::new(PumaParams::unimation(), profile)
}

fn client(profile: Profile) -> Val2Client<MemoryLine> {
    let mut client =
        Val2Client::connect(MemoryLine::new(emulator(profile)), ClientConfig::default()).unwrap();
    client.calibrate().unwrap();
    client
}

fn assert_at(client: &Val2Client<MemoryLine>, degrees: [f64; 6]) {
    let off = client.line().emulator().joints() - Joints::from_degrees(degrees);
    assert!(
        off.degrees().iter().all(|d| d.abs() < 0.02),
        "{} instead of {degrees:?}",
        client.line().emulator().joints()
    );
}

#[test]
fn every_profile_and_every_way_moves_the_arm_where_it_was_sent() {
    let unblocked = Profile {
        name: "does not block",
        do_blocks: false,
        ..Profile::val2()
    };
    for profile in Profile::all().into_iter().chain([unblocked]) {
        for way in [MoveWay::Automatic, MoveWay::Drive, MoveWay::Point] {
            let config = ClientConfig {
                way,
                ..ClientConfig::default()
            };
            let line = MemoryLine::new(emulator(profile.clone()));
            let mut client = Val2Client::connect(line, config).unwrap();
            client.calibrate().unwrap();
            client
                .move_by(JointDelta::from_degrees([10.0, 5.0, 5.0, 0.0, 0.0, 0.0]))
                .unwrap_or_else(|e| panic!("{} {way:?}: {e}", profile.name));
            assert_at(&client, [10.0, -85.0, 95.0, 0.0, 0.0, 0.0]);
            client
                .move_to(Joints::from_degrees([
                    -20.0, -100.0, 100.0, 10.0, 45.0, -30.0,
                ]))
                .unwrap();
            assert_at(&client, [-20.0, -100.0, 100.0, 10.0, 45.0, -30.0]);
            client.drive(Joint::J3, -0.1, 100.0).unwrap();
            client.ready().unwrap();
            assert_at(&client, [0.0, -90.0, 90.0, 0.0, 0.0, 0.0]);
        }
    }
}

#[test]
fn the_hand_opens_and_closes() {
    let mut client = client(Profile::val2());
    client.set_gripper(Gripper::Closed).unwrap();
    assert_eq!(client.line().emulator().gripper(), Gripper::Closed);
    client.set_gripper(Gripper::Open).unwrap();
    assert_eq!(client.line().emulator().gripper(), Gripper::Open);
}

#[test]
fn moves_out_of_range_are_refused_before_anything_is_sent() {
    let mut client = client(Profile::val2());
    client.joints().unwrap();
    let before = client.line().traffic();
    let out = JointDelta::from_degrees([0.0, 0.0, 136.0, 0.0, 0.0, 0.0]);
    assert_matches!(
        client.move_by(out),
        Err(ArmError::JointLimit { joint: Joint::J3, wanted_degrees, max_degrees, .. })
            if (wanted_degrees - 226.0).abs() < 1e-9 && (max_degrees - 225.0).abs() < 1e-9
    );
    assert_matches!(
        client.drive(Joint::J2, f64::NAN, 100.0),
        Err(ArmError::NotFinite {
            joint: Joint::J2,
            ..
        })
    );
    assert_matches!(
        client.drive(Joint::J2, 0.1, 0.0),
        Err(ArmError::Setting { .. })
    );
    assert_matches!(
        client.set_speed(f64::INFINITY),
        Err(ArmError::Setting { .. })
    );
    let mut nowhere = Joints::default();
    nowhere.0[5] = f64::INFINITY;
    assert_matches!(
        client.move_to(nowhere),
        Err(ArmError::NotFinite {
            joint: Joint::J6,
            ..
        })
    );
    assert_eq!(client.line().traffic(), before);
}

#[test]
fn arm_power_off_is_reported_and_waited_for_if_so_configured() {
    let line = || {
        let mut emulator = emulator(Profile::val2());
        emulator.set_arm_power(false);
        MemoryLine::new(emulator)
    };
    let mut client = Val2Client::connect(line(), ClientConfig::default()).unwrap();
    assert_matches!(
        client.calibrate(),
        Err(ArmError::Refused { message, .. }) if message == "Arm power off"
    );
    let patient = ClientConfig {
        power_retries: 2,
        power_retry_delay: Duration::from_secs(5),
        ..ClientConfig::default()
    };
    let mut client = Val2Client::connect(line(), patient).unwrap();
    let begun = client.line().emulator().now();
    assert!(client.calibrate().is_err());
    assert!(client.line().emulator().now() - begun > Duration::from_secs(10));
    client.line_mut().emulator_mut().set_arm_power(true);
    client.calibrate().unwrap();
}

#[test]
fn a_half_typed_line_is_never_carried_out() {
    let mut line = MemoryLine::new(emulator(Profile::val2()));
    {
        use puma_val2::Transport;
        line.send(b"N\rN\rCAL\rY\r").unwrap();
        let mut buffer = [0; 4096];
        while line
            .receive(&mut buffer, Duration::from_secs(10))
            .unwrap()
            .is_some()
        {}
        line.send(b"DO DRIVE 1,50,100").unwrap();
    }
    let client = Val2Client::connect(line, ClientConfig::default()).unwrap();
    assert_at(&client, [0.0, -90.0, 90.0, 0.0, 0.0, 0.0]);
}

#[test]
fn silence_and_garbage_are_told_apart_in_time() {
    struct Dead(Duration, &'static [u8]);
    impl puma_val2::Transport for Dead {
        fn send(&mut self, _: &[u8]) -> std::io::Result<()> {
            Ok(())
        }
        fn receive(
            &mut self,
            buffer: &mut [u8],
            timeout: Duration,
        ) -> std::io::Result<Option<usize>> {
            self.0 += timeout.min(Duration::from_millis(10));
            let count = self.1.len().min(buffer.len());
            buffer[..count].copy_from_slice(&self.1[..count]);
            if count == 0 {
                self.0 += timeout;
            }
            Ok((count > 0).then_some(count))
        }
        fn clock(&self) -> Duration {
            self.0
        }
        fn name(&self) -> &str {
            "/dev/nothing"
        }
    }
    let silent = Val2Client::connect(Dead(Duration::ZERO, b""), ClientConfig::default()).map(drop);
    assert_matches!(
        &silent,
        Err(ArmError::Silence { port, waited, .. })
            if port == "/dev/nothing" && waited.as_secs() == 10
    );
    for noise in [&b"\xff\x00\x81"[..], b"login: ", b"42 "] {
        let garbled =
            Val2Client::connect(Dead(Duration::ZERO, noise), ClientConfig::default()).map(drop);
        assert_matches!(garbled, Err(ArmError::Garbled { .. }), "{noise:?}");
    }
}

#[test]
fn the_hand_moves_to_its_pose_interpolated_or_straight() {
    let mut client = client(Profile::val2());
    client
        .move_to(Joints::from_degrees([0.0, -45.0, 180.0, 0.0, 45.0, 0.0]))
        .unwrap();
    let start = client.where_().unwrap();
    for straight in [false, true] {
        let mut there = start.hand;
        there.x -= 0.05;
        there.z += 0.08;
        let reached = client.move_hand(&there, straight).unwrap();
        assert!((reached.hand.z - there.z).abs() < 2e-5);
        client.move_hand(&start.hand, straight).unwrap();
    }
    let mut far = start.hand;
    far.x = 3.0;
    assert_matches!(
        client.move_hand(&far, false),
        Err(ArmError::Refused { message, .. }) if message == "Location out of range"
    );
    far.x = f64::NAN;
    assert_matches!(client.move_hand(&far, false), Err(ArmError::Setting { .. }));
}

#[test]
fn a_tool_makes_the_position_be_read_twice_once() {
    let mut client = client(Profile::val2());
    client
        .line_mut()
        .emulator_mut()
        .load_text(".PROGRAM T\n TOOL TRANS(0,0,120,90,-90,0)\n.END")
        .unwrap();
    client.execute("T").unwrap();
    let location = client.where_().unwrap();
    assert!((location.hand.z - 1.04112).abs() < 1e-5);
    assert!(client.take_notices()[0].contains("TOOL"));
    let sent = client.line().traffic().0;
    client.where_().unwrap();
    assert_eq!(
        client.line().traffic().0 - sent,
        6,
        "WHERE and its end, once"
    );
    client
        .move_by(JointDelta::from_degrees([3.0, 4.0, -5.0, 0.0, 0.0, 0.0]))
        .unwrap();
    assert_at(&client, [3.0, -86.0, 85.0, 0.0, 0.0, 0.0]);
}

#[test]
fn programs_are_stored_run_and_aborted() {
    let mut client = client(Profile::val2());
    let steps = ["FOR I = 1 TO 2", "TYPE I", "END"].map(str::to_owned);
    client.store_program("COUNT", &steps).unwrap();
    let said = client.execute("COUNT").unwrap();
    assert!(
        said.contains(" 1") && said.contains(" 2") && said.contains("completed"),
        "{said}"
    );
    assert_matches!(client.execute("NOTHING"), Err(ArmError::Refused { .. }));
    client
        .store_program("COUNT", &["WAIT SIG(1001)".to_owned()])
        .unwrap();
    assert_matches!(client.execute("COUNT"), Err(ArmError::Silence { .. }));
    client.joints().unwrap();
}

#[test]
fn a_running_program_is_aborted_at_connection_if_asked() {
    let running = || {
        let mut emulator = emulator(Profile::val2());
        emulator
            .load_text(".PROGRAM W\n 10 WAIT SIG(1001)\n GOTO 10\n.END")
            .unwrap();
        emulator.feed(b"N\rN\rEXECUTE W\r", Duration::ZERO);
        MemoryLine::new(emulator)
    };
    let firm = ClientConfig {
        abort_running_program: true,
        ..ClientConfig::default()
    };
    let mut client = Val2Client::connect(running(), firm).unwrap();
    client.calibrate().unwrap();
}

#[test]
fn any_dialogue_is_left_at_connection() {
    for lines in [
        "N\rN\rPOINT #A\r",
        "N\rN\rEDIT P\rMOVE Q\r",
        "N\rN\rZERO\r",
        "N\r",
        "",
    ] {
        let mut emulator = emulator(Profile::val2());
        emulator.feed(lines.as_bytes(), Duration::ZERO);
        let mut client = Val2Client::connect(MemoryLine::new(emulator), ClientConfig::default())
            .unwrap_or_else(|e| panic!("{lines:?}: {e}"));
        client.joints().unwrap();
    }
}

/// A program of somebody else's that asks for numbers is not fed with zeros, which it might move
/// by.
#[test]
fn a_program_that_asks_for_values_is_aborted_and_not_answered() {
    for words in ["angles? ", "angles "] {
        let asking = || {
            let mut emulator = emulator(Profile::val2());
            let text =
                format!(".PROGRAM ASK\n PROMPT \"{words}\",A,B,C\n MOVE #PPOINT(A,B,C)\n.END");
            emulator.load_text(&text).unwrap();
            emulator
        };
        let mut waiting = asking();
        waiting.feed(b"N\rN\rCAL\rY\r", Duration::ZERO);
        waiting.feed(b"EXECUTE ASK\r", Duration::from_secs(10));
        let firm = ClientConfig {
            abort_running_program: true,
            ..ClientConfig::default()
        };
        let mut client = Val2Client::connect(MemoryLine::new(waiting), firm).unwrap();
        client.joints().unwrap();
        assert_at(&client, [0.0, -90.0, 90.0, 0.0, 0.0, 0.0]);

        let line = MemoryLine::new(asking());
        let mut client = Val2Client::connect(line, ClientConfig::default()).unwrap();
        client.calibrate().unwrap();
        let outcome = client.execute("ASK");
        assert_matches!(
            outcome,
            Err(ArmError::Garbled { .. } | ArmError::Silence { .. })
        );
        assert!(client.last_known().is_none());
        client
            .move_by(JointDelta::from_degrees([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
            .unwrap();
        assert_at(&client, [1.0, -90.0, 90.0, 0.0, 0.0, 0.0]);
    }
}

#[test]
fn a_program_without_end_is_aborted_in_time() {
    let mut client = client(Profile::val2());
    let chatter = ["10 TYPE \"on and on and on and on and on\"", "GOTO 10"].map(str::to_owned);
    client.store_program("CHAT", &chatter).unwrap();
    let quiet = ["10 DELAY 0.2", "GOTO 10"].map(str::to_owned);
    client.store_program("QUIET", &quiet).unwrap();
    for name in ["CHAT", "QUIET"] {
        let outcome = client.execute(name);
        assert_matches!(
            outcome,
            Err(ArmError::Garbled { .. } | ArmError::Silence { .. }),
            "{name}"
        );
        client.joints().unwrap();
        client.set_gripper(Gripper::Closed).unwrap();
    }
}

/// Calibration changes what the arm shows: a move after it starts from what it shows then.
#[test]
fn calibration_forgets_where_the_arm_was() {
    let mut client = client(Profile::val2());
    client.joints().unwrap();
    let pushed = Joints::from_degrees([20.0, -80.0, 90.0, 0.0, 0.0, 0.0]);
    client.line_mut().emulator_mut().place_arm(pushed);
    client.calibrate().unwrap();
    assert!(client.last_known().is_none());
    client
        .move_by(JointDelta::from_degrees([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
        .unwrap();
    assert_at(&client, [21.0, -80.0, 90.0, 0.0, 0.0, 0.0]);
}

/// A step that the editor does not take is reported, and the editor left.
#[test]
fn a_step_that_is_refused_leaves_the_editor() {
    let mut client = client(Profile::val2());
    for bad in ["FROBNICATE 3", "IF 1 GOTO"] {
        let steps = ["TYPE 1".to_owned(), bad.to_owned()];
        let outcome = client.store_program("BAD", &steps);
        assert_matches!(&outcome, Err(ArmError::Refused { sent, .. }) if sent == bad);
        client.joints().unwrap();
        client.set_gripper(Gripper::Open).unwrap();
    }
}

/// A line end inside a name or a step would make a command of what comes after it.
#[test]
fn names_and_steps_of_several_lines_are_refused_unsent() {
    let mut client = client(Profile::val2());
    let before = client.line().traffic();
    for bad in ["", " ", "A\rDO DRIVE 1,10,100", "A\nB", "A\u{3}", "\u{c9}"] {
        let outcomes = [
            client.execute(bad).map(drop),
            client.store_program(bad, &["TYPE 1".to_owned()]),
            client.store_program("GOOD", &["TYPE 1".to_owned(), bad.to_owned()]),
        ];
        for outcome in outcomes {
            assert_matches!(outcome, Err(ArmError::Setting { .. }), "{bad:?}");
        }
    }
    assert_eq!(client.line().traffic(), before);
}

/// A line on which something is said, once, just after `WHERE` has been typed.
struct Interrupted {
    line: MemoryLine,
    words: Option<&'static str>,
}

impl puma_val2::Transport for Interrupted {
    fn send(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        self.line.send(bytes)?;
        if bytes == b"WHERE"
            && let Some(words) = self.words.take()
        {
            self.line.emulator_mut().interject(words);
        }
        Ok(())
    }
    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> std::io::Result<Option<usize>> {
        self.line.receive(buffer, timeout)
    }
    fn clock(&self) -> Duration {
        self.line.clock()
    }
    fn name(&self) -> &str {
        "interrupted"
    }
}

/// A message that arrives while the client tests for an echo is not taken for one.
#[test]
fn a_message_at_connection_is_no_echo() {
    for echo in [true, false] {
        for words in ["\r\nPAPER OUT\r\n", "*Disk error*\r\n", "?"] {
            let profile = Profile {
                echo,
                ..Profile::val2()
            };
            let line = Interrupted {
                line: MemoryLine::new(emulator(profile)),
                words: Some(words),
            };
            let mut client = Val2Client::connect(line, ClientConfig::default()).unwrap();
            assert_eq!(client.echoes(), echo, "{words:?}");
            client.calibrate().unwrap();
            client
                .move_to(Joints::from_degrees([10.0, -80.0, 90.0, 0.0, 0.0, 0.0]))
                .unwrap();
        }
    }
}

#[test]
fn what_passes_is_written_down() {
    let mut written = Vec::new();
    let line = MemoryLine::new(emulator(Profile::val2()));
    let line = puma_val2::Recorded::new(line, &mut written);
    let mut client = Val2Client::connect(line, ClientConfig::default()).unwrap();
    client.set_speed(30.0).unwrap();
    let written = String::from_utf8(written).unwrap();
    assert!(
        written.ends_with("< SPEED 30 \n> SPEED 30 \n< ^M\n> \n> ."),
        "{written}"
    );
}
