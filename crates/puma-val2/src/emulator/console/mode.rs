//! The dialogue that the terminal is in.

use crate::emulator::language::expr::Variable;
use crate::emulator::language::place::Place;
use crate::emulator::language::program::Program;

/// The dialogue that the next line from the terminal belongs to.
#[derive(Debug)]
pub(crate) enum Mode {
    /// The answer to the start-up question of this number.
    Boot(usize),
    /// A command.
    Monitor,
    /// The answer to "are you sure?".
    Confirm(Confirm),
    /// New values for a location, or nothing to keep what it has.
    Change { key: String, place: Place },
    /// A line for the editor.
    Editor(Editing),
    /// Values for a program's `PROMPT`.
    Answer(Vec<Variable>),
    /// Nothing: `DO` has the terminal until its motion ends.
    Busy,
}

/// What is done when the answer is yes.
#[derive(Debug)]
pub(crate) enum Confirm {
    Calibrate,
    Zero,
    Delete(Vec<(Kind, String)>),
    Format,
}

/// A kind of thing that has a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Program,
    Place,
    Real,
    File,
}

/// A program in the editor.
#[derive(Debug)]
pub(crate) struct Editing {
    pub(crate) name: String,
    pub(crate) program: Program,
    /// The step that the next line is for, from 0.
    pub(crate) at: usize,
    /// Whether lines are inserted before the step instead of replacing it.
    pub(crate) inserting: bool,
}
