//! Messages of the controller, for refusals and for what has ended.

use std::fmt;

use crate::joints::Joint;

/// Message of the controller, by its meaning. The wording belongs to the profile: the classes are
/// known, the texts mostly are not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Message {
    /// No such monitor command.
    IllegalCommand,
    /// An instruction in the wrong place.
    IllegalInstruction,
    /// No such instruction.
    UnknownInstruction,
    /// An argument that is missing, superfluous or meaningless.
    InvalidArgument,
    /// An abbreviation of more than one word.
    AmbiguousName,
    /// A line longer than the controller's line buffer.
    LineTooLong,
    /// A name longer than the controller keeps.
    NameTooLong,
    /// A location or variable that has no value.
    UndefinedValue,
    /// A program that is missing.
    UndefinedProgram,
    /// A label without a step.
    UndefinedLabel,
    /// No such switch.
    UnknownSwitch,
    /// `IF`, `FOR`, `WHILE`, `DO`, `CASE` and their ends do not match.
    ControlStructure,
    /// Too many programs, names or nested calls.
    OutOfMemory,
    /// A number without a meaning: division by zero, root of a negative number.
    ArithmeticError,
    /// A signal number that is missing, or an input that was to be set.
    IllegalSignal,
    /// A place out of reach, or a joint out of its range.
    OutOfRange,
    /// A place too close to the column.
    TooClose,
    /// A servo did not follow.
    EnvelopeError,
    /// Arm power is off.
    ArmPowerOff,
    /// The arm does not know its joint angles yet.
    NotCalibrated,
    /// A program runs: the command has to wait.
    Busy,
    /// No program runs or can go on.
    NotRunning,
    /// A file cannot be read or written.
    File,
    /// A program ended.
    Completed,
    /// A program was aborted.
    Aborted,
    /// A program came to `PAUSE`.
    Paused,
    /// A program came to `HALT`, from where it cannot go on.
    Halted,
    /// A question that asks for confirmation, without its `(Y/N)?`.
    AreYouSure,
    /// The answer was neither yes nor no.
    AnswerYesOrNo,
}

impl Message {
    /// Returns the wording of the standard profile.
    pub(crate) const fn default_text(self) -> &'static str {
        match self {
            Self::IllegalCommand => "Illegal monitor command",
            Self::IllegalInstruction => "Illegal instruction",
            Self::UnknownInstruction => "Unknown instruction",
            Self::InvalidArgument => "Invalid argument",
            Self::AmbiguousName => "Ambiguous name",
            Self::LineTooLong => "Line too long",
            Self::NameTooLong => "Name too long",
            Self::UndefinedValue => "Undefined value",
            Self::UndefinedProgram => "Undefined program",
            Self::UndefinedLabel => "Undefined label",
            Self::UnknownSwitch => "Unknown switch",
            Self::ControlStructure => "Control structure error",
            Self::OutOfMemory => "Out of memory",
            Self::ArithmeticError => "Arithmetic error",
            Self::IllegalSignal => "Illegal signal number",
            Self::OutOfRange => "Location out of range",
            Self::TooClose => "Location too close",
            Self::EnvelopeError => "Envelope error",
            Self::ArmPowerOff => "Arm power off",
            Self::NotCalibrated => "Arm not calibrated",
            Self::Busy => "Program executing",
            Self::NotRunning => "No program executing",
            Self::File => "File error",
            Self::Completed => "Program completed",
            Self::Aborted => "Program aborted",
            Self::Paused => "Program paused",
            Self::Halted => "Program halted",
            Self::AreYouSure => "Are you sure",
            Self::AnswerYesOrNo => "Answer with one of: Y, N",
        }
    }
}

/// Refusal of a command or an instruction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Meaning of the fault.
    pub message: Message,
    /// Joint that it concerns.
    pub joint: Option<Joint>,
}

impl Fault {
    /// Creates a fault that concerns `joint`.
    pub(super) fn at(message: Message, joint: Joint) -> Self {
        Self {
            message,
            joint: Some(joint),
        }
    }
}

impl From<Message> for Fault {
    fn from(message: Message) -> Self {
        Self {
            message,
            joint: None,
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.message.default_text())?;
        match self.joint {
            Some(joint) => write!(f, " {joint}"),
            None => Ok(()),
        }
    }
}
