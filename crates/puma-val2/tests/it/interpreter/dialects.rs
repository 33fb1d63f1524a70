//! VAL of 1980, calls with arguments, reactions to faults.

use puma_val2::Profile;

use crate::console::Console;

#[test]
fn a_program_of_the_first_val_does_what_it_says() {
    let text = "
.PROGRAM MAIN
 REMARK don't count in VAL II
 SETI COUNT = 7 / 2
 TYPEI COUNT
 10 GOSUB PART
 TYPE left out
 SETI COUNT = COUNT - 1
 IF COUNT GT 1 THEN 10
 IFSIG 1001,,-1002 THEN 20
 TYPE no part
 20 INVERSE Q = P
 SHIFT P BY 10,,-5
 FRAME F = A,B,C
 TYPE the end
.END
.PROGRAM PART
 TYPE a part
 RETURN 1
.END
.LOCATIONS
P 600,150,100,90,90,0
A 0,0,0,90,-90,0
B 0,10,0,90,-90,0
C -10,0,0,90,-90,0
.END";
    let mut console = Console::ready_with(Profile::val());
    console.emulator.load_text(text).unwrap();
    console.emulator.set_signal(1001, true).unwrap();
    let said = console.line("EXECUTE MAIN");
    let typed = "COUNT = 3\r\na part\r\na part\r\nthe end\r\nProgram completed";
    assert!(said.contains(typed), "{said}");
    let shown = console.line("LISTL P");
    assert!(shown.contains("610.00    150.00     95.00"), "{shown}");
    // The listing shows what was typed, and loads again.
    assert!(console.line("LISTP PART").contains("RETURN 1"));
    let kept = console.emulator.text();
    console.emulator.load_text(&kept).unwrap();
    assert_eq!(console.emulator.text(), kept);
    let mut of_val_2 = Console::ready();
    assert_eq!(of_val_2.emulator.load_text(text).unwrap_err().line, 3);
}

#[test]
fn calls_hand_over_values_and_bring_them_back() {
    let mut console = Console::ready();
    let text = "
.PROGRAM main()
 x = 3
 n = 100
 SET p = TRANS(1,2,3)
 CALL part(x, n/2, p, TRANS(10,20), #PPOINT(1,-90,90))
 TYPE x, n, DX(p)
 CALL part(x)
.END
.PROGRAM part(a, b, place, other, #point)  ; of V+
 AUTO n, again
 n = 7
 TYPE a, b, n, DX(place), DY(other), DEFINED(again)
 a = a+b
 SET place = TRANS(5)
.END";
    console.emulator.load_text(text).unwrap();
    let said = console.line("EXECUTE MAIN");
    assert!(said.contains("3 50 7 1 20 0"), "{said}");
    assert!(said.contains("53 100 5"), "{said}");
    let fault = "*Undefined value*\r\nProgram aborted at PART, step 3";
    assert!(said.contains(fault), "{said}");
    // An aborted program keeps its names until another one starts.
    assert_eq!(console.emulator.real("N"), Some(7.0));
    console.program("SUB(A,B)", "TYPE A+B\nRETURN");
    assert!(console.line("LISTP SUB").contains(".PROGRAM SUB(A,B)"));
    let said = console.run("CALL SUB(1,2)\nTYPE N");
    assert!(said.contains("3\r\n 100"), "{said}");
    assert!(
        console
            .run("CALL SUB(1,2,3)")
            .contains("*Invalid argument*")
    );
    console.line("DO N = 40");
    let said = console.line("DO CALL SUB(N,2)");
    assert!(said.contains("42\r\nProgram completed"), "{said}");
    assert!(console.line("DO AUTO N").contains("*Illegal instruction*"));
    assert!(
        console
            .line("DO CALL NONE(N)")
            .contains("*Undefined program*")
    );
    assert_eq!(console.emulator.real("N"), Some(40.0));
    let kept = console.emulator.text();
    assert!(kept.contains(".PROGRAM PART(A,B,PLACE,OTHER,#POINT)"));
    console.emulator.load_text(&kept).unwrap();
}

#[test]
fn a_fault_calls_the_program_of_reacte() {
    let mut console = Console::ready();
    console.program("HELP", "TYPE \"helped\"\nRETURN");
    let said = console.run("REACTE HELP\nN = 1/0\nTYPE \"on\"\nN = 1/0\nTYPE \"never\"");
    assert!(
        said.contains("helped\r\non\r\n*Arithmetic error*"),
        "{said}"
    );
    assert!(!said.contains("never"));
    assert!(
        console
            .run("REACTE HELP\nREACTE\nN = 1/0")
            .contains("*Arithmetic")
    );
    let said = console.run("REACTE HELP\nDRIVE 1,170,100\nTYPE \"on\"");
    assert!(said.contains("helped\r\non"), "{said}");
}

#[test]
fn the_editor_replaces_a_step() {
    let mut console = Console::ready();
    console.program("R", "TYPE 1\nTYPE 2");
    console.lines("EDIT R,2\nR TYPE 3\nE");
    let listed = console.line("LISTP R");
    assert!(
        listed.contains("1.  TYPE 1\r\n  2.  TYPE 3\r\n.END"),
        "{listed}"
    );
}

#[test]
fn a_v_plus_file_loads_or_names_its_first_unknown_line() {
    let mut console = Console::ready();
    console
        .emulator
        .load_text(".PROGRAM belt()\n TYPE 1\n.END")
        .unwrap();
    for (step, word) in [
        ("WAIT.EVENT 1", "WAIT.EVENT"),
        ("10 ATTACH (5)", "ATTACH"),
        ("$a = \"text\"", "$a"),
        ("n = n + LEN(5)*ABS(1)", "LEN"),
        ("SET p = here2(1):q", "HERE2"),
        ("S 1", "S"),
        ("TYPE \"open", "\"open"),
        ("MOVE p NOW", "NOW"),
    ] {
        let text = format!(".PROGRAM a()\n TYPE 1\n {step}\n FROB 2\n.END");
        let error = console.emulator.load_text(&text).unwrap_err();
        assert_eq!((error.line, error.word.as_str()), (3, word), "{error}");
        console.emulator.insert_file("BAD", text);
        let said = console.line("LOAD BAD");
        assert!(said.contains(&format!("Line 3: {step}\r\n*")), "{said}");
    }
    assert!(console.line("DIRECTORY").contains("BELT"));
    assert!(!console.line("DIRECTORY").contains("\nA\r"));
}

#[test]
fn a_process_program_runs_beside_the_robots_program() {
    let mut console = Console::ready();
    console.program("PC", "IF SIG(3) THEN\nN = N+1\nSIGNAL -3\nEND\nDELAY 0.1");
    console.program(
        "WORK",
        "FOR I = 1 TO 3\nMOVE #PPOINT(I,-90,90)\nBREAK\nSIGNAL 3\nDELAY 1\nEND",
    );
    console.line("DO N = 0");
    assert!(
        console
            .line_now("PCSTATUS")
            .contains("NO PROCESS PROGRAM EXECUTING")
    );
    assert!(
        console
            .line_now("PCABORT")
            .contains("*No program executing*")
    );
    console.line_now("PCEXECUTE PC,-1");
    let status = console.line_now("PCSTATUS");
    assert!(
        status.contains("PROCESS PROGRAM PC") && status.contains("FOREVER"),
        "{status}"
    );
    assert!(
        console
            .line_now("PCEXECUTE WORK")
            .contains("*Program executing*")
    );
    console.line_now("EXECUTE WORK");
    console.wait(std::time::Duration::from_secs(10));
    assert!(
        console.screen.contains("Program completed"),
        "{}",
        console.screen
    );
    assert_eq!(console.emulator.real("N"), Some(3.0));
    assert!(console.line_now("STATUS").contains("NO PROGRAM EXECUTING"));
    assert!(
        console
            .line_now("PCABORT")
            .contains("PC: Program aborted at PC, step")
    );
    // It goes on where it was, and ends with its cycle.
    console.line_now("PCPROCEED");
    console.line_now("PCEND");
    assert!(
        console
            .wait(std::time::Duration::from_secs(1))
            .contains("PC: Program completed")
    );
    // It has no arm.
    console.program("BAD", "TYPE 1\nMOVE #PPOINT(9,-90,90)");
    let said = console.line("PCEXECUTE BAD");
    assert!(
        said.contains("*Illegal instruction*\r\nPC: Program aborted at BAD, step 2"),
        "{said}"
    );
    assert!(said.ends_with("\r\n."), "{said}");
    console.line_now("PCEXECUTE PC,-1");
    console.lines("ZERO\nY");
    assert!(console.line_now("PCSTATUS").contains("NO PROCESS PROGRAM"));
}

#[test]
fn further_conditions_indices_and_compounds_do_what_they_say() {
    let mut console = Console::ready();
    let said = console.run(
        "FOR I = 1 TO 4\nIF I == 1 THEN\nTYPE \"one\"\nELSE IF I == 2 THEN\nTYPE \"two\"
        ELSE IF I == 3 THEN\nTYPE \"three\"\nELSE\nTYPE \"many\"\nEND\nEND
        A[1,2] = 5\nA[2,1,0] = 7\nTYPE A[1,2]+A[2,1,0]
        SET F = TRANS(100,200,300,90,-90,0):RZ(30)\nHERE F:P\nSET Q[3,4] = F:P
        TYPE DISTANCE(HERE,Q[3,4]) < 0.001,DX(SCALE(F BY 2))",
    );
    let typed: Vec<&str> = said.lines().map(|l| l.trim_matches(['*', ' '])).collect();
    let from = typed.iter().position(|line| *line == "one").unwrap();
    assert_eq!(
        typed[from..from + 6],
        ["one", "two", "three", "many", "12", "-1 200"],
        "{said}"
    );
    assert!(console.line("HERE F:#P").contains("*Invalid argument*"));
    assert!(console.line("HERE NOWHERE:P").contains("*Undefined value*"));
}
