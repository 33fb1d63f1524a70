//! The program editor.

use crate::emulator::console::mode::Editing;
use crate::emulator::console::mode::Mode;
use crate::emulator::controller::Emulator;
use crate::emulator::language::lexer::{Cursor, Token, tokens};
use crate::emulator::language::program::{Program, Step, local_name};
use crate::emulator::message::{Fault, Message};

/// Formats a step for a listing.
pub(crate) fn numbered(index: usize, text: &str) -> String {
    format!("{:>3}.  {text}", index + 1)
}

impl Emulator {
    /// Carries out `EDIT program[,step]`.
    pub(crate) fn edit(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        let name = match cursor.peek() {
            None => self.edited_last.clone().ok_or(Message::UndefinedProgram)?,
            Some(_) => cursor.name()?,
        };
        let mut parameters = None;
        if cursor.sign("(") {
            parameters = Some(cursor.list(local_name)?);
            cursor.expect_sign(")")?;
        }
        let mut at = 0;
        if cursor.sign(",") {
            match cursor.next() {
                Some(Token::Number(step)) if *step >= 1.0 && *step <= 32767.0 => {
                    at = *step as usize - 1;
                }
                _ => return Err(Message::InvalidArgument.into()),
            }
        }
        cursor.expect_end()?;
        self.profile.check_name(&name)?;
        let mut program = match self.memory.programs.get(&name) {
            Some(program) => (**program).clone(),
            None => {
                // It exists from now on, and memory for it is found or not.
                self.memory
                    .set_program(name.clone(), Program::default(), &self.profile)?;
                Program::default()
            }
        };
        program.parameters = parameters.unwrap_or(program.parameters);
        self.print_line(&program.head(&name));
        self.edited_last = Some(name.clone());
        let at = at.min(program.steps.len());
        self.editor_prompt(Editing {
            name,
            program,
            at,
            inserting: false,
        });
        Ok(())
    }

    pub(crate) fn editor_prompt(&mut self, editing: Editing) {
        self.terminal.resume();
        if let Some(step) = editing.program.steps.get(editing.at)
            && !editing.inserting
        {
            self.print_line(&numbered(editing.at, &step.text));
        }
        self.terminal.fresh_line(&self.profile, self.now);
        self.print(&format!("{:>2}.? ", editing.at + 1));
        self.mode = Mode::Editor(editing);
    }

    /// Ends editing and keeps the program.
    pub(crate) fn leave_editor(&mut self) {
        if let Mode::Editor(editing) = std::mem::replace(&mut self.mode, Mode::Monitor) {
            self.keep(editing);
        }
        self.prompt();
    }

    fn keep(&mut self, editing: Editing) {
        let Editing { name, program, .. } = editing;
        if let Err(fault) = self.memory.set_program(name, program, &self.profile) {
            self.refuse(fault);
        }
    }

    /// Handles a line typed to the editor: one of its own commands, or a step.
    ///
    /// `E` ends; an empty line goes to the next step; `S n` to step n, `P n` prints n steps, `L`
    /// goes one step back, `D n` deletes n steps, `R step` replaces the step, `I` inserts until an
    /// empty line.
    pub(crate) fn edit_line(&mut self, mut editing: Editing, line: &str) {
        let text = line.trim().to_ascii_uppercase();
        let mut words = text.split_whitespace();
        let (command, next) = (words.next().unwrap_or_default(), words.next());
        // `C = 3` is a step, an assignment to C.
        let assigns = next.is_some_and(|word| word.starts_with(['=', '[']));
        let command = if assigns { "=" } else { command };
        let argument = next.map(str::parse::<usize>);
        let count = match argument {
            None => Some(1),
            Some(Ok(number)) => Some(number.min(self.profile.max_entries)),
            Some(Err(_)) => None,
        };
        match (command, count) {
            ("E", Some(_)) if argument.is_none() => {
                self.keep(editing);
                return self.prompt();
            }
            ("S", Some(number)) => {
                editing.at = number.saturating_sub(1).min(editing.program.steps.len());
            }
            ("L", Some(number)) => editing.at = editing.at.saturating_sub(number),
            ("P", Some(number)) => {
                let end = (editing.at + number).min(editing.program.steps.len());
                for i in editing.at..end {
                    self.print_line(&numbered(i, &editing.program.steps[i].text));
                }
                editing.at = end;
            }
            ("D", Some(number)) => {
                let end = (editing.at + number).min(editing.program.steps.len());
                editing.program.steps.drain(editing.at..end);
            }
            ("C", _) if argument.is_some() => {
                // On to another program.
                let name = text[1..].to_owned();
                self.keep(editing);
                let opened = tokens(&name).and_then(|tokens| self.edit(&mut Cursor::new(&tokens)));
                if let Err(fault) = opened {
                    self.refuse(fault);
                    self.prompt();
                }
                return;
            }
            ("T", _) if argument.is_some() => {
                // Teaches the location and moves there.
                let name = text[1..].trim().to_owned();
                let taught = tokens(&name).and_then(|tokens| self.teach(&mut Cursor::new(&tokens)));
                let step = format!("MOVE {name}");
                if let Err(fault) = taught.and_then(|()| self.enter_step(&mut editing, &step)) {
                    self.refuse(fault);
                }
            }
            ("R", _) if argument.is_some() => {
                // Replaces the step.
                let step = Step::parse(&line.trim()[1..], self.profile.first_val);
                match (step, editing.program.steps.get_mut(editing.at)) {
                    (Ok(step), Some(old)) => *old = step,
                    (Ok(_), None) => self.refuse(Message::InvalidArgument.into()),
                    (Err(fault), _) => self.refuse(fault),
                }
            }
            ("I", Some(_)) if argument.is_none() => editing.inserting = true,
            ("", _) if editing.inserting => editing.inserting = false,
            ("", _) => editing.at = (editing.at + 1).min(editing.program.steps.len()),
            _ => {
                if let Err(fault) = self.enter_step(&mut editing, line) {
                    self.refuse(fault);
                }
            }
        }
        self.editor_prompt(editing);
    }

    fn enter_step(&mut self, editing: &mut Editing, line: &str) -> Result<(), Fault> {
        let step = Step::parse(line, self.profile.first_val)?;
        let steps = &mut editing.program.steps;
        if editing.inserting || editing.at >= steps.len() {
            if steps.len() >= self.profile.max_entries {
                return Err(Message::OutOfMemory.into());
            }
            steps.insert(editing.at, step);
        } else {
            steps[editing.at] = step;
        }
        editing.at += 1;
        Ok(())
    }
}
