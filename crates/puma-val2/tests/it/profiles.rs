//! The client against controllers that answer otherwise: random profiles, seeded.

use std::collections::BTreeMap;
use std::time::Duration;

use puma_val2::{
    ClientConfig, Emulator, Gripper, JointDelta, Joints, Manipulator, MemoryLine, Message, Profile,
    PumaParams, Val2Client,
};
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

fn random_profile(random: &mut Xoshiro256PlusPlus) -> Profile {
    let mut yes = |chance: f64| random.random_bool(chance);
    let mut boot = Vec::new();
    if yes(0.6) {
        let mark = if yes(0.5) { "VAL" } else { "VAL-II" };
        let blank = if mark == "VAL" { " " } else { "" };
        boot.push(format!("Load {mark} from floppy (Y/N)?{blank}"));
    }
    if yes(0.7) {
        let ask = yes(0.5);
        let text = if ask {
            "Initialize (Y/N)? "
        } else {
            "INITIALIZE (Y/N)?\r\n"
        };
        boot.push(text.to_owned());
    }
    if yes(0.2) {
        boot.reverse();
    }
    let mut messages = BTreeMap::new();
    if yes(0.3) {
        messages.insert(Message::AreYouSure, "ARE YOU SURE".into());
        messages.insert(Message::AnswerYesOrNo, "Choose one of: Y or N".into());
        messages.insert(Message::InvalidArgument, "Bad value".into());
    }
    Profile {
        boot,
        banner: if yes(0.5) {
            "UNIMATION VAL II  560.1.4B".into()
        } else {
            String::new()
        },
        echo: yes(0.7),
        eol: if yes(0.8) { "\r\n" } else { "\n\r" },
        blank_lines: usize::from(yes(0.3)) + usize::from(yes(0.3)),
        joints_first: !yes(0.7),
        joint_heading: if yes(0.7) { "JT" } else { "J" },
        hand_column: yes(0.3),
        change_text: ["Change?", "CHANGES?", "Change (Y/N)?"]
            [usize::from(yes(0.5)) + usize::from(yes(0.3))]
        .into(),
        do_blocks: yes(0.7),
        stop_while_busy: yes(0.7),
        ppoint: yes(0.6),
        react_at_monitor: yes(0.5),
        control_characters: yes(0.7),
        messages,
        start_power: yes(0.5).then_some(true),
        baud: yes(0.4).then_some(9600),
        line_time: if yes(0.4) {
            Duration::from_millis(40)
        } else {
            Duration::ZERO
        },
        encoder_counts: yes(0.3),
        width: 8 + usize::from(yes(0.5)) * 3,
        angle_decimals: 2 + usize::from(yes(0.7)),
        max_name: 6,
        ..Profile::val2()
    }
}

#[test]
fn a_session_with_three_hundred_controllers() {
    for seed in 0..300 {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let profile = random_profile(&mut random);
        let context = format!("seed {seed}: {profile:?}");
        let echo = profile.echo;
        let line = MemoryLine::new(Emulator::new(PumaParams::unimation(), profile));
        let mut client = Val2Client::connect(line, ClientConfig::default())
            .unwrap_or_else(|e| panic!("{context}: {e}"));
        assert_eq!(client.echoes(), echo, "{context}");
        client
            .calibrate()
            .unwrap_or_else(|e| panic!("{context}: {e}"));
        let mut at = client.joints().unwrap_or_else(|e| panic!("{context}: {e}"));
        for _ in 0..4 {
            let mut delta = JointDelta::default();
            for i in 0..3 {
                if random.random_bool(0.7) {
                    delta.0[i] = random.random_range(-0.15..0.15);
                }
            }
            let reached = client
                .move_by(delta)
                .unwrap_or_else(|e| panic!("{context}: {e}"));
            let truth = client.line().emulator().joints();
            for error in [(at + delta) - truth, reached - truth] {
                assert!(
                    error.degrees().iter().all(|d| d.abs() < 0.03),
                    "{context}: {error:?}"
                );
            }
            at = reached;
        }
        let home = Joints::from_degrees([10.0, -80.0, 100.0, 5.0, 30.0, -5.0]);
        client
            .move_to(home)
            .unwrap_or_else(|e| panic!("{context}: {e}"));
        client
            .set_gripper(Gripper::Closed)
            .unwrap_or_else(|e| panic!("{context}: {e}"));
        assert_eq!(client.line().emulator().gripper(), Gripper::Closed);
        client
            .arm_proximity(1001)
            .unwrap_or_else(|e| panic!("{context}: {e}"));
        client
            .line_mut()
            .emulator_mut()
            .attach_sensor(1001, |joints| joints.degrees()[0] > 20.0)
            .unwrap();
        let stopped = client.move_by(JointDelta::from_degrees([40.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
        assert_matches!(
            stopped,
            Err(puma_val2::ArmError::ProximityStop { .. }),
            "{context}"
        );
    }
}
