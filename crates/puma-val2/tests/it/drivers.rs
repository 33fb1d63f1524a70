//! Sessions of public drivers at the emulator's terminal: the dialogue is theirs, the code is not.
//! What the terminal shows is compared with `tests/golden`.

use crate::console::Console;
use crate::session::compare;
use puma_val2::Profile;

/// State that a reply leaves behind, as these drivers see it.
#[derive(Debug, PartialEq)]
enum State {
    Ready,
    Asks,
    Refused,
}

fn state(reply: &str) -> State {
    if reply.trim_end().ends_with('?') {
        State::Asks
    } else if reply.matches('*').count() >= 2 {
        State::Refused
    } else {
        assert!(reply.ends_with("\r\n."), "{reply:?}");
        State::Ready
    }
}

/// A driver that ends its lines in a way of its own.
struct Driver {
    console: Console,
    end: &'static str,
}

impl Driver {
    fn new(profile: Profile, end: &'static str) -> Self {
        let console = Console::switched_on(profile);
        Self { console, end }
    }

    fn write(&mut self, line: &str, expected: State) -> String {
        let reply = self.console.typed(&format!("{line}{}", self.end));
        assert_eq!(state(&reply), expected, "{line}: {reply}");
        reply
    }
}

/// All numbers of a text, in their order.
fn numbers(text: &str) -> Vec<f64> {
    let is_part = |c: char| c.is_ascii_digit() || c == '.' || c == '-';
    let words = text.split(|c| !is_part(c));
    words.filter_map(|word| word.parse().ok()).collect()
}

/// A ROS driver of a PUMA 260 (puma260_driver): lines end with LF CR, numbers are printed by `%g`,
/// positions are counted from the end of the reply, `#x` is its point.
#[test]
fn the_ros_driver_of_a_puma_260() {
    let mut driver = Driver::new(Profile::val2_strict_miz(), "\n\r");
    for (line, expected) in [
        ("y", State::Asks),
        ("y", State::Ready),
        ("cal", State::Asks),
        ("y", State::Ready),
        ("do ready", State::Ready),
        ("speed 10", State::Ready),
        ("do drive 1, 10.5, 50", State::Ready),
        ("do drive 2, 1e-05, 50", State::Ready),
        ("do drive 1, 400, 50", State::Refused),
        ("point #x", State::Asks),
        ("20, -80.25, 95, 0, 30, -5", State::Asks),
        ("", State::Ready),
        ("do move #x", State::Ready),
        ("do move trans(450,150,2e+02,90,90,0)", State::Ready),
        ("do move trans(4500,150,200,90,90,0)", State::Refused),
    ] {
        driver.write(line, expected);
    }
    let shown = driver.write("where", State::Ready);
    let shown = numbers(&shown);
    let position = &shown[shown.len() - 18..][..6];
    assert_eq!(position, [450.0, 150.0, 200.0, 90.0, 90.0, 0.0]);
    let joints = &shown[shown.len() - 6..];
    for (shown, is) in joints.iter().zip(driver.console.degrees()) {
        assert!((shown - is).abs() < 1e-3);
    }
    driver.write("do nest", State::Ready);
    compare("driver_ros_260.txt", &driver.console.screen);
}

/// A C++ driver of a Staubli RX90 (used by several projects): lines end with CR LF; it reads up to
/// the first full stop, and for `HERE` up to the question first.
#[test]
fn the_serial_driver_of_an_rx90() {
    let mut driver = Driver::new(Profile::val2(), "\r\n");
    for line in ["N", "N", "CAL", "Y"] {
        driver.console.line(line);
    }
    let ready = |driver: &mut Driver, line: &str| {
        let reply = driver.write(line, State::Ready);
        assert_eq!(reply.find('.'), Some(reply.len() - 1), "{line}: {reply}");
    };
    ready(&mut driver, "DO SET #ORIGIN=#PPOINT(0,-45,180,0,45,0)");
    ready(&mut driver, "SPEED 30");
    ready(&mut driver, "DO ABOVE");
    ready(&mut driver, "DO MOVE #ORIGIN");
    driver.write("HERE ORIGIN", State::Asks);
    ready(&mut driver, "");
    ready(&mut driver, "DO OPENI");
    ready(&mut driver, "DO ENABLE CP");
    for (x, y) in [(25, 0), (25, 25), (7, 42)] {
        ready(&mut driver, &format!("DO SET P=SHIFT(ORIGIN BY {x},{y},0)"));
        ready(&mut driver, "SPEED 10");
        ready(&mut driver, "DO MOVES P");
    }
    ready(&mut driver, "DO SET P=SHIFT(ORIGIN BY 7,42,-30)");
    ready(&mut driver, "DO MOVE P");
    ready(&mut driver, "DO CLOSEI");
    ready(&mut driver, "DO SET #POSE=#PPOINT(20,-77,150,5,45,-43)");
    ready(&mut driver, "DO MOVE #POSE");
    driver
        .console
        .assert_at([20.0, -77.0, 150.0, 5.0, 45.0, -43.0]);
    ready(&mut driver, "PANIC");
    compare("driver_rx90.txt", &driver.console.screen);
}

/// Scripts of owners that keep a V+ controller's habits: words in any case, abbreviated, points by
/// `HERE`, steps in the directions of the world.
#[test]
fn the_jog_script_of_an_owner() {
    let mut driver = Driver::new(Profile::val2(), "\r\n");
    for line in ["N", "N", "CAL", "Y"] {
        driver.console.line(line);
    }
    for line in ["en cp", "speed 10", "do drive 1,45,10", "do drive 3,-30,10"] {
        driver.write(line, State::Ready);
    }
    driver.write("HERE a", State::Asks);
    driver.write("", State::Ready);
    for line in ["do draw ,,-15", "do draw 15", "do move a", "do moves a"] {
        driver.write(line, State::Ready);
    }
    driver.console.assert_at([45.0, -90.0, 60.0, 0.0, 0.0, 0.0]);
    driver.write("do moves b", State::Refused);
    compare("driver_jog.txt", &driver.console.screen);
}

/// A loader of program files (`pload` of a university's terminal): the text goes into the editor
/// line by line, and is listed and run.
#[test]
fn the_loader_of_program_files() {
    let mut driver = Driver::new(Profile::val2(), "\r");
    for line in ["N", "N", "CAL", "Y"] {
        driver.console.line(line);
    }
    driver.write("POINT PART", State::Asks);
    driver.write("400,150,100,90,90,0", State::Asks);
    driver.write("", State::Ready);
    driver.write("EDIT PICK", State::Asks);
    for step in [
        "SPEED 50 ALWAYS",
        "OPENI",
        "APPRO PART,80",
        "MOVES PART",
        "CLOSEI",
        "DEPARTS 80",
        "TYPE \"PICKED\"",
    ] {
        driver.write(step, State::Asks);
    }
    driver.write("E", State::Ready);
    driver.write("LISTP PICK", State::Ready);
    let said = driver.console.line("EXECUTE PICK");
    assert!(said.contains("PICKED\r\n"), "{said}");
    driver.write("WHERE", State::Ready);
    driver.write("DELETEP PICK", State::Asks);
    driver.write("Y", State::Ready);
    compare("driver_pload.txt", &driver.console.screen);
}
