//! Forms of VAL II, V+ and VAL of 1980 that sources show, and the share that the emulator takes.
//!
//! Each line of a table is a source and a form. Sources: `miz` and `vlab` are programs and a course
//! for real controllers, `ppt` slides on VAL II, `iowa` a list of commands of 1994, `ofw` a list in
//! a textbook, `vplus` the documentation of VAL's successor, `as` a file for a controller with AS,
//! VAL's licensed relative, `rx90` and `nc4` clients of a relative, `guide` the contents of the
//! guide of 1980.

use puma_val2::Profile;

use crate::console::Console;

const MONITOR: &str = "
miz WHERE
miz HERE P1
miz HERE #Q
miz POINT P1
miz POINT #Q
ppt POINT P1 = P2
miz DO READY
miz SPEED 50
miz CALIBRATE
miz EXECUTE MAIN
ppt EXECUTE MAIN,2
ppt EXECUTE MAIN,-1
ppt EXECUTE MAIN,2,1
ofw ABORT
ofw PROCEED
ofw RETRY
ofw NEXT
ofw STATUS
ppt STATUS
ofw LISTL
ofw LISTL P1,P2
ofw LISTP
ofw LISTP MAIN
ppt LISTR
ppt LISTR N
ofw EDIT MAIN
ppt EDIT MAIN,2
ofw DIRECTORY
ofw DELETE MAIN
ppt DELETEP MAIN
ppt DELETEL P1
ppt DELETER N
ofw RENAME OTHER = MAIN
ofw COPY OTHER = MAIN
ofw ZERO
ofw STORE DISK
ppt STOREP DISK = MAIN
ppt STOREL DISK = P1
ofw LOAD KEPT
ppt LOADP KEPT
ppt LOADL KEPT
ppt FDIRECTORY
ppt FLIST KEPT
ppt FDELETE KEPT
ppt FCOPY NEW = KEPT
ofw FORMAT
ofw COMPRESS
vplus BASE ,,300
vplus BASE 10,20,30,90
vplus BASE
vplus TOOL
vplus TOOL TRANS(0,0,100,90,-90,0)
vplus TOOL P1
ofw SIGNAL 1,-2
ppt IO
ppt RESET
ppt ENABLE CP
ppt DISABLE MESSAGES
ppt ENABLE CP,TRACE
ppt SWITCH
ppt PARAMETER
ppt PARAMETER HAND.TIME = 0.5
rx90 PANIC
ofw TEACH P3
ofw FREE
ofw DONE
ppt PRIME MAIN
ppt PRIME MAIN,2,1
ppt PCEXECUTE MAIN,-1
ppt PCSTATUS
as PCEXECUTE MAIN
ofw ID
ofw EXECUTE MAIN,,1
ppt STORER DISK = N
ppt LOADR KEPT
vplus HERE P1:P3
";

const PROGRAM: &str = "
miz MOVE #Q
miz MOVE TRANS(600,150,100,90,90,0)
miz MOVE TRANS(6e+02,150,1e2,90,90,0)
ofw MOVE P1
ofw MOVES P1
ofw MOVET P1,50
ofw MOVEST P1,0
vplus MOVE P1:P2
vplus MOVE SHIFT(P1 BY 10,,5)
vplus MOVE #PPOINT(0,-90,90,0,0,0)
ofw APPRO P1,50
ofw APPROS P1,50
ofw DEPART 50
ofw DEPARTS 50
miz DRIVE 1,10,50
miz DRIVE 1,1e-05,50
ofw DRAW 10,,-20
ofw ALIGN
ofw READY
miz NEST
ofw DELAY 0.5
ofw OPEN
ofw OPEN 50
ofw OPENI
ofw CLOSE
ofw CLOSEI
ppt CLOSEI 20
ofw RELAX
ppt RELAXI
ofw GRASP 12.7
ppt GRASP 12.7,120
ofw RIGHTY
ofw LEFTY
ofw ABOVE
ofw BELOW
ofw FLIP
ofw NOFLIP
ofw SPEED 50
ppt SPEED 50 ALWAYS
ppt SPEED 10 IPS
ppt SPEED 200 MMPS ALWAYS
nc4 COARSE
ofw COARSE ALWAYS
ofw FINE
ofw NULL
ofw NONULL
ofw INTON
ofw INTOFF ALWAYS
vplus BREAK
ofw SIGNAL 1,-3
ppt SIGNAL N
ppt WAIT SIG(1001)
ppt WAIT SIG(1001,-1002)
ofw WAIT 1001
ofw REACT 1001
ofw REACT 1001,MAIN
ppt REACTI 1001,MAIN,5
ofw REACTI 1001,MAIN ALWAYS
ofw IGNORE 1001
ofw IGNORE 1001 ALWAYS
ppt RUNSIG 3
ppt LOCK 1
ppt RESET
rx90 SET P3 = P1
rx90 SET #R = #PPOINT(0,-90,90)
vplus SET #R = PPOINT(0,-90,90)
vplus SET P3 = SCALE(P1 BY 2)
vplus SET P[1,2] = HERE
ppt SET P3 = P1:TRANS(0,0,10)
ppt SET P[2] = HERE
ppt SET P3 = INVERSE(P1)
ppt SET P3 = FRAME(P1,P2,P3,P1)
ppt SET P3 = P1:RZ(90)
ppt SET P3 = RX(10):RY(20)
ppt SET P3 = DEST
ppt HERE P3
vplus HERE P1:P3
ppt HERE #R
ppt TOOL P1
ppt TOOL NULL
ppt BASE 10,20
ppt N = 3
ppt N = (N+2)*3/4-1
ppt N = N MOD 4
ppt A[N] = A[1]+1
ppt N = -2^2
ppt N = SIN(30)+COS(60)
ppt N = SQRT(ABS(N))
ppt N = ATAN2(1,2)
ppt N = INT(N)+FRACT(N)
ppt N = MAX(1,N)-MIN(1,N)
ppt N = DISTANCE(P1,P2)
ppt N = DX(P1)+DY(P1)+DZ(P1)
ppt N = TIMER(1)
ppt N = BITS(1001,4)
ppt N = INRANGE(P1)
ppt N = DEFINED(P1)
ppt N = SIG(1001) AND NOT SIG(1002)
ppt N = SIGN(-3)*SQR(2)
vplus N = 6 BAND 3
ppt N = 1 EQ 2
ppt N = 1.5E3
ppt TIMER 1 = 0
ppt PARAMETER HAND.TIME = 0.5
ppt ENABLE CP
ppt DISABLE CP
ppt DECOMPOSE A[1] = P1
ppt DECOMPOSE A[] = #Q
ppt TYPE \"text\"
ppt TYPE \"N is\",N
ppt TYPE /C2,\"a\",/X5,N,/S
ppt TYPE /F8.2,N
vplus TYPE /B,/I4,N
ppt PROMPT \"how many? \",N
ppt PROMPT N,M
ofw GOTO 10
ppt IF N > 2 GOTO 10
ppt IF N == 2 THEN
ppt ELSE
vplus ELSE IF N == 3 THEN
ppt END
ppt FOR I = 1 TO 10
ppt FOR I = 10 TO 1 STEP -2
ppt WHILE N < 3 DO
ppt DO
ppt UNTIL N >= 3
ppt CASE N OF
ppt VALUE 1,2:
ppt ANY
ppt EXIT
ppt NEXT
ppt CALL MAIN
ofw RETURN
ppt REACTE MAIN
ofw PAUSE
ofw STOP
ofw HALT
ofw 10 MOVE P1
ofw 10 MOVE P1 ; to the part
ofw ; a remark
";

/// Forms of VAL of 1980 that VAL II does not have, at the monitor and in a program.
const FIRST_MONITOR: &str = "
ofw LISTF
ofw DPOINT P1
ofw ERASE
ofw DO SETI N = 4
";

const FIRST_PROGRAM: &str = "
ofw SETI I = 3
ofw SETI I = I + 1
ofw SETI I = N / 2
ofw TYPEI N
ofw TYPE next part
ofw GOSUB MAIN
guide RETURN 1
ofw IF N EQ 3 THEN 20
guide IF N NE 3 THEN 20
guide IF N LT 3 THEN 20
guide IF N GT 3 THEN 20
guide IF N LE 3 THEN 20
guide IF N GE 3 THEN 20
ofw IFSIG 1001 THEN 20
guide IFSIG 1001,,-1003 THEN 20
ofw REMARK don't touch the jig
ofw 20 REMARK a label in front
ofw GO P1
ofw MOVEI P1
ofw APPROI P1,50
ofw PAUSE change the tool
guide STOP no parts
ofw SHIFT P1 BY 10,,5
ofw INVERSE P3 = P1
ofw FRAME P3 = P1,P2,P4
";

/// Forms of V+, for the record.
const V_PLUS: &str = "
vplus CALL part(1,n)
vplus AUTO i
vplus LOCAL i
vplus GLOBAL i
vplus $a = \"text\"
vplus IF n > 2 GOTO 10
vplus HERE p:q
vplus ELSE IF n == 3 THEN
vplus FOR i = 1 TO 3
vplus WHILE TRUE DO
vplus SET p = SCALE(p BY 2)
vplus DECOMPOSE a[] = p
vplus SET p[1,2] = HERE
vplus TIMER 1 = 0
vplus WAIT.EVENT 1
vplus ATTACH (5)
vplus REACTE recover
vplus ALTER
vplus SPEED 50 ALWAYS
vplus PARAMETER HAND.TIME = 0.3
";

/// Faults that say: this form is not understood.
const UNKNOWN: [&str; 8] = [
    "*Illegal monitor command*",
    "*Illegal instruction*",
    "*Unknown instruction*",
    "*Invalid argument*",
    "*Ambiguous name*",
    "*Unknown switch*",
    "*Name too long*",
    "*Line too long*",
];

const MEMORY: &str = ".PROGRAM MAIN\n TYPE 1\n.END\n.LOCATIONS\nP1 600,150,100,90,90,0\n\
    P2 0,0,10,90,-90,0\n#Q 0,-60,140,0,40,0\n.END\n.REALS\nN 3\n.END";

fn forms(table: &str) -> Vec<&str> {
    let lines = table.lines().filter_map(|line| line.split_once(' '));
    lines.map(|(_, form)| form).collect()
}

/// Types a form at the monitor of a controller with programs, locations and files.
fn is_taken_by_monitor(form: &str, profile: Profile) -> bool {
    let mut console = Console::ready_with(profile);
    console.emulator.load_text(MEMORY).unwrap();
    console.emulator.insert_file("KEPT", MEMORY.to_owned());
    let said = console.line_now(form);
    !UNKNOWN.iter().any(|fault| said.contains(fault))
}

fn is_taken_by_editor(form: &str, profile: Profile) -> bool {
    let mut console = Console::ready_with(profile);
    console.line("EDIT FORM");
    let said = console.line(form);
    !UNKNOWN.iter().any(|fault| said.contains(fault))
}

#[test]
fn forms_of_val_2_are_understood() {
    let (monitor, program) = (forms(MONITOR), forms(PROGRAM));
    let all = monitor.len() + program.len();
    let mut missing: Vec<&str> = monitor;
    missing.retain(|form| !is_taken_by_monitor(form, Profile::val2()));
    missing.extend(
        program
            .iter()
            .filter(|form| !is_taken_by_editor(form, Profile::val2())),
    );
    println!(
        "VAL II: {} of {all} forms; missing: {missing:?}",
        all - missing.len()
    );
    assert!(missing.is_empty(), "{missing:?}");
    let mut of_v_plus = forms(V_PLUS);
    let all = of_v_plus.len();
    of_v_plus.retain(|form| !is_taken_by_editor(form, Profile::val2()));
    println!(
        "V+: {} of {all} forms; missing: {of_v_plus:?}",
        all - of_v_plus.len()
    );
    assert!(of_v_plus.len() <= 4);
}

#[test]
fn forms_of_the_first_val_are_understood() {
    let (mut monitor, mut program) = (forms(FIRST_MONITOR), forms(FIRST_PROGRAM));
    let all = monitor.len() + program.len();
    // VAL II, by itself, knows none but a few.
    let of_val_2 = |form: &&str| is_taken_by_editor(form, Profile::val2());
    assert!(program.iter().filter(|form| of_val_2(form)).count() <= 1);
    monitor.retain(|form| !is_taken_by_monitor(form, Profile::val()));
    program.retain(|form| !is_taken_by_editor(form, Profile::val()));
    println!("VAL: {all} forms; missing: {monitor:?} {program:?}");
    assert!(monitor.is_empty() && program.is_empty());
}

#[test]
fn a_wait_for_a_number_waits_for_that_signal() {
    let mut console = Console::ready();
    console.program("W", "WAIT 1001\nTYPE \"came\"");
    assert!(!console.line("EXECUTE W").contains("came"));
    console.emulator.set_signal(1001, true).unwrap();
    console.settle();
    assert!(console.screen.contains("came"));
}

#[test]
fn unknown_switches_are_refused() {
    let mut console = Console::ready();
    for name in ["FOO", "NETWORK", "SUPERVISOR"] {
        assert!(
            console
                .line(&format!("ENABLE {name}"))
                .contains("*Unknown switch*")
        );
    }
    assert!(!console.line("SWITCH").contains("FOO"));
}

#[test]
fn a_fault_names_its_own_step_and_retry_repeats_it() {
    let mut console = Console::ready();
    console.program("OOPS", "TYPE 1\nTYPE LATER\nTYPE 3");
    assert!(
        console
            .line("EXECUTE OOPS")
            .contains("Program aborted at OOPS, step 2")
    );
    console.line("DO LATER = 22");
    assert!(
        console
            .line("RETRY")
            .contains(" 22\r\n 3\r\nProgram completed")
    );
}

#[test]
fn timers_bits_loops_and_turns_do_what_they_say() {
    let mut console = Console::ready();
    console.emulator.set_signal(1001, true).unwrap();
    console.emulator.set_signal(1003, true).unwrap();
    let said = console.run(
        "TIMER 1 = 0\nDELAY 2\nTYPE INT(TIMER(1)),BITS(1001,4)
        FOR I = 1 TO 9\nIF I == 2 THEN\nNEXT\nEND\nIF I == 4 THEN\nEXIT\nEND\nTYPE I\nEND
        TYPE DEFINED(NOWHERE),INRANGE(TRANS(2000))
        SET T = RZ(90)\nTYPE DX(T:TRANS(0,5))
        GRASP 10,20\nTYPE \"never\"\n20 TYPE \"end\"",
    );
    let typed: Vec<&str> = said
        .lines()
        .skip(1)
        .map(|l| l.trim_matches(['*', ' ']))
        .collect();
    assert_eq!(
        typed[1..8],
        ["2 5", "1", "3", "0 1", "-5", "end", "Program completed"],
        "{said}"
    );
}

#[test]
fn a_primed_program_starts_with_proceed() {
    let mut console = Console::ready();
    console.program("P", "TYPE \"go\"");
    assert!(!console.line("PRIME P").contains("go"));
    assert!(console.line("PROCEED").contains("go\r\nProgram completed"));
}
