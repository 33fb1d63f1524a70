//! The dialogue that the terminal is in.

use crate::emulator::language::expr::Variable;
use crate::emulator::language::place::Place;
use crate::emulator::language::program::Program;

/// Dialogue that the next line from the terminal belongs to.
#[derive(Debug)]
pub(crate) enum Mode {
    /// Answer to the start-up question of this number.
    Boot(usize),
    /// Command.
    Monitor,
    /// Answer to "are you sure?".
    Confirm(Confirm),
    /// New values for a location, or nothing to keep what it has.
    Change { key: String, place: Place },
    /// Line for the editor.
    Editor(Editing),
    /// Values for a program's `PROMPT`.
    Answer(Vec<Variable>),
    /// Nothing: `DO` has the terminal until its motion ends.
    Busy,
}

/// Action that follows the answer yes.
#[derive(Debug)]
pub(crate) enum Confirm {
    Calibrate,
    Zero,
    Delete(Vec<(Kind, String)>),
    Format,
    /// Leave the monitor: the start-up dialogue begins.
    Done,
}

/// Kind of a named thing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Program,
    Place,
    Real,
    File,
}

/// Program in the editor.
#[derive(Debug)]
pub(crate) struct Editing {
    pub(crate) name: String,
    pub(crate) program: Program,
    /// Index of the step that the next line is for.
    pub(crate) at: usize,
    /// Lines are inserted before the step instead of replacing it.
    pub(crate) inserting: bool,
}
