//! The program `val2`.
#![allow(clippy::print_stdout, clippy::print_stderr)] // Output of a program.

mod commands;
mod emulate;
mod failure;
mod files;
mod floppy;
mod keys;
mod link;
mod term;

use std::ffi::OsString;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Parser, Subcommand};

use crate::program::failure::Failure;

const EXIT_CODES: &str = "\
The controller is named by --port or --tcp, or by the variable VAL2_PORT. Commands that move the arm
ask first, unless --yes; `jog`, `move` and `run` set the monitor's speed to 10 %, unless --speed,
and the others keep it. A motion is stopped by Ctrl-C, Ctrl-\\, SIGTERM, and by a terminal that
closes (SIGHUP, unless the program runs by nohup).

Exit codes: 0 done, 1 failed, 2 wrong usage, 3 refused by the controller, 4 the line failed or no
VAL monitor answers, 5 not confirmed, 6 the arm may be moving: press the emergency stop,
130 stopped by a signal.";

/// Drives PUMA robots with a VAL II controller, keeps their programs, and emulates one.
#[derive(Debug, Parser)]
#[command(name = "val2", version, after_help = EXIT_CODES)]
struct Arguments {
    #[command(flatten)]
    globals: Globals,
    #[command(subcommand)]
    command: Command,
}

/// Options before the subcommand.
#[derive(Debug, Args)]
struct Globals {
    /// Serial port of the controller: /dev/ttyUSB0, COM3.
    #[arg(long, value_name = "DEV", conflicts_with = "tcp")]
    port: Option<String>,
    /// Address of a terminal server or an emulator.
    #[arg(long, value_name = "HOST:PORT")]
    tcp: Option<String>,
    /// Speed of the line [default: 9600].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(50..))]
    baud: Option<u32>,
    /// Arm, whose ranges are checked before a move: 260, 560 (the default) or 762.
    #[arg(long, value_name = "NUMBER", value_parser = ["260", "560", "762"])]
    arm: Option<String>,
    /// Abilities of the controller: val2 (the default), val2_hardware, val (of 1980), or
    /// val2_strict_miz, which knows neither control characters nor #PPOINT.
    #[arg(long, value_name = "NAME")]
    profile: Option<String>,
    /// Write what passes on the line to this file.
    #[arg(long, value_name = "FILE")]
    transcript: Option<PathBuf>,
    /// Print JSON.
    #[arg(long, global = true)]
    json: bool,
    /// Ask nothing.
    #[arg(long, global = true)]
    yes: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Calibrate the arm: every joint moves a little.
    Calibrate,
    /// Show the joint angles and the pose of the hand.
    Where {
        /// Show them again and again, until Ctrl-C.
        #[arg(long)]
        watch: bool,
    },
    /// Turn one joint, or jog by keys if none is named.
    ///
    /// With keys, 1 to 6 choose a joint, and the arm moves in small steps while + or - is held.
    Jog {
        /// Joint, 1 to 6.
        #[arg(requires = "degrees", value_parser = clap::value_parser!(u8).range(1..=6))]
        joint: Option<u8>,
        /// Degrees to turn by.
        #[arg(allow_negative_numbers = true)]
        degrees: Option<f64>,
        #[command(flatten)]
        speed: Speed,
    },
    /// Move to six joint angles, to a location that the controller knows, or to READY.
    Move {
        /// Six joint angles in degrees, the name of a location, or `ready`.
        #[arg(required = true, num_args = 1..=6, allow_negative_numbers = true)]
        to: Vec<String>,
        /// Take six numbers as the pose of the hand: X Y Z (mm) O A T (degrees).
        #[arg(long)]
        hand: bool,
        /// Move the hand along a straight line.
        #[arg(long)]
        straight: bool,
        #[command(flatten)]
        speed: Speed,
    },
    /// Open or close the hand.
    Hand {
        /// New state.
        #[arg(value_parser = ["open", "close"])]
        state: String,
    },
    /// Set the monitor's speed.
    Speed {
        /// Percent.
        percent: f64,
    },
    /// Define a location as the arm's present position. A name with # keeps the joint angles.
    Teach {
        /// Name of the location.
        name: String,
    },
    /// List programs, locations and reals.
    Ls,
    /// Print a program.
    Get {
        /// Name of the program.
        name: String,
    },
    /// Store the programs of a file, from .PROGRAM NAME to .END each.
    Put {
        /// File, or - for the standard input.
        file: PathBuf,
    },
    /// Delete a program, a location or a real.
    Rm {
        /// Name.
        name: String,
    },
    /// Write all programs, locations and reals to a file.
    Backup {
        /// File, or - for the standard output.
        file: PathBuf,
    },
    /// Put a backup back. What is there already is kept; other contents are replaced if confirmed.
    Restore {
        /// File, or - for the standard input.
        file: PathBuf,
        /// Say what would be done, and do nothing.
        #[arg(long)]
        dry_run: bool,
    },
    /// Start a program.
    Run {
        /// Name of the program.
        name: String,
        /// Number of runs; -1 runs it without end.
        #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
        cycles: i32,
        /// Wait for its end, at most 60 seconds, and print its output.
        #[arg(long, conflicts_with = "cycles")]
        wait: bool,
        #[command(flatten)]
        speed: Speed,
    },
    /// Stop the arm and a running program, also while the arm moves for another program.
    Stop,
    /// Show the state of the monitor.
    Status,
    /// Show the signals.
    Io,
    /// Show or set a signal.
    Signal {
        /// Number: 1 and up outputs, 1001 and up inputs, 2001 and up soft signals.
        number: u16,
        /// New state.
        #[arg(value_parser = ["on", "off"])]
        state: Option<String>,
    },
    /// Type a line to the monitor and print the answer. A question is left with no.
    Send {
        /// The line.
        #[arg(required = true, trailing_var_arg = true, allow_hyphen_values = true)]
        line: Vec<String>,
    },
    /// Be a terminal of the controller. Lines that are not typed by a person wait for the prompt.
    Term,
    /// Emulate a VAL II controller with a PUMA 560, for any terminal program.
    ///
    /// The first line printed is `listening on PATH`. Lines typed here are the controller's panel:
    /// `power on`, `power off`, `signal 1001 on`, `joints`, `restart`, `quit`.
    Emulate(emulate::Options),
}

/// Speed of a command that moves the arm.
#[derive(Clone, Copy, Debug, Args)]
struct Speed {
    /// Monitor speed for this motion, percent. The monitor keeps it.
    #[arg(long = "speed", value_name = "PERCENT", default_value_t = 10.0)]
    percent: f64,
}

/// Runs the program `val2` with these arguments, of which the first is its name.
pub fn val2(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let arguments = match Arguments::try_parse_from(arguments) {
        Ok(arguments) => arguments,
        Err(error) => {
            let _ = error.print();
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
        }
    };
    let globals = &arguments.globals;
    let outcome = match &arguments.command {
        Command::Emulate(options) => match globals.given() {
            None => emulate::run(options).map_err(Failure::from),
            Some(option) => Err(Failure::usage(format!(
                "{option} is not for `emulate`: its own options come after the word"
            ))),
        },
        command => link::with_line(globals, command),
    };
    let Err(failure) = outcome else {
        return ExitCode::SUCCESS;
    };
    if failure.text.is_empty() {
        return ExitCode::from(failure.code);
    }
    let text = if globals.json {
        serde_json::json!({"error": failure.text, "exit_code": failure.code}).to_string()
    } else {
        format!("error: {}", failure.text)
    };
    // The terminal may be closed.
    let _ = writeln!(std::io::stderr(), "{text}");
    ExitCode::from(failure.code)
}

impl Globals {
    /// Returns the first option that was given.
    fn given(&self) -> Option<&'static str> {
        [
            ("--port", self.port.is_some()),
            ("--tcp", self.tcp.is_some()),
            ("--baud", self.baud.is_some()),
            ("--arm", self.arm.is_some()),
            ("--profile", self.profile.is_some()),
            ("--transcript", self.transcript.is_some()),
            ("--json", self.json),
            ("--yes", self.yes),
        ]
        .into_iter()
        .find_map(|(name, given)| given.then_some(name))
    }
}
