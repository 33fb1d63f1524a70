//! Whole sessions at the terminal, compared character by character with what is kept in
//! `tests/golden`. With `REGENERATE=1` the kept ones are written anew; look at the difference
//! before keeping it.

use std::path::Path;

use crate::console::Console;
use puma_val2::Profile;

pub(crate) fn compare(name: &str, screen: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/golden")
        .join(name);
    let screen = screen.replace("\r\n", "\n");
    if std::env::var_os("REGENERATE").is_some() {
        std::fs::write(&path, &screen).unwrap();
    }
    let kept = std::fs::read_to_string(&path)
        .unwrap_or_default()
        .replace("\r\n", "\n");
    for (number, (now, then)) in screen.lines().zip(kept.lines()).enumerate() {
        assert_eq!(now, then, "{name}, line {}", number + 1);
    }
    assert_eq!(screen, kept, "{name}");
}

#[test]
fn the_example_session_of_the_reference() {
    let mut console = Console::switched_on(Profile::val2());
    console.lines(
        "N
        N
        DO READY
        CAL
        Y
        SPEED 50
        DO READY
        DO DRIVE 1,10,100
        DO DRIVE 2,5,100
        DO DRIVE 3,5,100
        WHERE
        DO DRIVE 1,200,100
        HERE P1

        DO MOVE #PPOINT(0,-90,90,0,0,0)
        DO OPENI
        EDIT HIT
        TYPE \"hit\"
        E
        EDIT LOOK
        SPEED 20 ALWAYS
        REACTI 1001,HIT
        MOVES P1
        WAIT SIG(1002)
        E
        EXECUTE LOOK
        STATUS
        ABORT",
    );
    compare("session.txt", &console.screen);
}

#[test]
fn lists_and_files() {
    let mut console = Console::ready();
    console.screen.clear();
    console.program("PICK", "APPRO P1,50\nMOVES P1\nCLOSEI\nDEPART 50");
    console.lines(
        "POINT P1
        400,150,300,90,90,0

        POINT #REST
        ,-90,90

        DO N = 3
        DO SET P2 = SHIFT(P1 BY 0,0,25.5)
        LISTL
        LISTP PICK
        LISTR
        DIRECTORY
        STORE ALL
        STOREP SOME=PICK
        FDIR
        DELETE PICK,P1
        Y
        DIRECTORY
        LISTL P1
        LOAD ALL
        DIRECTORY
        COPY PICK2=PICK
        RENAME PICK3=PICK2
        DIRECTORY
        SIGNAL 1,-2,5,2010
        IO
        ENABLE CP
        DISABLE FORCE
        SWITCH
        STATUS
        ZERO
        Y
        LISTL",
    );
    compare("lists.txt", &console.screen);
}

#[test]
fn messages_of_every_class() {
    let mut console = Console::switched_on(Profile::val2());
    console.lines(
        "PERHAPS
        N

        FROBNICATE
        READY
        S 50
        12
        (
        DO
        DO JUMP
        DO DR 1,2,3
        DO GOTO 10
        DO DRIVE 1,10
        DO DRIVE 7,10,100
        DO DRIVE 1,10,0
        DO READY
        SPEED -1
        SPEED
        DO X = Y
        DO X = 1/0
        DO X = SQRT(-1)
        DO SIGNAL 1001
        DO SIGNAL 65
        DO A.VERY.LONG.NAME.INDEED = 1
        EXECUTE NOTHING
        EXECUTE
        ABORT
        PROCEED
        LOAD NOTHING
        CAL
        MAYBE
        N
        WHERE 1
        CAL
        Y
        DO MOVE TRANS(2000)
        DO MOVE TRANS(0,50,300,90,90,0)
        DO DRIVE 1,200,100
        DO MOVES TRANS(2000)
        DO MOVE P9
        DO MOVE #PPOINT(1,2,3):TRANS(1)
        PANIC",
    );
    compare("messages.txt", &console.screen);
}

#[test]
fn the_editor() {
    let mut console = Console::ready();
    console.screen.clear();
    console.lines(
        "EDIT DEMO.1
        10 appro part,50 ; above the part
        moves part
        TYPE \"Here it is\"
        nonsense
        GOTO 10
        S 2
        I
        SPEED 20
        OPENI

        D
        L 2
        P 9
        E
        LISTP
        EDIT DEMO.1,2
        E",
    );
    compare("editor.txt", &console.screen);
}
