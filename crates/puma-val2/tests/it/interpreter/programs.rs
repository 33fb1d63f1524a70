//! Expressions, variables, output, branches, loops and calls.

use crate::console::Console;

/// Lines that a program typed.
fn typed(steps: &str) -> Vec<String> {
    let said = Console::ready().run(steps);
    let end = said
        .find("Program completed")
        .unwrap_or_else(|| panic!("{said}"));
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
    assert_types(
        "DECOMPOSE Q = #PPOINT(1,2,3,4,5,6)\nTYPE Q[0],Q[5]",
        &["1 6"],
    );
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
    assert_types(
        "N = 1\n10 TYPE N\nN = N+1\nIF N <= 3 GOTO 10",
        &["1", "2", "3"],
    );
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
    let case = |n| {
        format!(
            "N = {n}\nCASE N OF\nVALUE 1,2:\nTYPE 12\nVALUE 3:\nTYPE 3\nANY\nTYPE 0\nEND\nTYPE 99"
        )
    };
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
        said.contains("in\r\n")
            && said.contains("out\r\nProgram completed\r\n.")
            && !said.contains("never")
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
    for again in ["PROCEED", "RETRY", "NEXT"] {
        assert!(
            console.line(again).contains("*No program executing*"),
            "{again}"
        );
    }
    console.program("NAP", "TYPE 1\nPAUSE\nTYPE 2");
    assert!(
        console
            .line("EXECUTE NAP")
            .contains("Program paused at NAP")
    );
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
    assert!(
        console
            .line("RETRY")
            .contains(" 22\r\n 3\r\nProgram completed")
    );
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
