//! Programs in the manner of published VAL II material.

use std::time::Duration;

use puma_val2::{Event, Gripper};

use crate::console::Console;

const PLACES: &str = "
.LOCATIONS
PICK 450,200,-100,90,90,0
PALLET 450,-300,-150,90,90,0
CORNER1 300,-300,-150,90,90,0
CORNER2 400,-300,-150,90,90,0
CORNER3 300,-200,-150,90,90,0
#SAFE 0,-45,180,0,45,0
.END
";

/// A controller with the places, at #SAFE, that has loaded a text.
fn loaded(programs: &str) -> Console {
    let mut console = Console::ready();
    for text in [PLACES, programs] {
        console.emulator.load_text(text).unwrap();
    }
    console.line("DO MOVE #SAFE");
    console.emulator.take_events();
    console
}

#[test]
fn a_pallet_is_filled_row_by_row_with_shift() {
    let mut console = loaded(
        ".PROGRAM PALLETIZE
 ; four rows of three, 40 mm apart
 ROWS = 4
 COLS = 3
 SPEED 80 ALWAYS
 OPENI
 FOR R = 0 TO ROWS-1
   FOR C = 0 TO COLS-1
     CALL GETPART
     SET SLOT = SHIFT(PALLET BY 40*C,40*R,0)
     APPRO SLOT,60
     MOVES SLOT
     OPENI
     DEPARTS 60
     COUNT = COUNT+1
   END
 END
 TYPE /C1,\"Parts placed: \",/F4.0,COUNT
 MOVE #SAFE
.END
.PROGRAM GETPART
 APPRO PICK,50
 MOVES PICK
 CLOSEI
 DEPARTS 50
.END
.REALS
COUNT 0
.END",
    );
    console.line_now("EXECUTE PALLETIZE");
    for _ in 0..4 {
        console.settle();
    }
    let said = &console.screen;
    assert!(said.contains("Parts placed:   12"), "{said}");
    console.assert_at([0.0, -45.0, 180.0, 0.0, 45.0, 0.0]);
    assert!(
        console
            .line("LISTL SLOT")
            .contains("530.00   -180.00   -150.00")
    );
}

#[test]
fn a_frame_carries_a_grid_of_relative_places() {
    let mut console = loaded(
        ".PROGRAM GRID
 SET TRAY = FRAME(CORNER1,CORNER2,CORNER3,CORNER1)
 FOR I = 1 TO 2
   FOR J = 1 TO 2
     SET CELL[2*(I-1)+J] = TRAY:TRANS(25*I,25*J,0,90,-90,0)
     TYPE /F8.1,DX(CELL[2*(I-1)+J]),DY(CELL[2*(I-1)+J]),DZ(CELL[2*(I-1)+J])
   END
 END
 TYPE DISTANCE(CELL[1],CELL[4])
.END",
    );
    let said = console.line("EXECUTE GRID");
    assert!(said.contains("325.0  -275.0  -150.0"), "{said}");
    assert!(said.contains("350.0  -250.0  -150.0"), "{said}");
    assert!(said.contains("35.355"), "{said}");
}

#[test]
fn a_menu_asks_and_branches_by_case() {
    let mut console = loaded(
        ".PROGRAM MENU
 10 TYPE \"1 park, 2 open, 3 leave\"
 PROMPT \"Choice: \",CH
 CASE CH OF
 VALUE 1:
   MOVE #SAFE
   TYPE \"parked\"
 VALUE 2,20:
   OPENI
   TYPE \"open\"
 VALUE 3:
   GOTO 20
 ANY
   TYPE \"no such choice\"
 END
 GOTO 10
 20 TYPE \"bye\"
.END",
    );
    console.line("EXECUTE MENU");
    for (typed, said) in [
        ("1", "parked"),
        ("20", "open"),
        ("7", "no such choice"),
        ("3", "bye"),
    ] {
        let shown = console.line(typed);
        assert!(shown.contains(said), "{typed}: {shown}");
    }
    assert!(console.screen.ends_with("Program completed\r\n."));
}

#[test]
fn a_handshake_with_a_conveyor_waits_and_signals() {
    let mut console = loaded(
        ".PROGRAM CONVEYOR
 RESET
 WHILE SIG(1002) DO
   SIGNAL 1
   WAIT SIG(1001)
   SIGNAL -1
   APPRO PICK,50
   MOVES PICK
   CLOSEI
   DEPARTS 50
   SIGNAL 2
   DELAY 0.1
   SIGNAL -2
   WAIT SIG(-1001)
   N = N+1
 END
 TYPE \"cycles\",N
.END
.REALS
N 0
.END",
    );
    console.emulator.set_signal(1002, true).unwrap();
    console.line("EXECUTE CONVEYOR");
    for turn in 0..3 {
        assert!(console.emulator.signal(1).unwrap(), "{turn}");
        console.emulator.set_signal(1001, true).unwrap();
        console.settle();
        assert!(!console.emulator.signal(1).unwrap());
        if turn == 2 {
            console.emulator.set_signal(1002, false).unwrap();
        }
        console.emulator.set_signal(1001, false).unwrap();
        console.settle();
    }
    assert!(console.screen.contains("cycles 3"), "{}", console.screen);
    let pulses = console.emulator.take_events();
    let on = Event::Output {
        signal: 2,
        on: true,
    };
    assert_eq!(pulses.iter().filter(|e| **e == on).count(), 3);
}

#[test]
fn a_light_curtain_stops_the_arm_and_the_work_goes_on() {
    let mut console = loaded(
        ".PROGRAM WORK
 REACTI 1005,INTRUDER
 FOR I = 1 TO 3
   MOVE PICK
   MOVE PALLET
 END
 IGNORE 1005
 TYPE \"done\"
.END
.PROGRAM INTRUDER
 TYPE \"stopped\"
 SIGNAL 5
 WAIT SIG(-1005)
 SIGNAL -5
 REACTI 1005,INTRUDER
 RETURN
.END",
    );
    console.line_now("EXECUTE WORK");
    console.wait(Duration::from_millis(900));
    console.emulator.set_signal(1005, true).unwrap();
    console.wait(Duration::from_millis(200));
    assert!(console.screen.contains("stopped") && !console.emulator.moving());
    assert!(console.emulator.signal(5).unwrap());
    console.wait(Duration::from_secs(2));
    console.emulator.set_signal(1005, false).unwrap();
    console.settle();
    assert!(console.screen.contains("done"), "{}", console.screen);
    let hand = console.line("WHERE");
    assert!(hand.contains("450.00  -300.00  -150.00"), "{hand}");
}

#[test]
fn a_peg_is_tried_until_it_is_in_or_given_up() {
    let mut console = loaded(
        ".PROGRAM INSERT
 TRY = 0
 DO
   TRY = TRY+1
   APPRO PALLET,20
   SPEED 20
   MOVES SHIFT(PALLET BY 2*(TRY-1))
   BREAK
   IF SIG(1010) THEN
     TYPE \"in at try\",TRY
     EXIT
   ELSE
     DEPARTS 20
   END
 UNTIL TRY == 3
 IF TRY == 3 AND NOT SIG(1010) THEN
   TYPE \"given up\"
   HALT
 END
 OPENI
 DEPART 60
.END",
    );
    assert!(console.line("EXECUTE INSERT").contains("given up"));
    assert!(console.screen.contains("Program halted"));
    let seats = |joints: &puma_val2::Joints| {
        let arm = puma_val2::PumaParams::unimation();
        let at = arm.forward(joints).translation.vector * 1000.0;
        at.z < -149.9 && (at.x - 452.0).abs() < 0.1
    };
    console.emulator.attach_sensor(1010, seats).unwrap();
    let said = console.line("EXECUTE INSERT");
    assert!(
        said.contains("in at try 2") && said.contains("Program completed"),
        "{said}"
    );
    assert_eq!(console.emulator.gripper(), Gripper::Open);
}

#[test]
fn a_circle_is_drawn_by_chords_without_a_stop() {
    let mut console = loaded(
        ".PROGRAM CIRCLE
 RADIUS = 50
 STEPS = 36
 MOVE SHIFT(PALLET BY RADIUS,0,100)
 BREAK
 SPEED 100 MMPS ALWAYS
 FOR K = 1 TO STEPS
   A = K*360/STEPS
   MOVES SHIFT(PALLET BY RADIUS*COS(A),RADIUS*SIN(A),100)
 END
 BREAK
 TYPE \"round\"
.END",
    );
    assert!(console.line("EXECUTE CIRCLE").contains("round"));
    let events = console.emulator.take_events();
    let stands = events.iter().filter(|e| **e == Event::MotionEnded).count();
    assert_eq!(stands, 2);
}

#[test]
fn statistics_come_from_arrays_and_timers() {
    let mut console = loaded(
        ".PROGRAM STATS
 TIMER 1 = 0
 SUM = 0
 FOR I = 1 TO 5
   V[I] = I*I-3
   SUM = SUM+V[I]
 END
 BIG = V[1]
 FOR I = 2 TO 5
   IF V[I] > BIG THEN
     BIG = V[I]
   END
 END
 MEAN = SUM/5
 TYPE \"mean \",/F6.2,MEAN,/D,\" max\",BIG
 IF TIMER(1) > 1 GOTO 99
 TYPE \"in time\"
 RETURN
 99 TYPE \"late\"
.END",
    );
    let said = console.line("EXECUTE STATS");
    assert!(said.contains("mean   8.00 max 22\r\nin time"), "{said}");
}

#[test]
fn a_tool_and_a_moved_base_carry_the_work_along() {
    let mut console = loaded(
        ".PROGRAM TOOLED
 TOOL TRANS(0,0,120,90,-90,0)
 BASE 0,0,0,90
 APPRO PALLET,40
 MOVES PALLET
 HERE REACHED
 TYPE DISTANCE(REACHED,PALLET)
 TOOL NULL
 BASE
 SET INNER = INVERSE(REACHED):PALLET
 TYPE DX(INNER)
.END",
    );
    console.line("DO MOVE #PPOINT(-90,-45,180,0,45,0)");
    let said = console.line("EXECUTE TOOLED");
    assert!(said.contains("Program completed"), "{said}");
}

#[test]
fn what_is_missing_is_refused_with_its_line() {
    let mut console = Console::ready();
    let text = ".PROGRAM SEAM\n MOVE P\n ALTER (1) 19\n MOVES Q\n ALTOFF\n.END";
    let error = console.emulator.load_text(text).unwrap_err();
    assert_eq!(error.line, 3);
    assert!(error.to_string().contains("ALTER (1) 19"), "{error}");
    assert!(console.line("EXECUTE SEAM").contains("*Undefined program*"));
}
