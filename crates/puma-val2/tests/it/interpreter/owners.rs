//! Work of an owner at the terminal: programs written, tried step by step, mended and run.

use std::time::Duration;

use crate::console::Console;

fn loaded(text: &str) -> Console {
    let mut console = Console::ready();
    console.emulator.load_text(text).unwrap();
    console.line("DO MOVE #PPOINT(0,-45,180,0,45,0)");
    console
}

/// Texts between line ends, without prompts.
fn typed(screen: &str) -> Vec<&str> {
    let lines = screen
        .lines()
        .map(|line| line.trim_matches(['*', '.', ' ']));
    lines.filter(|line| !line.is_empty()).collect()
}

#[test]
fn a_program_is_typed_listed_and_mended_in_the_editor() {
    let mut console = Console::ready();
    console.lines(
        "EDIT STACK\nAPPRO PART, 50 ; above\nMOVES PART\nCLOSI\nCLOSEI\nDEPART 50\nTYPE \"ok\"\nE",
    );
    assert!(console.screen.contains("*Unknown instruction*"));
    let steps = |console: &mut Console| {
        let said = console.line("LISTP STACK");
        said.lines()
            .map(|l| l.trim().to_owned())
            .collect::<Vec<_>>()[2..]
            .join("/")
    };
    assert_eq!(
        steps(&mut console),
        "1.  APPRO PART, 50 ; above/2.  MOVES PART/3.  CLOSEI/4.  DEPART 50/5.  TYPE \"ok\"/.END/."
    );
    // To step 2, a new one before it; the last two away; the first one replaced; a look from 1.
    console.lines("EDIT STACK,2\nI\nSPEED 20\n\nS 5\nD 2\nS 1\nR APPRO PART,75\nS 1");
    let shown = console.line("P 9");
    assert!(
        shown.contains("1.  APPRO PART,75\r\n  2.  SPEED 20\r\n  3.  MOVES PART"),
        "{shown}"
    );
    assert!(console.line("L 2").contains("3.  MOVES PART"));
    // A step that looks like a letter of the editor, a taught location, and on to another program.
    console.lines("S 5\nT = 3\nC [1] = T\nT SPOT\nC OTHER\nTYPE T,C[1]\nE");
    assert!(
        steps(&mut console).ends_with("4.  CLOSEI/5.  T = 3/6.  C [1] = T/7.  MOVE SPOT/.END/.")
    );
    assert!(console.line("LISTL").contains("SPOT"));
    console.lines(
        "DO MOVE #PPOINT(0,-45,180,0,45,0)\nDO HERE PART\nDO MOVE #PPOINT(10,-60,170,0,45,0)",
    );
    let said = console.lines("EXECUTE STACK\nEXECUTE OTHER");
    assert!(said.contains(" 3 3\r\nProgram completed"), "{said}");
}

#[test]
fn a_program_is_tried_step_by_step_and_goes_on_after_a_fault() {
    let mut console =
        loaded(".PROGRAM TRY\n TYPE \"a\"\n MOVE NOWHERE\n TYPE \"b\"\n PAUSE\n TYPE \"c\"\n.END");
    console.line("PRIME TRY");
    assert!(
        console
            .line("NEXT")
            .contains("a\r\nProgram paused at TRY, step 2")
    );
    assert!(
        console
            .line("NEXT")
            .contains("*Undefined value*\r\nProgram aborted at TRY, step 2")
    );
    console.line("HERE NOWHERE");
    console.line("");
    assert!(
        console
            .line("RETRY")
            .contains("b\r\nProgram paused at TRY, step 5")
    );
    assert!(console.line("PROCEED").contains("c\r\nProgram completed"));
    assert!(console.line("PROCEED").contains("*No program executing*"));
    // From a step, twice.
    let said = console.line("EXECUTE TRY,2,5");
    assert_eq!(said.matches("\r\nc\r\n").count(), 1, "{said}");
    assert!(said.contains("Program paused at TRY, step 5"), "{said}");
}

#[test]
fn an_operator_answers_questions_badly_and_then_well() {
    let mut console = loaded(
        ".PROGRAM SETUP
 10 PROMPT \"Rows, columns: \", R, C
 IF (R < 1) OR (C < 1) THEN
   TYPE \"at least one, please\"
   GOTO 10
 END
 TYPE /C1, \"Pallet of\", R, \" by\", C, \" =\", R*C, /X2, \"parts\"
.END",
    );
    console.line("EXECUTE SETUP");
    assert!(console.line("two,3").contains("*Invalid argument*"));
    assert!(console.line("").contains("at least one, please"));
    assert!(console.line("-1,4").contains("at least one, please"));
    assert!(
        console
            .line("2, 1.5E1")
            .contains("Pallet of 2 by 15 = 30  parts\r\nProgram completed")
    );
}

#[test]
fn two_reactions_wait_for_each_other_and_are_armed_again() {
    let mut console = loaded(
        ".PROGRAM WATCH
 REACT 1001, LOW, 1
 REACT 1002, HIGH, 5
 FOR I = 1 TO 6
   DELAY 1
 END
 IGNORE 1001
 IGNORE 1002
 DELAY 1
 TYPE \"end\"
.END
.PROGRAM LOW
 TYPE \"low\"
 DELAY 0.5
 WAIT SIG(-1001)
 REACT 1001,LOW
.END
.PROGRAM HIGH
 TYPE \"high\"
 WAIT SIG(-1002)
 REACT 1002, HIGH
.END",
    );
    console.line_now("EXECUTE WATCH");
    let pulse = |console: &mut Console, signal| {
        console.emulator.set_signal(signal, true).unwrap();
        console.wait(Duration::from_millis(800));
        console.emulator.set_signal(signal, false).unwrap();
        console.wait(Duration::from_millis(700));
    };
    for signal in [1001, 1002, 1001] {
        pulse(&mut console, signal);
    }
    console.wait(Duration::from_secs(9));
    console.emulator.set_signal(1001, true).unwrap();
    console.settle();
    let said = typed(&console.screen);
    let from = said.iter().position(|line| *line == "low").unwrap();
    assert_eq!(
        said[from..],
        ["low", "high", "low", "end", "Program completed"]
    );
}

#[test]
fn glue_follows_a_taught_contour_relative_to_the_part() {
    let mut console = loaded(
        ".PROGRAM GLUE
 ; corners are relative to the part, so that the part may lie anywhere
 SET PART = TRANS(450,100,-120,90,90,0):RZ(PARAMETER)
 SET PART = TRANS(450,100,-120,90,90,0)
 SET C[0] = TRANS(0,0,0,90,-90,0)
 SET C[1] = TRANS(60,0,0,90,-90,0)
 SET C[2] = TRANS(60,40,0,90,-90,0)
 SET C[3] = TRANS(0,40,0,90,-90,0)
 APPROS PART:C[0], 30
 COARSE ALWAYS
 SPEED 4 IPS ALWAYS
 MOVES PART:C[0]
 SIGNAL 7
 FOR I = 1 TO 4
   MOVES PART:C[I MOD 4]
 END
 BREAK
 SIGNAL -7
 SPEED 100
 DEPARTS 30
 DECOMPOSE X[1] = HERE
 TYPE /F8.1, X[1], X[2], X[3]
.END
.REALS
PARAMETER 0
.END",
    );
    let said = console.line("EXECUTE GLUE");
    assert!(said.contains("450.0   100.0"), "{said}");
    assert!(!console.emulator.signal(7).unwrap());
}

#[test]
fn a_subroutine_stacks_parts_of_any_height() {
    let mut console = loaded(
        ".PROGRAM MAIN
 LEVEL = 0
 FOR N = 1 TO 3
   CALL PLACE(BASE, 20*(N-1), LEVEL)
   TYPE \"level\", LEVEL
 END
 MOVE #HOME[1]
.END
.PROGRAM PLACE(AT, UP, TOP)
 AUTO SPOT
 SET SPOT = SHIFT(AT BY 0,0,UP)
 APPRO SPOT,50
 MOVES SPOT
 OPENI
 DEPARTS 50
 TOP = DZ(SPOT)
.END
.LOCATIONS
BASE 450,-100,-150,90,90,0
#HOME[1] 0,-45,180,0,45,0
.END",
    );
    let said = console.line("EXECUTE MAIN");
    let lines = typed(&said);
    let from = lines
        .iter()
        .position(|line| line.starts_with("level"))
        .unwrap();
    assert_eq!(
        lines[from..],
        [
            "level -150",
            "level -130",
            "level -110",
            "Program completed"
        ]
    );
    console.assert_at([0.0, -45.0, 180.0, 0.0, 45.0, 0.0]);
    assert!(!console.line("LISTL").contains("SPOT"));
}

#[test]
fn a_counter_and_a_lamp_run_beside_the_robot() {
    let mut console = loaded(
        ".PROGRAM CELL
 RUNSIG 2
 FOR I = 1 TO 3
   MOVE TRANS(450,200,-100,90,90,0)
   MOVE TRANS(450,-200,-100,90,90,0)
   BREAK
   SIGNAL 2001
   WAIT SIG(-2001)
 END
 TYPE \"counted\", PARTS
.END
.PROGRAM COUNT.PC
 WAIT SIG(2001)
 PARTS = PARTS+1
 SIGNAL -2001, 3
 DELAY 0.2
 SIGNAL -3
.END
.REALS
PARTS 0
.END",
    );
    console.line_now("PCEXECUTE COUNT.PC,-1");
    console.line_now("EXECUTE CELL");
    assert!(console.line_now("STATUS").contains("PROGRAM CELL"));
    console.wait(Duration::from_millis(100));
    assert!(console.emulator.signal(2).unwrap());
    console.wait(Duration::from_secs(60));
    assert!(
        console.screen.contains("counted 3\r\nProgram completed"),
        "{}",
        console.screen
    );
    assert!(!console.emulator.signal(2).unwrap());
    assert!(console.line_now("PCSTATUS").contains("WAITING"));
}
