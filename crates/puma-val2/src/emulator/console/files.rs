//! Programs, locations and variables as text: the emulated floppy disk.
//!
//! ```text
//! .PROGRAM LOOK
//!  SPEED 20 ALWAYS
//!  MOVES P1
//! .END
//! .LOCATIONS
//! P1 75.14,164.64,915.57,100,-80,0
//! #P2 10,-85,95,0,0,0
//! .END
//! .REALS
//! N 3
//! .END
//! ```

use std::collections::BTreeMap;

use crate::emulator::console::mode::Kind;
use crate::emulator::controller::{Emulator, Event};
use crate::emulator::language::lexer::{Cursor, GREATEST, tokens};
use crate::emulator::language::place::Place;
use crate::emulator::language::place_expr::PlaceName;
use crate::emulator::language::program::{Program, Step};
use crate::emulator::machine::memory::Memory;
use crate::emulator::message::{Fault, Message};
use crate::emulator::profile::Profile;
use crate::joints::Joints;
use crate::kinematics::xyzoat::Xyzoat;

/// Error in a text of programs, locations and variables.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {fault}{}: {text}", in_quotes(word))]
pub struct TextError {
    /// Number of the line, from 1.
    pub line: usize,
    /// Fault of the line.
    pub fault: Fault,
    /// First word of the line that is not understood; empty if the fault is none of one word.
    pub word: String,
    /// Text of the line.
    pub text: String,
}

fn in_quotes(word: &str) -> String {
    match word {
        "" => String::new(),
        word => format!(" `{word}`"),
    }
}

impl Emulator {
    /// Returns all programs, locations and real variables as text for [`Emulator::load_text`].
    pub fn text(&self) -> String {
        text_of(&self.memory, |_, _| true)
    }

    /// Adds the programs, locations and variables of a text to the memory and replaces those of the
    /// same names. If any line is wrong, nothing is changed.
    ///
    /// # Errors
    /// The first line that cannot be read.
    pub fn load_text(&mut self, text: &str) -> Result<(), TextError> {
        self.memory = parsed(text, None, self.memory.clone(), &self.profile)?;
        Ok(())
    }

    /// Returns the files on the floppy disk, by name.
    pub fn floppy(&self) -> &BTreeMap<String, String> {
        &self.floppy
    }

    /// Puts a file on the floppy disk. The name is kept in upper case.
    pub fn insert_file(&mut self, name: &str, text: String) {
        self.floppy.insert(name.to_ascii_uppercase(), text);
    }

    /// Carries out `STORE file[=name,...]`: everything, one kind, or only the names given.
    pub(crate) fn store(
        &mut self,
        kind: Option<Kind>,
        cursor: &mut Cursor<'_>,
    ) -> Result<(), Fault> {
        let file = cursor.name()?;
        self.profile.check_name(&file)?;
        let name = |c: &mut Cursor<'_>| PlaceName::parse(c)?.key(&self.scope());
        let names = cursor.after_sign("=", |c| c.list(name))?;
        let names = names.unwrap_or_default();
        cursor.expect_end()?;
        let there = |name: &String| self.memory.kind_of(name, kind).is_some();
        if !names.iter().all(there) {
            return Err(Message::UndefinedValue.into());
        }
        let of_kind = |k: Kind| kind.is_none_or(|kind| kind == k);
        let wanted = |k: Kind, name: &str| {
            of_kind(k) && (names.is_empty() || names.iter().any(|n| n == name))
        };
        let text = text_of(&self.memory, wanted);
        self.store_file(file, text)
    }

    pub(crate) fn store_file(&mut self, file: String, text: String) -> Result<(), Fault> {
        if self.floppy.len() >= self.profile.max_entries && !self.floppy.contains_key(&file) {
            return Err(Message::File.into());
        }
        self.floppy.insert(file.clone(), text);
        self.note(Event::FileStored(file));
        Ok(())
    }

    /// Carries out `LOAD file`: everything in it, or one kind.
    pub(crate) fn load(
        &mut self,
        kind: Option<Kind>,
        cursor: &mut Cursor<'_>,
    ) -> Result<(), Fault> {
        let file = cursor.name()?;
        cursor.expect_end()?;
        let text = self.floppy.get(&file).ok_or(Message::File)?;
        match parsed(text, kind, self.memory.clone(), &self.profile) {
            Ok(memory) => self.memory = memory,
            Err(error) => {
                self.print_line(&format!("Line {}: {}", error.line, error.text));
                return Err(error.fault);
            }
        }
        Ok(())
    }
}

fn text_of(memory: &Memory, wanted: impl Fn(Kind, &str) -> bool) -> String {
    let mut text = String::new();
    for (name, program) in &memory.programs {
        if wanted(Kind::Program, name) {
            let steps = program.steps.iter().map(|step| format!(" {}", step.text));
            section(&mut text, &program.head(name), steps);
        }
    }
    let places = memory.places.iter();
    let places = places.filter(|(name, _)| wanted(Kind::Place, name));
    let mut places = places.map(|(name, place)| {
        let values = place.val().map(|v| format!("{v:.6}")).join(",");
        format!("{name} {values}")
    });
    if let Some(first) = places.next() {
        section(
            &mut text,
            ".LOCATIONS",
            std::iter::once(first).chain(places),
        );
    }
    let reals = memory.reals.iter();
    let reals = reals.filter(|(name, _)| wanted(Kind::Real, name));
    let mut reals = reals.map(|(name, value)| format!("{name} {value}"));
    if let Some(first) = reals.next() {
        section(&mut text, ".REALS", std::iter::once(first).chain(reals));
    }
    text
}

/// Adds a heading, lines and `.END`.
fn section(text: &mut String, heading: &str, lines: impl Iterator<Item = String>) {
    let all = std::iter::once(heading.to_owned()).chain(lines);
    for line in all.chain([".END".to_owned()]) {
        text.push_str(&line);
        text.push('\n');
    }
}

enum Section {
    None,
    Program(String, Program),
    Locations,
    Reals,
}

/// Returns `memory` with the contents of a text, all or one kind. The rest of the text must be
/// sound too.
fn parsed(
    text: &str,
    kind: Option<Kind>,
    mut memory: Memory,
    profile: &Profile,
) -> Result<Memory, TextError> {
    let mut section = Section::None;
    for (index, line) in text.lines().enumerate() {
        let line = line.trim();
        let mut word = String::new();
        let taken = take_line(line, &mut section, kind, &mut memory, profile, &mut word);
        taken.map_err(|fault| TextError {
            line: index + 1,
            fault,
            word,
            text: line.chars().take(80).collect(),
        })?;
    }
    match section {
        Section::None => Ok(memory),
        _ => Err(TextError {
            line: text.lines().count(),
            fault: Message::ControlStructure.into(),
            word: String::new(),
            text: "the section is not closed by .END".into(),
        }),
    }
}

/// Longest line outside a program; six numbers with names need less.
const DATA_LINE: usize = 512;

fn take_line(
    line: &str,
    section: &mut Section,
    kind: Option<Kind>,
    memory: &mut Memory,
    profile: &Profile,
    unknown: &mut String,
) -> Result<(), Fault> {
    let wanted = |k: Kind| kind.is_none_or(|kind| kind == k);
    let limit = match section {
        Section::Program(..) => profile.max_line,
        _ => DATA_LINE,
    };
    if line.len() > limit {
        return Err(Message::LineTooLong.into());
    }
    let upper = line.to_ascii_uppercase();
    let words: Vec<&str> = upper.split_whitespace().collect();
    match section {
        Section::None => {
            *section = match words[..] {
                [] => return Ok(()),
                [".PROGRAM", ..] => {
                    let tokens = tokens(&upper[".PROGRAM".len()..])?;
                    let (name, parameters) = Program::parse_head(&mut Cursor::new(&tokens))?;
                    let program = Program {
                        parameters,
                        ..Program::default()
                    };
                    Section::Program(sound_name(&name, profile)?, program)
                }
                [".LOCATIONS"] => Section::Locations,
                [".REALS"] => Section::Reals,
                _ => return Err(Message::InvalidArgument.into()),
            };
        }
        _ if upper == ".END" => {
            if let Section::Program(name, program) = std::mem::replace(section, Section::None)
                && wanted(Kind::Program)
            {
                memory.set_program(name, program, profile)?;
            }
        }
        // A line without a step: the editor takes none either.
        Section::Program(..) if words.is_empty() => {}
        Section::Program(_, program) => {
            if program.steps.len() >= profile.max_entries {
                return Err(Message::OutOfMemory.into());
            }
            let step = Step::parse_or_word(line, profile.first_val);
            program.steps.push(step.map_err(|(fault, word)| {
                *unknown = word;
                fault
            })?);
        }
        Section::Locations => {
            let [name, values] = words[..] else {
                return Err(Message::InvalidArgument.into());
            };
            let values: Vec<f64> = values.split(',').map(number).collect::<Result<_, _>>()?;
            let values: [f64; 6] = values.try_into().map_err(|_| Message::InvalidArgument)?;
            let (place, plain) = match name.strip_prefix('#') {
                Some(plain) => (Place::PrecisionPoint(Joints::from_degrees(values)), plain),
                None => (Place::Transformation(Xyzoat::from_val(values).pose()), name),
            };
            sound_name(plain, profile)?;
            if wanted(Kind::Place) {
                memory.set_place(name.to_owned(), place, profile)?;
            }
        }
        Section::Reals => {
            let [name, value] = words[..] else {
                return Err(Message::InvalidArgument.into());
            };
            let (name, value) = (sound_name(name, profile)?, number(value)?);
            if wanted(Kind::Real) {
                memory.set_real(name, value, profile)?;
            }
        }
    }
    Ok(())
}

/// Parses a number of a file. Words such as `inf` are refused.
fn number(text: &str) -> Result<f64, Fault> {
    let plain = text
        .bytes()
        .all(|b| b.is_ascii_digit() || b"+-.E".contains(&b.to_ascii_uppercase()));
    let value = plain.then(|| text.parse::<f64>().ok()).flatten();
    value
        .filter(|v| v.abs() <= GREATEST)
        .ok_or(Message::InvalidArgument.into())
}

/// Checks a name, possibly with indices.
fn sound_name(name: &str, profile: &Profile) -> Result<String, Fault> {
    let plain = match name.split_once('[') {
        Some((plain, index))
            if index
                .strip_suffix(']')
                .is_some_and(|all| all.split(',').all(|i| i.parse::<u16>().is_ok())) =>
        {
            plain
        }
        Some(_) => return Err(Message::InvalidArgument.into()),
        None => name,
    };
    let fits = plain.starts_with(|c: char| c.is_ascii_alphabetic())
        && plain
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || c == '.' || c == '_');
    if !fits {
        return Err(Message::InvalidArgument.into());
    }
    profile.check_name(plain)?;
    Ok(name.to_owned())
}
