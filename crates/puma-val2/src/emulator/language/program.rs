//! A stored program: its steps, and which step each control word leads to.

use crate::emulator::language::instruction::{Instruction, label};
use crate::emulator::language::lexer::{Cursor, Token, strange_word, tokens};
use crate::emulator::language::val;
use crate::emulator::message::{Fault, Message};

/// Stored program.
#[derive(Clone, Debug, Default)]
pub(crate) struct Program {
    /// Names of what `CALL` hands over, in its order.
    pub(crate) parameters: Vec<String>,
    pub(crate) steps: Vec<Step>,
}

/// Line of a program.
#[derive(Clone, Debug)]
pub(crate) struct Step {
    pub(crate) label: Option<u32>,
    /// Text in listings.
    pub(crate) text: String,
    pub(crate) instruction: Instruction,
}

impl Step {
    /// Parses a line: an optional label and an instruction. `first_val` takes the forms of VAL.
    pub(crate) fn parse(line: &str, first_val: bool) -> Result<Self, Fault> {
        Self::parse_or_word(line, first_val).map_err(|(fault, _)| fault)
    }

    /// Parses a line. The error has the first word that is not understood, if it is one word.
    pub(crate) fn parse_or_word(line: &str, first_val: bool) -> Result<Self, (Fault, String)> {
        let line = printable(line);
        let said = match first_val {
            true => val::translated(&line),
            false => line.clone(),
        };
        let tokens = tokens(&said).map_err(|fault| (fault, strange_word(&said)))?;
        let mut cursor = Cursor::new(&tokens);
        let labelled = matches!(cursor.peek(), Some(Token::Number(_)));
        let parsed = labelled.then(|| label(&mut cursor)).transpose();
        let parsed = parsed.and_then(|label| Ok((label, Instruction::parse(&mut cursor)?)));
        let (label, instruction) = parsed.map_err(|fault| (fault, cursor.culprit()))?;
        Ok(Self {
            label,
            text: upper_case(line.trim()),
            instruction,
        })
    }
}

/// Parses the name of a variable or location; that of a precision point begins with `#`.
pub(crate) fn local_name(cursor: &mut Cursor<'_>) -> Result<String, Fault> {
    let precision = cursor.sign("#");
    let name = cursor.name()?;
    Ok(if precision { format!("#{name}") } else { name })
}

/// Replaces what no terminal shows: a tabulator by a blank, other characters by question marks.
fn printable(line: &str) -> String {
    line.chars()
        .map(|c| match c {
            ' '..='~' => c,
            c if c.is_whitespace() => ' ',
            _ => '?',
        })
        .collect()
}

/// Converts to upper case, except texts in quotes and comments.
fn upper_case(line: &str) -> String {
    let mut quoted = false;
    let mut comment = false;
    line.chars()
        .map(|c| {
            quoted ^= c == '"' && !comment;
            comment |= c == ';' && !quoted;
            if quoted || comment {
                c
            } else {
                c.to_ascii_uppercase()
            }
        })
        .collect()
}

impl Program {
    /// Returns the first line of a listing: the name and the parameters, if there are any.
    pub(crate) fn head(&self, name: &str) -> String {
        match self.parameters[..] {
            [] => format!(".PROGRAM {name}"),
            _ => format!(".PROGRAM {name}({})", self.parameters.join(",")),
        }
    }

    /// Parses the name of a program and its parameters in brackets.
    pub(crate) fn parse_head(cursor: &mut Cursor<'_>) -> Result<(String, Vec<String>), Fault> {
        let name = cursor.name()?;
        let mut parameters = Vec::new();
        if cursor.sign("(") && !cursor.sign(")") {
            parameters = cursor.list(local_name)?;
            cursor.expect_sign(")")?;
        }
        cursor.expect_end()?;
        Ok((name, parameters))
    }

    /// Returns the step with the label.
    pub(crate) fn labelled(&self, label: u32) -> Result<usize, Fault> {
        self.steps
            .iter()
            .position(|s| s.label == Some(label))
            .ok_or(Message::UndefinedLabel.into())
    }

    /// Returns the next control word at the level of the one at `step`: from `IF` the `ELSE` or
    /// `END`, from `CASE` or `VALUE` the next `VALUE`, `ANY` or `END`, from `DO` the `UNTIL`, from
    /// the others the `END`.
    pub(crate) fn next_part(&self, step: usize) -> Result<usize, Fault> {
        let mut depth = 0;
        for (i, later) in self.steps.iter().enumerate().skip(step + 1) {
            match &later.instruction {
                word if word.opens() => depth += 1,
                word if word.closes() && depth > 0 => depth -= 1,
                word if word.closes() => return Ok(i),
                Instruction::Else(_) | Instruction::Value(_) | Instruction::Any if depth == 0 => {
                    return Ok(i);
                }
                _ => {}
            }
        }
        Err(Message::ControlStructure.into())
    }

    /// Returns the `END` or `UNTIL` of the structure of `step`.
    pub(crate) fn end_of(&self, step: usize) -> Result<usize, Fault> {
        let mut at = self.next_part(step)?;
        while !self.steps[at].instruction.closes() {
            at = self.next_part(at)?;
        }
        Ok(at)
    }

    /// Returns the head (`IF`, `FOR`, `WHILE`, `DO`, `CASE`) of the structure that ends at `step`.
    pub(crate) fn head_of(&self, step: usize) -> Result<usize, Fault> {
        let mut depth = 0;
        for (i, earlier) in self.steps.iter().enumerate().take(step).rev() {
            match &earlier.instruction {
                word if word.closes() => depth += 1,
                word if word.opens() && depth > 0 => depth -= 1,
                word if word.opens() => return Ok(i),
                _ => {}
            }
        }
        Err(Message::ControlStructure.into())
    }

    /// Returns the head of the loop around `step`.
    pub(crate) fn loop_of(&self, step: usize) -> Result<usize, Fault> {
        let mut head = self.head_of(step)?;
        while matches!(
            self.steps[head].instruction,
            Instruction::IfThen(_) | Instruction::Case(_)
        ) {
            head = self.head_of(head)?;
        }
        Ok(head)
    }

    /// Checks that the words of every structure match. The error is the first step that does not
    /// fit.
    pub(crate) fn check(&self) -> Result<(), usize> {
        let mut open: Vec<&Instruction> = Vec::new();
        for (i, step) in self.steps.iter().enumerate() {
            let fits = match &step.instruction {
                head if head.opens() => {
                    open.push(head);
                    true
                }
                Instruction::Else(_) => matches!(open.last(), Some(Instruction::IfThen(_))),
                Instruction::Value(_) | Instruction::Any => {
                    matches!(open.last(), Some(Instruction::Case(_)))
                }
                Instruction::Until(_) => matches!(open.pop(), Some(Instruction::Do)),
                Instruction::End => !matches!(open.pop(), None | Some(Instruction::Do)),
                _ => true,
            };
            if !fits {
                return Err(i);
            }
        }
        if open.is_empty() {
            Ok(())
        } else {
            Err(self.steps.len().saturating_sub(1))
        }
    }
}
