//! Everything about a controller that is not known for certain, as values.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::emulator::message::{Fault, Message};
use crate::joints::Joints;

/// Behaviour of an emulated controller that may differ from one machine, release or source to
/// another.
///
/// The wire protocol of VAL II is documented in fragments only. Facts that two independent sources
/// agree on are built in; everything else is here, so that a client can be tried against
/// controllers that answer otherwise. Defaults are those of [`Profile::val2`].
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// Name, for messages and for a command line.
    pub name: &'static str,
    /// Questions at start-up, in order (default: load from floppy, initialize). The answer `Y` to
    /// one that speaks of initializing erases programs, locations and variables and sets the speed
    /// to 100 %.
    pub boot: Vec<String>,
    /// Line printed after them (default: `PUMA 560  VAL-II`); empty for none.
    pub banner: String,
    /// Sends back what is typed (default: yes).
    pub echo: bool,
    /// End of a line to the terminal (default: CR LF).
    pub eol: &'static str,
    /// Blank lines before every reply (default: 0).
    pub blank_lines: usize,
    /// Prompt when no program runs (default: `.`).
    pub idle_prompt: char,
    /// Prompt while a program runs (default: `*`).
    pub run_prompt: char,
    /// Prints the joints before X Y Z O A T in `WHERE`, in the manner of AS, VAL's Japanese
    /// relative (default: no).
    pub joints_first: bool,
    /// Width of a number column (default: 9 in `WHERE`; `HERE` and `POINT` add one).
    pub width: usize,
    /// Decimals of millimetres (default: 2).
    pub length_decimals: usize,
    /// Decimals of degrees (default: 3).
    pub angle_decimals: usize,
    /// Words that head the joint columns of `WHERE` before their digit (default: `JT`).
    pub joint_heading: &'static str,
    /// Shows a hand column at the end of the Cartesian line of `WHERE` (default: no).
    pub hand_column: bool,
    /// Question of `HERE` and `POINT` (default: `Change?`); a line end follows.
    pub change_text: String,
    /// Holds the prompt after `DO` back until the end of the motion (default: yes).
    pub do_blocks: bool,
    /// Hears `PANIC` and `ABORT` while `DO` blocks (default: yes).
    pub stop_while_busy: bool,
    /// Knows `#PPOINT(...)` (default: yes).
    pub ppoint: bool,
    /// Takes the forms of VAL of 1980 beside those of VAL II: `SETI`, `GOSUB`, `IFSIG` and the like
    /// (default: no).
    pub first_val: bool,
    /// Lets `DO REACTI` watch a signal without a program running (default: yes).
    pub react_at_monitor: bool,
    /// Largest value of the monitor's `SPEED`, percent (default: 200). Larger ones are cut to it.
    pub speed_max: f64,
    /// Messages with another wording than the default.
    pub messages: BTreeMap<Message, String>,
    /// Longest name of a program, location or variable (default: 15).
    pub max_name: usize,
    /// Longest line (default: 128), typed or in a file. Further characters are refused with a bell
    /// and the line with a message, because its beginning alone may mean something else.
    pub max_line: usize,
    /// Most entries of each kind (programs, locations, variables) and most steps of a program
    /// (default: 1000).
    pub max_entries: usize,
    /// Speed of the line, bits per second (default: none, characters take no time).
    pub baud: Option<u32>,
    /// Time the monitor takes to digest a line (default: 0). Characters that arrive meanwhile wait
    /// in `input_buffer`.
    pub line_time: Duration,
    /// Characters that can wait behind a line that the monitor has not come to (default: 256),
    /// those lines and their ends included. Further ones are lost.
    pub input_buffer: usize,
    /// Time one program step takes (default: 2 ms), at least 0.1 ms.
    pub step_time: Duration,
    /// Understands control characters (default: yes): Ctrl-C cancels a line or the running command,
    /// Ctrl-U deletes the line, DEL and BS a character, Ctrl-S and Ctrl-Q hold and release the
    /// output, Ctrl-O drops it.
    pub control_characters: bool,
    /// Arm power at start (default: `None`, off until `CALIBRATE` is answered with yes, as if an
    /// operator pressed the button then).
    /// [`Emulator::set_arm_power`](super::Emulator::set_arm_power) presses it at any time.
    pub start_power: Option<bool>,
    /// Knows its joint angles at start (default: no).
    pub start_calibrated: bool,
    /// Joint angles at start (default: READY).
    pub start: Joints,
    /// Goal of `NEST`. The real pose is not known; the arm folded above the shoulder is an
    /// assumption.
    pub nest: Joints,
    /// Time in which a joint reaches its full speed (default: 0.25 s).
    pub acceleration_time: Duration,
    /// Time in which a motion that is broken off comes to a stand (default: 60 ms).
    pub stop_time: Duration,
    /// Speed of straight-line motion at 100 %, metres per second (default: 0.5).
    pub line_speed: f64,
    /// Turning speed of straight-line motion at 100 %, radians per second (default: pi/2).
    pub line_turn: f64,
    /// Time of a full opening or closing of the hand (default: 0.3 s).
    pub hand_time: Duration,
    /// Period at which sensors and armed reactions are looked at during a motion (default: 28 ms,
    /// VAL's trajectory period).
    pub tick: Duration,
    /// Lets the arm stand, and shows it, at whole encoder counts only (default: no).
    pub encoder_counts: bool,
    /// Checks a straight line over its whole length before it starts (default: no, the arm stops
    /// where the line leaves its reach).
    pub check_line_ahead: bool,
    /// Refuses a joint-interpolated move to a transformation that the present posture cannot reach,
    /// though another could (default: no). From a pose between two postures, READY for instance,
    /// the nearer one is taken in either case.
    pub keeps_posture: bool,
    /// Makes `DRIVE` end short by this many degrees (default: 0); a fault for trying out clients.
    pub drive_error_degrees: f64,
}

impl Profile {
    /// Returns the behaviour that the sources agree on, with the plainest assumption where they are
    /// silent.
    pub fn val2() -> Self {
        Self {
            name: "val2",
            boot: vec![
                "Load VAL from floppy (Y/N)? ".into(),
                "Initialize (Y/N)? ".into(),
            ],
            banner: "PUMA 560  VAL-II".into(),
            echo: true,
            eol: "\r\n",
            blank_lines: 0,
            idle_prompt: '.',
            run_prompt: '*',
            joints_first: false,
            width: 9,
            length_decimals: 2,
            angle_decimals: 3,
            joint_heading: "JT",
            hand_column: false,
            change_text: "Change?".into(),
            do_blocks: true,
            stop_while_busy: true,
            ppoint: true,
            first_val: false,
            react_at_monitor: true,
            speed_max: 200.0,
            messages: BTreeMap::new(),
            max_name: 15,
            max_line: 128,
            max_entries: 1000,
            baud: None,
            line_time: Duration::ZERO,
            input_buffer: 256,
            step_time: Duration::from_millis(2),
            control_characters: true,
            start_power: None,
            start_calibrated: false,
            start: Joints::READY,
            nest: Joints::from_degrees([0.0, -215.0, 215.0, 0.0, 0.0, 0.0]),
            acceleration_time: Duration::from_millis(250),
            stop_time: Duration::from_millis(60),
            line_speed: 0.5,
            line_turn: std::f64::consts::FRAC_PI_2,
            hand_time: Duration::from_millis(300),
            tick: Duration::from_millis(28),
            encoder_counts: false,
            check_line_ahead: false,
            keeps_posture: false,
            drive_error_degrees: 0.0,
        }
    }

    /// Returns only the abilities that a client for a real PUMA 260 controller relies on: no
    /// `#PPOINT`, no control characters, no reactions from the monitor, `PANIC` unheard while `DO`
    /// blocks, six-character names, at most 100 % speed. Arm power is on.
    pub fn val2_strict_miz() -> Self {
        Self {
            name: "val2_strict_miz",
            ppoint: false,
            control_characters: false,
            react_at_monitor: false,
            stop_while_busy: false,
            max_name: 6,
            speed_max: 100.0,
            start_power: Some(true),
            ..Self::val2()
        }
    }

    /// Returns [`Profile::val2`] with a real line and arm: 9600 baud, a slow monitor with a small
    /// input buffer, joint angles in whole encoder counts.
    pub fn val2_hardware() -> Self {
        Self {
            name: "val2_hardware",
            baud: Some(9600),
            line_time: Duration::from_millis(20),
            input_buffer: 80,
            encoder_counts: true,
            ..Self::val2()
        }
    }

    /// Returns a controller with VAL of 1980: one question at start-up, six-character names, no
    /// `#PPOINT`, no reactions from the monitor, and VAL's own forms beside the words of VAL II.
    pub fn val() -> Self {
        Self {
            name: "val",
            boot: vec!["Initialize (Y/N)? ".into()],
            banner: "PUMA 560  VAL".into(),
            first_val: true,
            ppoint: false,
            react_at_monitor: false,
            max_name: 6,
            ..Self::val2()
        }
    }

    /// Returns the profiles of this crate.
    pub fn all() -> [Self; 4] {
        [
            Self::val2(),
            Self::val2_strict_miz(),
            Self::val2_hardware(),
            Self::val(),
        ]
    }

    /// Returns the profile of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::all().into_iter().find(|p| p.name == name)
    }

    /// Returns the time of one character: a start bit, eight data bits and a stop bit.
    pub(crate) fn char_time(&self) -> Option<Duration> {
        self.baud.map(|baud| Duration::from_secs(10) / baud.max(1))
    }

    /// Refuses a name that is too long for the controller.
    pub(crate) fn check_name(&self, name: &str) -> Result<(), Fault> {
        if name.len() > self.max_name {
            return Err(Message::NameTooLong.into());
        }
        Ok(())
    }

    /// Returns the wording of a message.
    pub(crate) fn text(&self, message: Message) -> &str {
        self.messages
            .get(&message)
            .map_or(message.default_text(), String::as_str)
    }
}

impl Default for Profile {
    /// [`Profile::val2`].
    fn default() -> Self {
        Self::val2()
    }
}
