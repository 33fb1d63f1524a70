//! Signals, reactions, values asked for, and what stops a motion.

use std::time::Duration;

use puma_val2::{Event, Message};

use crate::console::Console;

#[test]
fn signals_are_set_waited_for_and_reacted_to() {
    let mut console = Console::ready();
    console.line("DO SIGNAL 3,-4,2001");
    assert!(console.emulator.signal(3).unwrap() && console.emulator.signal(2001).unwrap());
    assert!(console.emulator.take_events().contains(&Event::Output {
        signal: 3,
        on: true
    }));
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
            &format!(
                "{word} 1001,HIT\nMOVE #PPOINT(80,-90,90)\nDELAY 3\nTYPE \"goes on\"\n\
                 MOVE #PPOINT(-20,-90,90)"
            ),
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
    assert!(
        console
            .emulator
            .take_events()
            .contains(&Event::MotionBrokenOff)
    );
}

#[test]
fn a_reaction_while_values_are_asked_for_does_not_skip_them() {
    for word in ["REACT", "REACTI"] {
        let mut console = Console::ready();
        console.program("HIT", "TYPE \"hit\"\nDELAY 0.5\nRETURN");
        console.program(
            "ASK",
            &format!("{word} 1001,HIT\nPROMPT \"how many? \",N\nTYPE N*2"),
        );
        assert!(console.line("EXECUTE ASK").ends_with("how many? "));
        console.emulator.set_signal(1001, true).unwrap();
        console.wait(Duration::from_millis(100));
        // The terminal is the monitor's meanwhile.
        assert!(
            console.line_now("SPEED 90").ends_with('*'),
            "{}",
            console.screen
        );
        console.settle();
        assert!(
            console.screen.contains("hit\r\n"),
            "{word}: {}",
            console.screen
        );
        assert!(
            console.screen.ends_with("how many? "),
            "{word}: {}",
            console.screen
        );
        assert!(
            console.line("21").contains(" 42\r\nProgram completed\r\n."),
            "{word}"
        );
    }
}

#[test]
fn output_dropped_by_control_o_returns_with_a_question() {
    let mut console = Console::ready();
    for (begin, line, question) in [
        ("EDIT P", "TYPE 1", " 2.? "),
        ("POINT #A", "1,2,3", "Change?\r\n"),
        ("ZERO", "PERHAPS", "(Y/N)? "),
    ] {
        console.line(begin);
        console.emulator.feed(b"\x0f", console.now);
        assert!(
            console.line(line).ends_with(question),
            "{begin}: {}",
            console.screen
        );
        console.line(if begin == "EDIT P" { "E" } else { "" });
    }
}

#[test]
fn prompt_reads_numbers() {
    let mut console = Console::ready();
    console.program("ASK", "PROMPT \"angles? \",A,B\nTYPE A+B");
    assert!(console.line("EXECUTE ASK").ends_with("angles? "));
    assert!(console.line("two").contains("*Invalid argument*"));
    assert!(
        console
            .line("2,-0.5")
            .contains(" 1.5\r\nProgram completed\r\n.")
    );
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
