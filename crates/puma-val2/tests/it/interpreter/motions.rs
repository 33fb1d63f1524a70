//! Motions of the arm and the hand, and their speeds.

use std::time::Duration;

use puma_val2::{Gripper, Place, Profile, Xyzoat};

use crate::console::Console;

#[test]
fn joint_moves() {
    let mut console = Console::ready();
    console.line("DO DRIVE 1,30,100");
    console.assert_at([30.0, -90.0, 90.0, 0.0, 0.0, 0.0]);
    console.line("DO DRIVE 1,-10,100");
    console.assert_at([20.0, -90.0, 90.0, 0.0, 0.0, 0.0]);
    console.line("DO MOVE #PPOINT(,-80,100,10,20,30)");
    console.assert_at([0.0, -80.0, 100.0, 10.0, 20.0, 30.0]);
    console.line("DO HERE #A");
    console.line("DO READY");
    console.assert_at([0.0, -90.0, 90.0, 0.0, 0.0, 0.0]);
    console.line("DO MOVE #A");
    console.assert_at([0.0, -80.0, 100.0, 10.0, 20.0, 30.0]);
    console.line("DO NEST");
    console.assert_at(Profile::val2().nest.degrees());
    console.lines("DO MOVE #A\nDO HERE P\nDO DRIVE 2,20,100\nDO MOVE P");
    console.assert_at([0.0, -80.0, 100.0, 10.0, 20.0, 30.0]);
}

/// The hand now, millimetres and degrees.
fn hand(console: &Console) -> [f64; 6] {
    let emulator = &console.emulator;
    Xyzoat::from_pose(&emulator.params().forward(&emulator.joints())).val()
}

fn near(a: [f64; 6], b: [f64; 6]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-3)
}

#[test]
fn moves_of_the_hand() {
    let mut console = Console::ready();
    console.line("DO MOVE #PPOINT(0,-45,180,0,45,0)");
    let start = hand(&console);
    console.line("DO SET P = HERE");
    let [x, y, z, o, a, t] = start;
    console.line("DO DRAW -50,20,30");
    assert!(
        near(hand(&console), [x - 50.0, y + 20.0, z + 30.0, o, a, t]),
        "{:?}",
        hand(&console)
    );
    console.line("DO MOVES P");
    assert!(near(hand(&console), start));
    // The tool points down: back along it is up.
    console.line("DO DEPART 40");
    assert!(near(hand(&console), [x, y, z + 40.0, o, a, t]));
    console.line("DO APPROS P,25");
    assert!(near(hand(&console), [x, y, z + 25.0, o, a, t]));
    console.line("DO DEPARTS -25");
    assert!(near(hand(&console), start));
    console.line("DO APPRO P,10");
    console.line("DO MOVE P:TRANS(0,0,-30,90,-90)");
    assert!(near(hand(&console), [x, y, z + 30.0, o, a, t]));
    console.line("DO MOVE SHIFT(P BY ,,12)");
    assert!(near(hand(&console), [x, y, z + 12.0, o, a, t]));
    console.line("DO MOVE TRANS(400,200,300,60,70,10)");
    assert!(near(
        hand(&console),
        [400.0, 200.0, 300.0, 60.0, 70.0, 10.0]
    ));
    console.line("DO ALIGN");
    assert!(
        (hand(&console)[4] - 90.0).abs() < 1e-6,
        "{:?}",
        hand(&console)
    );
    console.line("DO SET Q = INVERSE(P):P");
    let Some(Place::Transformation(unit)) = console.emulator.place("Q") else {
        panic!("Q is no transformation")
    };
    assert!((unit.to_homogeneous() - nalgebra::Matrix4::identity()).amax() < 1e-12);
    console.line("DO SET F = FRAME(TRANS(),TRANS(0,10),TRANS(-10),TRANS(1,2,3))");
    let Some(Place::Transformation(frame)) = console.emulator.place("F") else {
        panic!("F is no transformation")
    };
    assert!((frame * nalgebra::Vector3::x() - nalgebra::Vector3::y()).amax() < 1e-12);
    assert!(
        (frame.translation.vector * 1000.0 - nalgebra::Vector3::new(1.0, 2.0, 3.0)).amax() < 1e-12
    );
}

#[test]
fn a_straight_line_is_straight_and_keeps_its_direction() {
    let mut console = Console::ready();
    console.line("DO MOVE #PPOINT(0,-45,180,0,45,0)");
    let params = *console.emulator.params();
    let from = params.forward(&console.emulator.joints());
    console.line_now("DO DRAW -200,100,150");
    let along = nalgebra::Vector3::new(-0.2, 0.1, 0.15).normalize();
    let (mut seen, mut fastest) = (0, 0.0_f64);
    let mut last = from.translation.vector;
    while console.emulator.moving() {
        console.wait(Duration::from_millis(10));
        let now = params.forward(&console.emulator.joints());
        let off = now.translation.vector - from.translation.vector;
        let aside = (off - along * along.dot(&off)).norm();
        assert!(aside < 5e-5, "{aside}");
        assert!(now.rotation.angle_to(&from.rotation) < 1e-4);
        fastest = fastest.max((now.translation.vector - last).norm() / 0.01);
        last = now.translation.vector;
        seen += 1;
    }
    assert!(
        seen > 20 && fastest < 0.505 && fastest > 0.4,
        "{seen} {fastest}"
    );
}

#[test]
fn a_straight_line_that_leaves_the_reach_stops_or_never_starts() {
    // Straight through the column: both ends are reachable, the middle is not.
    let steps = "DO MOVE TRANS(500,50,300,90,90,0)\nDO MOVES TRANS(-500,50,300,90,90,0)";
    let mut console = Console::ready();
    assert!(
        console.lines(steps).contains("*Location"),
        "{}",
        console.screen
    );
    assert!(hand(&console)[0] < 499.0);
    let profile = Profile {
        check_line_ahead: true,
        ..Profile::val2()
    };
    let mut console = Console::ready_with(profile);
    assert!(console.lines(steps).contains("*Location"));
    assert!(near(hand(&console), [500.0, 50.0, 300.0, 90.0, 90.0, 0.0]));
}

#[test]
fn posture_words_hold_for_the_next_move() {
    let mut console = Console::ready_with(Profile {
        keeps_posture: true,
        ..Profile::val2()
    });
    console.line("DO MOVE #PPOINT(90,-60,150,-20,40,0)");
    let pose = hand(&console);
    let posture = |c: &Console| {
        c.emulator
            .params()
            .configuration(&c.emulator.joints())
            .to_string()
    };
    console.line("DO HERE P");
    assert_eq!(posture(&console), "LEFTY ABOVE NOFLIP");
    for (words, wanted) in [
        ("FLIP", "LEFTY ABOVE FLIP"),
        ("NOFLIP", "LEFTY ABOVE NOFLIP"),
        ("BELOW", "LEFTY BELOW NOFLIP"),
        ("ABOVE", "LEFTY ABOVE NOFLIP"),
        ("RIGHTY", "RIGHTY ABOVE NOFLIP"),
    ] {
        let said = console.lines(&format!("DO {words}\nDO MOVE P"));
        assert!(!said.contains('*'), "{words}: {said}");
        assert_eq!(posture(&console), wanted);
        assert!(near(hand(&console), pose));
    }
}

#[test]
fn tool_and_base_shift_what_is_shown() {
    let mut console = Console::ready();
    let shown = console.line("WHERE");
    assert!(shown.contains("-20.32   149.09   921.12"));
    console.line("TOOL TRANS(0,0,100,90,-90,0)");
    assert!(console.line("WHERE").contains("-20.32   149.09  1021.12"));
    console.line("BASE ,,300");
    assert!(console.line("WHERE").contains("-20.32   149.09  1321.12"));
    console.line("BASE");
    console.line("DO TOOL NULL");
    assert_eq!(console.line("WHERE"), shown);
    console.line("DO BASE 10,,,90");
    // A quarter turn takes (-20.32, 149.09) to (-149.09, -20.32), and 10 along x is added.
    assert!(console.line("WHERE").contains("-139.09   -20.32"));
}

#[test]
fn hands_open_and_close_at_once_or_with_the_next_motion() {
    let mut console = Console::ready();
    console.line("DO CLOSEI");
    assert_eq!(console.emulator.gripper(), Gripper::Closed);
    console.line("DO OPEN");
    assert_eq!(console.emulator.gripper(), Gripper::Closed);
    console.line("DO READY");
    assert_eq!(console.emulator.gripper(), Gripper::Open);
    console.lines("DO CLOSE\nDO DRIVE 1,1,100");
    assert_eq!(console.emulator.gripper(), Gripper::Closed);
    console.line("DO RELAXI");
    assert_eq!(console.emulator.gripper(), Gripper::Open);
    console.line("DO GRASP");
    assert_eq!(console.emulator.gripper(), Gripper::Closed);
    console.line("DO MOVET #PPOINT(0,-90,90),50");
    assert_eq!(console.emulator.gripper(), Gripper::Open);
    console
        .lines("DO MOVE #PPOINT(0,-45,180,0,45,0)\nDO HERE P\nDO MOVEST P:TRANS(10,0,0,90,-90),0");
    assert_eq!(console.emulator.gripper(), Gripper::Closed);
}

/// The time a line takes until the prompt.
fn duration(console: &mut Console, line: &str) -> f64 {
    let begun = console.now;
    console.line(line);
    (console.now - begun).as_secs_f64()
}

#[test]
fn speeds_multiply() {
    let mut console = Console::ready();
    let full = duration(&mut console, "DO DRIVE 1,82,100");
    assert!((full - 1.25).abs() < 0.01, "{full}");
    assert!((duration(&mut console, "DO DRIVE 1,-82,50") - 2.125).abs() < 0.01);
    console.line("SPEED 50");
    assert!((duration(&mut console, "DO DRIVE 1,82,50") - 4.0625).abs() < 0.01);
    console.line("DO SPEED 20");
    let slow = duration(&mut console, "DO MOVE #PPOINT(0,-90,90)");
    let again = duration(&mut console, "DO MOVE #PPOINT(82,-90,90)");
    assert!(slow > 9.9 && again < 2.2, "{slow} {again}");
    console.line("DO SPEED 10 ALWAYS");
    assert!(duration(&mut console, "DO DRIVE 1,-8.2,10") > 2.0);
    assert!(duration(&mut console, "DO MOVE #PPOINT(0,-90,90)") > 15.0);
    console.lines(
        "SPEED 100\nDO SPEED 100 ALWAYS\nDO MOVE #PPOINT(0,-45,180,0,45,0)\nDO SPEED 50 MMPS",
    );
    let line = duration(&mut console, "DO DRAW ,,100");
    assert!((line - 2.0).abs() < 0.3, "{line}");
    console.line("DO SPEED 2 IPS");
    assert!((duration(&mut console, "DO DRAW ,,-101.6") - 2.0).abs() < 0.3);
}

#[test]
fn delays_and_settling_words() {
    let mut console = Console::ready();
    assert!((duration(&mut console, "DO DELAY 2.5") - 2.5).abs() < 0.01);
    for word in [
        "COARSE",
        "FINE ALWAYS",
        "NULL",
        "NONULL",
        "INTON",
        "INTOFF ALWAYS",
        "BREAK",
        "RESET",
    ] {
        assert!(!console.line(&format!("DO {word}")).contains('*'), "{word}");
    }
}

#[test]
fn a_motion_starts_and_the_program_goes_on_until_the_next() {
    let mut console = Console::ready();
    console.program(
        "TWO",
        "MOVE #PPOINT(40,-90,90)\nTYPE \"away\"\nBREAK\nTYPE \"there\"\nMOVE #PPOINT(0,-90,90)",
    );
    console.line_now("EXECUTE TWO");
    let said = console.wait(Duration::from_millis(50));
    assert!(said.contains("away") && console.emulator.moving() && !said.contains("there"));
    console.settle();
    assert!(console.screen.ends_with("there\r\nProgram completed\r\n."));
    console.assert_at([0.0, -90.0, 90.0, 0.0, 0.0, 0.0]);
}
