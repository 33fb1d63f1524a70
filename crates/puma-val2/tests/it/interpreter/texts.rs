//! Programs and data as text, and lines that are too much for the controller.

use puma_val2::{Emulator, Event, Message, Profile, PumaParams};

use crate::console::Console;

#[test]
fn text_goes_out_and_in_unchanged() {
    let mut console = Console::ready();
    console.program(
        "A",
        "10 TYPE \"Hello; World\" ; greet\nIF N > 2 GOTO 10\nMOVE P",
    );
    console.lines("DO SET P = TRANS(1,2,3,4,5,6)\nDO HERE #Q\nDO N = 2.5\nDO B[3] = -1");
    let text = console.emulator.text();
    let mut other = Console::ready();
    other.emulator.load_text(&text).unwrap();
    assert_eq!(other.emulator.text(), text);
    let error = other
        .emulator
        .load_text(".PROGRAM X\n FROB\n.END")
        .unwrap_err();
    assert_eq!(
        (error.line, error.fault.message),
        (2, Message::UnknownInstruction)
    );
    assert!(other.emulator.load_text(".REALS\nN 1").is_err());
    assert_eq!(other.emulator.text(), text);
}

/// A text with a value that is none is refused with VAL's own message, and nothing of it is kept.
#[test]
fn a_bad_value_in_a_file_is_refused_and_nothing_is_half_loaded() {
    let mut console = Console::ready();
    console.line("DO N = 1");
    let before = console.emulator.text();
    for bad in [
        "P 1,x,2,3,4,5,6",
        "P 1,2,3,4,5,6,seven",
        "P 1,2,,3,4,5,6",
        "P 1,2,3,4,5,nan",
        "P 1,2,3,4,5,inf",
        "#P 1,2,3,4,5,6,",
        "P 1,2,3,4,5",
    ] {
        let text =
            format!(".PROGRAM GOOD\n TYPE 1\n.END\n.LOCATIONS\nQ 1,2,3,4,5,6\n{bad}\n.END\n");
        let error = console.emulator.load_text(&text).unwrap_err();
        assert_eq!(
            (error.line, error.fault.message),
            (6, Message::InvalidArgument),
            "{bad}"
        );
        assert_eq!(console.emulator.text(), before);
        console.emulator.insert_file("DISK", text);
        assert!(
            console.line("LOAD DISK").contains("*Invalid argument*"),
            "{bad}"
        );
        assert_eq!(console.emulator.text(), before);
    }
    for bad in ["N one", "N nan", "N infinity", "N"] {
        let text = format!(".REALS\nM 5\n{bad}\n.END\n");
        assert!(console.emulator.load_text(&text).is_err(), "{bad}");
        assert_eq!(console.emulator.text(), before);
    }
}

/// Expressions as deep as they are long, in a text and at the terminal, whatever line length the
/// profile allows.
#[test]
fn lines_without_end_are_refused() {
    let lines = |n: usize| {
        [
            format!("X = 1{}", "+1".repeat(n)),
            format!("X = {}1{}", "(".repeat(n), ")".repeat(n)),
            format!("X = {}1", "-".repeat(n)),
            format!("X = {}1{}", "A[".repeat(n), "]".repeat(n)),
            format!("MOVE {}P{}", "INVERSE(".repeat(n), ")".repeat(n)),
        ]
    };
    for max_line in [128, usize::MAX] {
        let profile = || Profile {
            max_line,
            ..Profile::val2()
        };
        for line in lines(500_000) {
            let mut emulator = Emulator::new(PumaParams::unimation(), profile());
            let error = emulator
                .load_text(&format!(".PROGRAM LONG\n {line}\n.END\n"))
                .unwrap_err();
            let wanted = if max_line == 128 {
                Message::LineTooLong
            } else {
                Message::InvalidArgument
            };
            assert_eq!((error.line, error.fault.message), (2, wanted));
        }
        for (n, wanted) in [
            (6_000, "*Line too long*"),
            (
                400,
                if max_line == 128 {
                    "*Line too long*"
                } else {
                    "*Invalid argument*"
                },
            ),
        ] {
            for line in lines(n) {
                let said = Console::ready_with(profile()).line(&format!("DO {line}"));
                assert!(
                    said.ends_with(&format!("{wanted}\r\n.")),
                    "{n} {max_line}: {line:.30}"
                );
            }
        }
    }
    // A chain that fits is worked out.
    let mut console = Console::ready();
    let sum = format!("DO X = 1{}", "+1".repeat(55));
    assert!(!console.line(&sum).contains('*'));
    assert_eq!(console.emulator.real("X"), Some(56.0));
}

/// The beginning of a line that does not fit is not carried out: it may mean something else.
#[test]
fn a_line_longer_than_the_buffer_is_refused_in_every_dialogue() {
    let mut console = Console::ready_with(Profile {
        max_line: 20,
        ..Profile::val2()
    });
    // The first twenty characters are a motion of their own.
    let said = console.line("DO DRIVE 1,10,100    ; a remark");
    assert!(said.contains("*Line too long*\r\n."), "{said}");
    console.assert_at([0.0, -90.0, 90.0, 0.0, 0.0, 0.0]);
    // Deleted or shortened in time, it is a line like any other.
    console.line("DO N = 1 ; much too long for it\x15DO N = 2");
    assert_eq!(console.emulator.real("N"), Some(2.0));
    console.line("DO N = 3 ;aaaaaaaaaaa\x7f");
    assert_eq!(console.emulator.real("N"), Some(3.0));
    console.line("EDIT P");
    let said = console.line("TYPE \"0123456789abcdef\"");
    assert!(
        said.contains("*Line too long*") && said.ends_with(" 1.? "),
        "{said}"
    );
    console.line("E");
    console.line("POINT #A");
    let said = console.line("1.000,2.000,3.000,4.000,5.000,6.000");
    assert!(
        said.contains("*Line too long*") && said.ends_with("Change?\r\n"),
        "{said}"
    );
    console.line("");
    console.line("CAL");
    assert!(
        console
            .line(&"Y".repeat(30))
            .ends_with("Are you sure (Y/N)? ")
    );
    console.line("N");
    console.line("DO PROMPT N");
    assert!(
        console
            .line("1.0000000000000000000")
            .ends_with("*Line too long*\r\n? ")
    );
    console.line("4");
    assert_eq!(console.emulator.real("N"), Some(4.0));
}

/// A busy monitor buffers typed characters up to its limit, line ends included. A line typed while
/// the monitor is idle is not counted.
#[test]
fn the_input_buffer_holds_what_it_says() {
    let mut console = Console::ready_with(Profile {
        input_buffer: 24,
        line_time: std::time::Duration::from_millis(500),
        ..Profile::val2()
    });
    console.emulator.take_events();
    let lost = |console: &mut Console| {
        let is_loss = |event: &Event| *event == Event::CharacterLost;
        console
            .emulator
            .take_events()
            .iter()
            .filter(|e| is_loss(e))
            .count()
    };
    // Longer than the buffer, but nothing waits before it.
    console.line("DO X = 1 ; longer than the input buffer");
    assert_eq!(
        (lost(&mut console), console.emulator.real("X")),
        (0, Some(1.0))
    );
    console.wait(std::time::Duration::from_secs(1));
    // The first is worked on at once, three lines of seven characters and an end fill the buffer,
    // the fourth is lost.
    console.line_now("DO X = 2");
    for name in ["A", "B", "C"] {
        console.line_now(&format!("DO {name}=11"));
        assert_eq!(lost(&mut console), 0, "{name}");
    }
    console.line_now("DO D=11");
    assert_eq!(lost(&mut console), 7);
    console.settle();
    for name in ["A", "B", "C"] {
        assert_eq!(console.emulator.real(name), Some(11.0));
    }
    assert_eq!(console.emulator.real("D"), None);
    console.wait(std::time::Duration::from_secs(1));
    // Lines without a character cannot pile up either.
    console.line_now("DO X = 3");
    console.emulator.feed(&[b'\r'; 1000], console.now);
    assert!(lost(&mut console) > 900);
}

/// The letter forms of the file commands touch their kind only, on the disk and in memory.
#[test]
fn files_by_kind() {
    let mut console = Console::ready();
    console.program("A", "TYPE 1");
    console.lines("DO SET P = TRANS(1,2,3,4,5,6)\nDO HERE #Q\nDO N = 2.5");
    console.lines("STORE ALL\nSTOREP PROGS\nSTOREL PLACES\nSTORER REALS\nSTOREL ONE=#Q");
    let disk = console.emulator.floppy().clone();
    let holds = |file: &str| {
        [".PROGRAM A", "\nP 1", "\n#Q ", ".REALS"].map(|part| disk[file].contains(part))
    };
    assert_eq!(holds("ALL"), [true; 4]);
    assert_eq!(holds("PROGS"), [true, false, false, false]);
    assert_eq!(holds("PLACES"), [false, true, true, false]);
    assert_eq!(holds("REALS"), [false, false, false, true]);
    assert_eq!(holds("ONE"), [false, false, true, false]);

    for refused in ["STORE BAD=NOBODY", "STOREP BAD=A,P", "STORER BAD=#Q"] {
        assert!(
            console.line(refused).contains("*Undefined value*"),
            "{refused}"
        );
    }
    assert!(!console.emulator.floppy().contains_key("BAD"));

    let now = |console: &Console| {
        let text = console.emulator.text();
        [".PROGRAM A", "\nP 1", "\n#Q ", ".REALS"].map(|part| text.contains(part))
    };
    for (load, expected) in [
        ("LOADP ALL", [true, false, false, false]),
        ("LOADL ALL", [false, true, true, false]),
        ("LOADR ALL", [false, false, false, true]),
        ("LOAD ALL", [true; 4]),
    ] {
        console.lines("ZERO\nY");
        assert_eq!(now(&console), [false; 4]);
        console.line(load);
        assert_eq!(now(&console), expected, "{load}");
    }
    console.lines("DELETEL P,#Q\nY\nDELETER N\nN");
    assert_eq!(now(&console), [true, false, false, true]);
    console.lines("DELETER N\nY\nDELETEP A\nY");
    assert_eq!(now(&console), [false; 4]);
}

#[test]
fn files_are_deleted_when_that_is_confirmed() {
    let mut console = Console::ready();
    console.lines("STORE A\nSTORE B\nSTORE C\nFDELETE B\nN");
    assert_eq!(console.emulator.floppy().len(), 3);
    console.emulator.take_events();
    console.lines("FDELETE B\nY");
    assert!(console.line("FDELETE B").contains("\n*"));
    assert!(!console.line("FDIRECTORY").contains("B\r\n"));
    console.lines("FORMAT\nN");
    assert_eq!(console.emulator.floppy().len(), 2);
    console.lines("FORMAT\nY");
    assert!(console.emulator.floppy().is_empty());
    let deleted: Vec<_> = console
        .emulator
        .take_events()
        .into_iter()
        .filter_map(|event| match event {
            Event::FileDeleted(name) => Some(name),
            _ => None,
        })
        .collect();
    assert_eq!(deleted, ["B", "A", "C"]);
}

#[test]
fn values_that_are_typed_may_have_a_sign() {
    let mut console = Console::ready();
    console.lines("POINT #Q\n+10,-85,+95");
    console.line("");
    assert!(
        console
            .line("LISTL #Q")
            .contains("10.000   -85.000    95.000")
    );
    console.lines("DO PROMPT A,B\n+5,-6");
    assert_eq!(
        [console.emulator.real("A"), console.emulator.real("B")],
        [Some(5.0), Some(-6.0)]
    );
    for bad in ["+-5", "-+5", "+", "5,+"] {
        console.line("DO PROMPT A");
        assert!(console.line(bad).contains("*Invalid argument*"), "{bad}");
        console.line("1");
    }
}

#[test]
fn lists_that_take_no_names_refuse_them() {
    let mut console = Console::ready();
    console.program("A", "TYPE 1");
    for list in ["DIRECTORY", "FDIRECTORY", "IO", "STATUS", "SWITCH"] {
        assert!(!console.line(list).contains('*'), "{list}");
        let said = console.line(&format!("{list} A"));
        assert!(said.contains("*Invalid argument*"), "{said}");
    }
}
