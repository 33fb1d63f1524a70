//! Every instruction and function, in stored programs and through `DO`.
#![allow(clippy::unwrap_used, clippy::panic)] // Functions that serve tests may fail as tests do.

mod console;

use std::time::Duration;

use console::Console;
use puma_val2::{Event, Gripper, Message, Place, Profile, Xyzoat};

/// What a program typed, one string a line.
fn typed(steps: &str) -> Vec<String> {
    let said = Console::ready().run(steps);
    let end = said.find("Program completed").unwrap_or_else(|| panic!("{said}"));
    said[..end]
        .lines()
        .skip(1)
        .map(|l| l.trim_start_matches('*').trim().to_owned())
        .filter(|l| !l.is_empty())
        .collect()
}

fn assert_types(steps: &str, lines: &[&str]) {
    assert_eq!(typed(steps), lines, "{steps}");
}

#[test]
fn expressions() {
    let cases = [
        ("1+2*3", "7"),
        ("(1+2)*3", "9"),
        ("2^3^2", "64"),
        ("-2^2", "-4"),
        ("7 MOD 4", "3"),
        ("10/4", "2.5"),
        ("1 < 2", "-1"),
        ("1 > 2", "0"),
        ("1 <> 2 AND 3 >= 3", "-1"),
        ("1 EQ 1", "-1"),
        ("1 NE 1", "0"),
        ("2 LE 1 OR 2 GE 1", "-1"),
        ("NOT 1 == 2", "-1"),
        ("TRUE XOR TRUE", "0"),
        ("ABS(-3)", "3"),
        ("SIN(30)", "0.5"),
        ("COS(60)", "0.5"),
        ("ATAN2(1,1)", "45"),
        ("SQRT(16)", "4"),
        ("SQR(5)", "25"),
        ("INT(-2.7)", "-2"),
        ("FRACT(2.75)", "0.75"),
        ("SIGN(-4)", "-1"),
        ("MAX(1,5,3)", "5"),
        ("MIN(4,2,3)", "2"),
        ("PI", "3.1416"),
        ("SIG(1001)", "0"),
        ("SIG(-1001)", "-1"),
        ("DX(TRANS(10,20,30))", "10"),
        ("DY(TRANS(10,20,30))", "20"),
        ("DZ(SHIFT(TRANS(10,20,30) BY 1,2,3))", "33"),
        ("DISTANCE(TRANS(0,0,0),TRANS(3,4,0))", "5"),
        (".5+.25", "0.75"),
    ];
    for (expression, value) in cases {
        assert_types(&format!("TYPE {expression}"), &[value]);
    }
}

#[test]
fn variables_and_arrays() {
    assert_types("N = 2\nA[N] = 5\nA[3] = A[2]*2\nTYPE A[3], N", &["10 2"]);
    assert_types(
        "DECOMPOSE A[1] = TRANS(1,2,3,40,50,60)\nTYPE A[1],A[2],A[3],A[4],A[5],A[6]",
        &["1 2 3 40 50 60"],
    );
    assert_types("DECOMPOSE Q = #PPOINT(1,2,3,4,5,6)\nTYPE Q[0],Q[5]", &["1 6"]);
}

#[test]
fn type_and_its_formats() {
    assert_types("TYPE \"A\",/X3,\"B\"", &["A   B"]);
    assert_types("TYPE \"A\",/C2,\"B\"", &["A", "B"]);
    assert_types("TYPE \"A\",/S\nTYPE \"B\"", &["AB"]);
    assert_types("TYPE /F8.2,1.005,2,/D,3", &["1.00    2.00 3"]);
}

#[test]
fn branches_and_loops() {
    assert_types("N = 1\n10 TYPE N\nN = N+1\nIF N <= 3 GOTO 10", &["1", "2", "3"]);
    assert_types("GOTO 20\nTYPE 1\n20 TYPE 2", &["2"]);
    assert_types(
        "IF 1 THEN\nTYPE 1\nELSE\nTYPE 2\nEND\nIF 0 THEN\nTYPE 3\nELSE\nTYPE 4\nEND",
        &["1", "4"],
    );
    assert_types(
        "IF 0 THEN\nIF 1 THEN\nTYPE 1\nELSE\nTYPE 2\nEND\nELSE\nTYPE 3\nEND",
        &["3"],
    );
    assert_types("FOR I = 1 TO 3\nTYPE I\nEND\nTYPE I", &["1", "2", "3", "4"]);
    assert_types("FOR I = 6 TO 1 STEP -2\nTYPE I\nEND", &["6", "4", "2"]);
    assert_types("FOR I = 2 TO 1\nTYPE I\nEND\nTYPE 9", &["9"]);
    assert_types(
        "FOR I = 1 TO 2\nFOR J = 1 TO 2\nTYPE I*10+J\nEND\nEND",
        &["11", "12", "21", "22"],
    );
    assert_types("N = 0\nWHILE N < 2 DO\nN = N+1\nTYPE N\nEND", &["1", "2"]);
    assert_types("N = 0\nDO\nN = N+1\nTYPE N\nUNTIL N >= 2", &["1", "2"]);
    let case =
        |n| format!("N = {n}\nCASE N OF\nVALUE 1,2:\nTYPE 12\nVALUE 3:\nTYPE 3\nANY\nTYPE 0\nEND\nTYPE 99");
    assert_types(&case(2), &["12", "99"]);
    assert_types(&case(3), &["3", "99"]);
    assert_types(&case(7), &["0", "99"]);
}

#[test]
fn calls_nest_and_return() {
    let mut console = Console::ready();
    console.program("INNER", "TYPE \"in\"\nRETURN\nTYPE \"never\"");
    console.program("OUTER", "CALL INNER\nTYPE \"out\"");
    let said = console.line("EXECUTE OUTER");
    assert!(
        said.contains("in\r\n") && said.contains("out\r\nProgram completed\r\n.") && !said.contains("never")
    );
    console.program("ENDLESS", "CALL ENDLESS");
    assert!(console.line("EX ENDLESS").contains("*Out of memory*"));
    assert!(console.line("DO CALL INNER").contains("in\r\n"));
}

#[test]
fn cycles_and_ends() {
    let mut console = Console::ready();
    console.program("ONCE", "TYPE \"turn\"");
    assert_eq!(console.line("EXECUTE ONCE,3").matches("turn").count(), 3);
    console.program("STEPS", "TYPE 1\nTYPE 2\nTYPE 3");
    let said = console.line("EXECUTE STEPS,,2");
    assert!(!said.contains(" 1\r\n") && said.contains(" 2\r\n 3\r\n"));
    assert!(console.line("EXECUTE").contains(" 1\r\n"));
    console.program("CUT", "TYPE 1\nSTOP\nTYPE 2");
    let said = console.line("EXECUTE CUT,2");
    assert_eq!(said.matches(" 1\r\n").count(), 2);
    assert!(!said.contains(" 2\r\n"));
    console.program("DEAD", "TYPE 1\nHALT\nTYPE 2");
    assert!(
        console
            .line("EXECUTE DEAD,2")
            .contains("Program halted at DEAD, step 3\r\n.")
    );
    console.program("NAP", "TYPE 1\nPAUSE\nTYPE 2");
    assert!(console.line("EXECUTE NAP").contains("Program paused at NAP"));
    assert!(console.line("PROCEED").contains(" 2\r\nProgram completed"));
    assert!(console.line("EXECUTE NAP").contains("paused"));
    assert!(console.line("NEXT").contains(" 2\r\nProgram paused"));
    console.program("OOPS", "TYPE 1\nTYPE LATER\nTYPE 3");
    assert!(
        console
            .line("EXECUTE OOPS")
            .contains("*Undefined value*\r\nProgram aborted at OOPS")
    );
    console.line("DO LATER = 22");
    assert!(console.line("RETRY").contains(" 22\r\n 3\r\nProgram completed"));
}

#[test]
fn a_program_with_loose_ends_is_not_started() {
    let mut console = Console::ready();
    for steps in [
        "IF 1 THEN",
        "END",
        "FOR I=1 TO 2\nELSE\nEND",
        "DO\nEND",
        "WHILE 1 DO\nUNTIL 1",
    ] {
        assert!(
            console.run(steps).contains("*Control structure error*"),
            "{steps}"
        );
    }
    assert!(console.run("GOTO 77").contains("*Undefined label*"));
}

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
    assert!(near(hand(&console), [400.0, 200.0, 300.0, 60.0, 70.0, 10.0]));
    console.line("DO ALIGN");
    assert!((hand(&console)[4] - 90.0).abs() < 1e-6, "{:?}", hand(&console));
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
    assert!((frame.translation.vector * 1000.0 - nalgebra::Vector3::new(1.0, 2.0, 3.0)).amax() < 1e-12);
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
    assert!(seen > 20 && fastest < 0.505 && fastest > 0.4, "{seen} {fastest}");
}

#[test]
fn a_straight_line_that_leaves_the_reach_stops_there_or_does_not_start() {
    // Straight through the column: both ends are reachable, the middle is not.
    let steps = "DO MOVE TRANS(500,50,300,90,90,0)\nDO MOVES TRANS(-500,50,300,90,90,0)";
    let mut console = Console::ready();
    assert!(console.lines(steps).contains("*Location"), "{}", console.screen);
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
    console.lines("DO MOVE #PPOINT(0,-45,180,0,45,0)\nDO HERE P\nDO MOVEST P:TRANS(10,0,0,90,-90),0");
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
    console.lines("SPEED 100\nDO SPEED 100 ALWAYS\nDO MOVE #PPOINT(0,-45,180,0,45,0)\nDO SPEED 50 MMPS");
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

#[test]
fn signals_are_set_waited_for_and_reacted_to() {
    let mut console = Console::ready();
    console.line("DO SIGNAL 3,-4,2001");
    assert!(console.emulator.signal(3).unwrap() && console.emulator.signal(2001).unwrap());
    assert!(
        console
            .emulator
            .take_events()
            .contains(&Event::Output { signal: 3, on: true })
    );
    console.line("RESET");
    assert!(!console.emulator.signal(3).unwrap());
    console.program("WAITING", "WAIT SIG(1001) AND SIG(-1002)\nTYPE \"came\"");
    assert!(console.line("EXECUTE WAITING").ends_with('*'));
    assert!(console.line("STATUS").contains("WAITING"));
    console.emulator.set_signal(1001, true).unwrap();
    console.settle();
    assert!(console.screen.ends_with("came\r\nProgram completed\r\n."));
}

#[test]
fn react_waits_for_the_step_and_reacti_stops_the_motion() {
    for (word, stops) in [("REACT", false), ("REACTI", true)] {
        let mut console = Console::ready();
        console.program("HIT", "TYPE \"hit\"\nRETURN");
        console.program(
            "GO",
            &format!("{word} 1001,HIT\nMOVE #PPOINT(80,-90,90)\nDELAY 3\nTYPE \"goes on\"\nMOVE #PPOINT(-20,-90,90)"),
        );
        console.line_now("EXECUTE GO");
        console.wait(Duration::from_millis(600));
        assert!(console.emulator.moving());
        let before = console.degrees()[0];
        console.emulator.set_signal(1001, true).unwrap();
        console.wait(Duration::from_millis(100));
        assert_eq!(console.emulator.moving(), !stops, "{word}");
        if stops {
            assert!(console.degrees()[0] - before < 3.0);
        }
        console.settle();
        assert!(console.screen.contains("hit\r\n"), "{word}");
        assert!(
            console.screen.ends_with("Program completed\r\n."),
            "{word}: {}",
            console.screen
        );
        console.assert_at([-20.0, -90.0, 90.0, 0.0, 0.0, 0.0]);
    }
}

#[test]
fn ignore_disarms() {
    let mut console = Console::ready();
    console.program("HIT", "TYPE \"hit\"");
    console.program(
        "GO",
        "REACTI 1001,HIT\nIGNORE 1001\nMOVE #PPOINT(80,-90,90)\nBREAK",
    );
    console.emulator.set_signal(1001, false).unwrap();
    console.line_now("EXECUTE GO");
    console.wait(Duration::from_millis(300));
    console.emulator.set_signal(1001, true).unwrap();
    console.settle();
    assert!(!console.screen.contains("hit\r\n."));
    console.assert_at([80.0, -90.0, 90.0, 0.0, 0.0, 0.0]);
}

#[test]
fn a_sensor_stops_a_move_of_the_monitor() {
    let mut console = Console::ready();
    console
        .emulator
        .attach_sensor(1005, |joints| joints.degrees()[0] > 30.0)
        .unwrap();
    console.line("DO REACTI 1005");
    console.line("DO DRIVE 1,80,100");
    let stands = console.degrees()[0];
    assert!((30.0..40.0).contains(&stands), "{stands}");
    assert!(console.line("DO TYPE SIG(1005)").contains(" -1\r\n"));
    assert!(console.emulator.take_events().contains(&Event::MotionBrokenOff));
}

#[test]
fn prompt_reads_numbers() {
    let mut console = Console::ready();
    console.program("ASK", "PROMPT \"angles? \",A,B\nTYPE A+B");
    assert!(console.line("EXECUTE ASK").ends_with("angles? "));
    assert!(console.line("two").contains("*Invalid argument*"));
    assert!(console.line("2,-0.5").contains(" 1.5\r\nProgram completed\r\n."));
    assert!(console.line("DO PROMPT N").ends_with('\n') || console.screen.ends_with('\n'));
    console.line("7");
    assert_eq!(console.emulator.real("N"), Some(7.0));
}

#[test]
fn the_monitor_answers_while_a_program_runs() {
    let mut console = Console::ready();
    console.program(
        "LONG",
        "10 MOVE #PPOINT(40,-90,90)\nMOVE #PPOINT(0,-90,90)\nGOTO 10",
    );
    assert!(console.line_now("EXECUTE LONG").ends_with('*'));
    console.wait(Duration::from_secs(3));
    assert!(console.line_now("WHERE").contains("JT1"));
    assert!(console.line_now("DO READY").contains("*Program executing*"));
    assert!(console.line_now("SPEED 30").ends_with('*'));
    assert!(console.line_now("STATUS").contains("PROGRAM LONG  STEP"));
    console.line_now("ABORT");
    console.settle();
    assert!(console.screen.contains("Program aborted at LONG") && console.screen.ends_with('.'));
    assert!(!console.emulator.moving());
    assert!(
        console
            .emulator
            .take_events()
            .contains(&Event::ProgramEnded(Message::Aborted))
    );
}

#[test]
fn panic_and_control_c_stop_a_motion_of_the_monitor() {
    for stop in ["PANIC\r", "\x03"] {
        let mut console = Console::ready();
        console.line_now("DO DRIVE 1,80,100");
        console.wait(Duration::from_millis(500));
        console.emulator.feed(stop.as_bytes(), console.now);
        console.wait(Duration::from_millis(200));
        assert!(!console.emulator.moving());
        let stands = console.degrees()[0];
        assert!((5.0..60.0).contains(&stands), "{stands}");
        assert!(console.line("WHERE").contains("JT1"));
    }
}

#[test]
fn power_and_servo_failures_stop_the_arm() {
    let mut console = Console::ready();
    console.line_now("DO DRIVE 1,80,100");
    console.wait(Duration::from_millis(500));
    console.emulator.set_arm_power(false);
    console.settle();
    assert!(console.screen.ends_with("*Arm power off*\r\n."));
    let stands = console.degrees();
    console.wait(Duration::from_secs(5));
    console.assert_at(stands);
    assert!(console.line("DO READY").contains("*Arm power off*"));
    console.emulator.set_arm_power(true);
    console.line_now("DO READY");
    console.wait(Duration::from_millis(300));
    console.emulator.envelope_error(puma_val2::Joint::J2);
    console.settle();
    assert!(console.screen.ends_with("*Envelope error* Jt 2\r\n."));
}

#[test]
fn text_goes_out_and_in_unchanged() {
    let mut console = Console::ready();
    console.program("A", "10 TYPE \"Hello; World\" ; greet\nIF N > 2 GOTO 10\nMOVE P");
    console.lines("DO SET P = TRANS(1,2,3,4,5,6)\nDO HERE #Q\nDO N = 2.5\nDO B[3] = -1");
    let text = console.emulator.text();
    let mut other = Console::ready();
    other.emulator.load_text(&text).unwrap();
    assert_eq!(other.emulator.text(), text);
    let error = other.emulator.load_text(".PROGRAM X\n FROB\n.END").unwrap_err();
    assert_eq!(
        (error.line, error.fault.message),
        (2, Message::UnknownInstruction)
    );
    assert!(other.emulator.load_text(".REALS\nN 1").is_err());
    assert_eq!(other.emulator.text(), text);
}
