//! Errors between a program and an arm.

use std::io;
use std::time::Duration;

use crate::joints::{Joint, Joints};

/// Error of an arm or of the line to it.
///
/// `port` names the line as the caller gave it: a device path, a socket address, or a word for an
/// arm in memory.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ArmError {
    /// The device or socket cannot be opened: no such port, no permission, or another program holds
    /// it.
    #[error("{port}: cannot be opened: {source}")]
    Open {
        /// The line.
        port: String,
        /// Error of the system.
        source: io::Error,
    },
    /// The line failed in use: unplugged, or closed by the other side.
    #[error("{port}: the line failed while {doing}: {source}")]
    Line {
        /// The line.
        port: String,
        /// Action under way.
        doing: String,
        /// Error of the system.
        source: io::Error,
    },
    /// No complete answer came in time.
    #[error(
        "{port}: no complete answer to `{sent}` within {waited:?}: expected {expected}, heard \
         {heard:?}"
    )]
    Silence {
        /// The line.
        port: String,
        /// Line sent.
        sent: String,
        /// Description of a complete answer, and the setting that limits the time.
        expected: String,
        /// Text that had come, shortened.
        heard: String,
        /// Time waited.
        waited: Duration,
    },
    /// The controller shows no prompt: it hears nothing, or waits for the end of a motion.
    #[error(
        "{port}: the controller shows no prompt for {waited:?}: the arm may be moving; wait for \
         the end of its motion, or press the emergency stop on the panel"
    )]
    Busy {
        /// The line.
        port: String,
        /// Time waited.
        waited: Duration,
    },
    /// A program on the controller asks for values. It may move the arm by what it is answered.
    #[error(
        "{port}: a program asks {question:?}: answer it at the controller's terminal, stop it, or \
         connect with `abort_running_program`"
    )]
    Asked {
        /// The line.
        port: String,
        /// Question, shortened.
        question: String,
    },
    /// An answer cannot be understood.
    #[error("{port}: the answer to `{sent}` makes no sense: expected {expected}, heard {heard:?}")]
    Garbled {
        /// The line.
        port: String,
        /// Line sent.
        sent: String,
        /// Description of a sound answer.
        expected: String,
        /// Text that came instead, shortened.
        heard: String,
    },
    /// The controller refused a command with its own message.
    #[error("{port}: `{sent}` was refused by the controller: *{message}*")]
    Refused {
        /// The line.
        port: String,
        /// Line sent.
        sent: String,
        /// The controller's words, without the asterisks.
        message: String,
    },
    /// The controller refused a step of a text of programs. Nothing was changed.
    #[error(
        "{port}: line {line} of the text, `{step}`, was refused by the controller{}: *{message}*",
        .word.as_ref().map(|word| format!(" at `{word}`")).unwrap_or_default()
    )]
    Step {
        /// The line to the controller.
        port: String,
        /// Number of the line of the text, from 1.
        line: usize,
        /// Step that was typed.
        step: String,
        /// First word of the step, if the controller does not know it.
        word: Option<String>,
        /// The controller's words, without the asterisks.
        message: String,
    },
    /// The arm stands, but not where it was sent.
    #[error(
        "{port}: {name} was sent to {wanted_degrees:.3} degrees but reports {reported_degrees:.3}"
    )]
    NotReached {
        /// The line.
        port: String,
        /// Joint that is furthest off.
        joint: Joint,
        /// Its name, as the arm calls it.
        name: String,
        /// Goal.
        wanted_degrees: f64,
        /// Reported angle.
        reported_degrees: f64,
    },
    /// A move would take a joint out of its limits; nothing was sent.
    #[error(
        "{name} cannot go to {wanted_degrees:.3} degrees: its range is {min_degrees:.1} to \
         {max_degrees:.1}"
    )]
    JointLimit {
        /// Joint.
        joint: Joint,
        /// Its name, as the arm calls it.
        name: String,
        /// Goal.
        wanted_degrees: f64,
        /// Lower limit.
        min_degrees: f64,
        /// Upper limit.
        max_degrees: f64,
    },
    /// An angle is NaN or infinite; nothing was sent.
    #[error("the angle asked of {name} is not a finite number")]
    NotFinite {
        /// Joint.
        joint: Joint,
        /// Its name, as the arm calls it.
        name: String,
    },
    /// The controller has been started again in mid-session and asks its start-up questions.
    /// Connect and calibrate again.
    #[error(
        "{port}: the controller has been restarted: it says {heard:?}; connect and calibrate again"
    )]
    Restarted {
        /// The line.
        port: String,
        /// Text of the controller, shortened.
        heard: String,
    },
    /// A motion was commanded, and the arm's position cannot be read any more. The commands that
    /// stop it have been sent if the line took them.
    #[error("{port}: the outcome of a motion is not known, the arm may be moving: {cause}")]
    Unconfirmed {
        /// The line.
        port: String,
        /// Joint angles that the arm last reported.
        last_known: Option<Joints>,
        /// Error that kept the arm from reporting.
        cause: Box<ArmError>,
    },
    /// The proximity signal stopped the arm on its way.
    #[error("{port}: stopped by signal {signal} at {joints}")]
    ProximityStop {
        /// The line.
        port: String,
        /// Input that came on.
        signal: u16,
        /// Joint angles at which the arm stands.
        joints: Joints,
    },
    /// A text of programs, locations and reals does not say what it should. Nothing was changed.
    #[error("line {line} of the text {problem}: {text}")]
    Text {
        /// Number of the line, from 1.
        line: usize,
        /// Text of the line, shortened.
        text: String,
        /// Fault of the line.
        problem: &'static str,
    },
    /// A controller holds other contents under names of a backup. Nothing was changed.
    #[error("{port}: the controller holds other contents of {names}: nothing was stored")]
    Conflict {
        /// The line.
        port: String,
        /// Kinds and names.
        names: String,
    },
    /// A setting is out of its range. Nothing was sent.
    #[error("{what} cannot be {value}: {allowed}")]
    Setting {
        /// Name of the setting.
        what: &'static str,
        /// Rejected value.
        value: String,
        /// Values that are allowed.
        allowed: &'static str,
    },
    /// A fault of another kind of arm, in its own words.
    #[error("{0}")]
    Other(String),
}
