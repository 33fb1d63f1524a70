//! Dialogues at the terminal: start-up, questions, changes of a location, answers to programs.

use crate::emulator::console::display;
use crate::emulator::console::mode::{Confirm, Kind, Mode};
use crate::emulator::console::terminal::Line;
use crate::emulator::controller::{Emulator, Event};
use crate::emulator::language::expr::Variable;
use crate::emulator::language::lexer::{Cursor, Token, tokens};
use crate::emulator::language::place::Place;
use crate::emulator::machine::job::Job;
use crate::emulator::machine::memory::Memory;
use crate::emulator::message::{Fault, Message};
use crate::joints::Joints;

impl Emulator {
    pub(crate) fn print(&mut self, text: &str) {
        self.terminal.print(text, self.now);
    }

    /// Prints a whole line, on a new one if need be.
    pub(crate) fn print_line(&mut self, text: &str) {
        self.terminal.fresh_line(&self.profile, self.now);
        self.print(text);
        self.print(self.profile.eol);
    }

    /// Prints a fault between asterisks.
    pub(crate) fn refuse(&mut self, fault: Fault) {
        let text = self.profile.text(fault.message);
        let line = match fault.joint {
            Some(joint) => format!("*{text}* Jt {}", joint.number()),
            None => format!("*{text}*"),
        };
        self.print_line(&line);
        self.note(Event::Refused(fault));
    }

    /// Returns to the monitor and prints its prompt.
    pub(crate) fn prompt(&mut self) {
        self.mode = Mode::Monitor;
        self.terminal.resume();
        self.terminal.fresh_line(&self.profile, self.now);
        let running = self.job.as_ref().is_some_and(Job::is_program);
        let prompt = if running {
            self.profile.run_prompt
        } else {
            self.profile.idle_prompt
        };
        self.print(prompt.encode_utf8(&mut [0; 4]));
    }

    pub(crate) fn boot(&mut self, question: usize) {
        match self.profile.boot.get(question) {
            Some(text) => {
                let text = text.clone();
                self.terminal.resume();
                self.mode = Mode::Boot(question);
                self.print(&text);
            }
            None => {
                if !self.profile.banner.is_empty() {
                    let banner = self.profile.banner.clone();
                    self.print_line(&banner);
                }
                self.prompt();
            }
        }
    }

    /// Returns `true` if a complete line would be worked on now.
    pub(crate) fn takes_lines(&self) -> bool {
        !matches!(self.mode, Mode::Busy)
    }

    /// Takes no lines until the motion of a `DO` has ended, unless a `PROMPT` waits for values.
    pub(crate) fn hold_terminal(&mut self) {
        if !matches!(self.mode, Mode::Answer(_)) {
            self.mode = Mode::Busy;
        }
    }

    /// Takes lines as monitor commands again.
    pub(crate) fn release_terminal(&mut self) {
        self.mode = Mode::Monitor;
    }

    /// Returns `true` if the next line is a monitor command.
    pub(crate) fn at_monitor(&self) -> bool {
        matches!(self.mode, Mode::Monitor)
    }

    /// Returns `true` if the next line belongs to a dialogue that no program has begun.
    pub(crate) fn in_dialogue(&self) -> bool {
        !matches!(self.mode, Mode::Monitor | Mode::Busy | Mode::Answer(_))
    }

    /// Looks at a line that has just been completed. While `DO` blocks, only the words that stop
    /// the arm are heard.
    pub(crate) fn line_complete(&mut self) {
        if self.takes_lines() || !self.profile.stop_while_busy {
            return;
        }
        let word = self
            .terminal
            .newest_line()
            .unwrap_or_default()
            .trim()
            .to_ascii_uppercase();
        if word == "PANIC" || word == "ABORT" {
            self.terminal.forget_lines();
            self.stop_job(Message::Aborted);
        }
    }

    /// Handles Ctrl-C.
    pub(crate) fn cancel(&mut self) {
        match self.mode {
            Mode::Busy => self.stop_job(Message::Aborted),
            Mode::Boot(question) => self.boot(question),
            _ => self.prompt(),
        }
    }

    /// Handles Ctrl-Z.
    pub(crate) fn end_of_input(&mut self) {
        match &self.mode {
            Mode::Editor(_) => self.leave_editor(),
            Mode::Change { .. } | Mode::Confirm(_) => self.prompt(),
            _ => {}
        }
    }

    /// Carries out a line in the present dialogue.
    pub(crate) fn line(&mut self, line: &Line) {
        self.sense();
        for _ in 0..self.profile.blank_lines.min(8) {
            self.print(self.profile.eol);
        }
        let mode = std::mem::replace(&mut self.mode, Mode::Monitor);
        if line.too_long {
            // The beginning without its end may mean something else.
            self.refuse(Message::LineTooLong.into());
            return self.ask_again(mode);
        }
        let line = line.text.as_str();
        match mode {
            Mode::Boot(question) => self.answer_boot(question, line),
            Mode::Monitor => self.command(line),
            Mode::Confirm(confirm) => self.answer_confirm(confirm, line),
            Mode::Change { key, place } => self.change(key, place, line),
            Mode::Editor(editing) => self.edit_line(editing, line),
            Mode::Answer(variables) => self.answer_prompt(variables, line),
            Mode::Busy => self.mode = Mode::Busy,
        }
    }

    /// Prints the question or prompt of a dialogue once more.
    fn ask_again(&mut self, mode: Mode) {
        match mode {
            Mode::Boot(question) => self.boot(question),
            Mode::Monitor => self.prompt(),
            Mode::Confirm(confirm) => self.ask(confirm),
            Mode::Change { key, place } => self.ask_change(key, place),
            Mode::Editor(editing) => self.editor_prompt(editing),
            Mode::Answer(_) => {
                self.mode = mode;
                self.terminal.resume();
                self.print("? ");
            }
            Mode::Busy => self.mode = Mode::Busy,
        }
    }

    fn ask_yes_or_no(&mut self, mode: Mode) {
        let text = self.profile.text(Message::AnswerYesOrNo).to_owned();
        self.print_line(&text);
        self.ask_again(mode);
    }

    fn answer_boot(&mut self, question: usize, line: &str) {
        let Some(yes) = yes_or_no(line) else {
            return self.ask_yes_or_no(Mode::Boot(question));
        };
        let asked = self.profile.boot.get(question);
        if yes && asked.is_some_and(|text| text.to_ascii_uppercase().contains("INIT")) {
            self.forget_everything();
            self.arm.monitor_speed = 100.0;
        }
        self.boot(question + 1);
    }

    pub(crate) fn ask(&mut self, confirm: Confirm) {
        let text = format!("{} (Y/N)? ", self.profile.text(Message::AreYouSure));
        self.terminal.resume();
        self.terminal.fresh_line(&self.profile, self.now);
        self.print(&text);
        self.mode = Mode::Confirm(confirm);
    }

    fn answer_confirm(&mut self, confirm: Confirm, line: &str) {
        match yes_or_no(line) {
            None => self.ask_yes_or_no(Mode::Confirm(confirm)),
            Some(false) => self.prompt(),
            Some(true) => self.confirmed(confirm),
        }
    }

    fn confirmed(&mut self, confirm: Confirm) {
        match confirm {
            Confirm::Calibrate => return self.calibrate(),
            Confirm::Done => return self.restart(),
            Confirm::Zero => self.forget_everything(),
            Confirm::Format => {
                for name in std::mem::take(&mut self.floppy).into_keys() {
                    self.note(Event::FileDeleted(name));
                }
            }
            Confirm::Delete(names) => {
                for (kind, name) in names {
                    match kind {
                        Kind::Program => drop(self.memory.programs.remove(&name)),
                        Kind::Place => drop(self.memory.places.remove(&name)),
                        Kind::Real => drop(self.memory.reals.remove(&name)),
                        Kind::File => {
                            self.floppy.remove(&name);
                            self.note(Event::FileDeleted(name));
                        }
                    }
                }
            }
        }
        self.prompt();
    }

    fn forget_everything(&mut self) {
        self.memory = Memory::default();
        self.paused = None;
        self.process = None;
        self.process_paused = None;
        self.reactions.clear();
    }

    /// Shows a location and asks for changes.
    pub(crate) fn ask_change(&mut self, key: String, place: Place) {
        let heading = display::place_heading(&self.profile);
        let values = display::place_values(&place, &self.profile);
        let question = self.profile.change_text.clone();
        self.terminal.resume();
        self.print_line(&heading);
        self.print_line(&values);
        self.print_line(&question);
        self.mode = Mode::Change { key, place };
    }

    /// Replaces elements of the location by those between commas. An empty line, or one that
    /// changes nothing, ends the dialogue.
    fn change(&mut self, key: String, place: Place, line: &str) {
        match changed(&place, line) {
            Ok(None) => self.prompt(),
            Ok(Some(new)) => match self.memory.set_place(key.clone(), new, &self.profile) {
                Ok(()) => self.ask_change(key, new),
                Err(fault) => {
                    self.refuse(fault);
                    self.prompt();
                }
            },
            Err(fault) => {
                self.refuse(fault);
                self.ask_change(key, place);
            }
        }
    }

    /// Stores the values typed to a program's `PROMPT`.
    fn answer_prompt(&mut self, variables: Vec<Variable>, line: &str) {
        match numbers(line) {
            Ok(values) => {
                let stored = variables.iter().enumerate().try_for_each(|(i, variable)| {
                    let key = variable.key(&self.scope())?;
                    let value = values.get(i).copied().flatten().unwrap_or_default();
                    self.memory.set_real(key, value, &self.profile)
                });
                self.mode = Mode::Monitor;
                match stored {
                    Ok(()) => self.answered(),
                    Err(fault) => self.fail_job(fault),
                }
            }
            Err(fault) => {
                self.refuse(fault);
                self.ask_again(Mode::Answer(variables));
            }
        }
    }

    /// Returns `true` if arm power comes on by itself for a calibration.
    pub(crate) fn powers_up_to_calibrate(&self) -> bool {
        self.profile.start_power.is_none() && !self.panel_used
    }

    /// Moves every joint a little to find the index pulses of the encoders.
    fn calibrate(&mut self) {
        if self.powers_up_to_calibrate() {
            self.switch_power(true);
        }
        if !self.arm.power {
            self.refuse(Message::ArmPowerOff.into());
            return self.prompt();
        }
        self.arm.start_calibration(self.now, &self.profile);
        self.note(Event::MotionStarted);
        self.start_calibration_job();
    }

    /// Takes over the true joint angles after a calibration.
    pub(crate) fn calibration_done(&mut self) {
        self.arm.calibrated = true;
        self.note(Event::Calibrated);
    }

    /// Puts the arm somewhere, as if it had been pushed there by hand, and ends its motion.
    pub fn place_arm(&mut self, joints: Joints) {
        self.arm.put(joints);
    }
}

/// Returns yes, no (also for an empty line), or neither.
fn yes_or_no(line: &str) -> Option<bool> {
    match line.trim().to_ascii_uppercase().as_str() {
        "Y" | "YES" => Some(true),
        "N" | "NO" | "" => Some(false),
        _ => None,
    }
}

/// Parses numbers between commas; `None` where one is left out.
fn numbers(line: &str) -> Result<Vec<Option<f64>>, Fault> {
    let tokens = tokens(line)?;
    let mut cursor = Cursor::new(&tokens);
    let mut found = Vec::new();
    loop {
        let negative = cursor.sign("-");
        let signed = negative || cursor.sign("+");
        let value = match cursor.peek() {
            Some(Token::Number(number)) => {
                cursor.next();
                Some(if negative { -number } else { *number })
            }
            _ if signed => return Err(Message::InvalidArgument.into()),
            _ => None,
        };
        found.push(value);
        if cursor.at_end() {
            return Ok(found);
        }
        cursor.expect_sign(",")?;
    }
}

fn changed(place: &Place, line: &str) -> Result<Option<Place>, Fault> {
    let typed = numbers(line)?;
    if typed.len() > 6 {
        return Err(Message::InvalidArgument.into());
    }
    if typed.iter().all(Option::is_none) {
        return Ok(None);
    }
    let mut values = place.val();
    for (value, typed) in values.iter_mut().zip(typed) {
        *value = typed.unwrap_or(*value);
    }
    Ok(Some(place.with_val(values)))
}
