//! Monitor commands.

use crate::emulator::console::mode::{Confirm, Kind};
use crate::emulator::controller::Emulator;
use crate::emulator::language::expr::{Expr, whole};
use crate::emulator::language::instruction::Instruction;
use crate::emulator::language::lexer::{Cursor, Token, keyword, tokens};
use crate::emulator::language::place::Place;
use crate::emulator::language::place_expr::{PlaceExpr, PlaceName, arguments, values};
use crate::emulator::language::scope::Scope;
use crate::emulator::language::val;
use crate::emulator::machine::job::Job;
use crate::emulator::message::{Fault, Message};
use crate::joints::Joints;
use crate::kinematics::xyzoat::Xyzoat;

/// Work of a command.
#[derive(Clone, Copy)]
enum Work {
    /// Returns lines to print; the command takes no arguments.
    Show(fn(&Emulator) -> Vec<String>),
    /// Prints the lines about the names typed, or about all.
    List(fn(&Emulator, &[String]) -> Result<Vec<String>, Fault>),
    /// Reads its arguments, of which none may be left, and does something. The prompt follows.
    Does(fn(&mut Emulator, &mut Cursor<'_>) -> Result<(), Fault>),
    /// Does something that brings its own prompt or question.
    Asks(fn(&mut Emulator, &mut Cursor<'_>) -> Result<(), Fault>),
}

use Work::{Asks, Does, List, Show};

/// Commands; `true` for those that may be given while a program runs.
const COMMANDS: [(&str, (bool, Work)); 57] = [
    ("ABORT", (true, Asks(|e, c| e.abort(c, false)))),
    ("BASE", (false, Does(Emulator::base))),
    ("CALIBRATE", (false, Asks(Emulator::ask_calibration))),
    ("COMPRESS", (false, Does(|_, c| c.expect_end()))),
    ("DONE", (false, Asks(|e, c| e.ask_sure(c, Confirm::Done)))),
    ("FCOPY", (true, Does(Emulator::copy_file))),
    ("FLIST", (true, Asks(Emulator::list_file))),
    ("FREE", (true, Show(Emulator::free_lines))),
    ("PARAMETER", (true, Asks(Emulator::parameter))),
    ("PRIME", (false, Does(Emulator::prime))),
    ("TEACH", (false, Does(Emulator::teach))),
    ("COPY", (true, Does(|e, c| e.rename(c, true)))),
    ("DELETE", (false, Asks(|e, c| e.delete(None, c)))),
    (
        "DELETEL",
        (false, Asks(|e, c| e.delete(Some(Kind::Place), c))),
    ),
    (
        "DELETEP",
        (false, Asks(|e, c| e.delete(Some(Kind::Program), c))),
    ),
    (
        "DELETER",
        (false, Asks(|e, c| e.delete(Some(Kind::Real), c))),
    ),
    (
        "DIRECTORY",
        (true, Show(|e| e.memory.programs.keys().cloned().collect())),
    ),
    ("DISABLE", (true, Does(|e, c| e.set_switch(c, false)))),
    (
        "DO",
        (
            false,
            Asks(|e, c| e.do_instruction(&Instruction::parse(c)?)),
        ),
    ),
    ("EDIT", (false, Asks(Emulator::edit))),
    ("ENABLE", (true, Does(|e, c| e.set_switch(c, true)))),
    ("EXECUTE", (false, Does(Emulator::execute))),
    ("FDELETE", (true, Asks(Emulator::delete_file))),
    (
        "FDIRECTORY",
        (true, Show(|e| e.floppy.keys().cloned().collect())),
    ),
    (
        "FORMAT",
        (false, Asks(|e, c| e.ask_sure(c, Confirm::Format))),
    ),
    ("HERE", (true, Asks(Emulator::here_dialogue))),
    ("ID", (true, Show(|e| vec![e.profile.banner.clone()]))),
    ("IO", (true, Show(Emulator::signal_lines))),
    ("LISTL", (true, List(Emulator::location_lines))),
    ("LISTP", (true, List(Emulator::program_lines))),
    ("LISTR", (true, List(Emulator::real_lines))),
    ("LOAD", (true, Does(|e, c| e.load(None, c)))),
    ("LOADL", (true, Does(|e, c| e.load(Some(Kind::Place), c)))),
    ("LOADP", (true, Does(|e, c| e.load(Some(Kind::Program), c)))),
    ("LOADR", (true, Does(|e, c| e.load(Some(Kind::Real), c)))),
    (
        "NEXT",
        (false, Does(|e, c| e.resume_program(c, false, true))),
    ),
    ("PANIC", (true, Asks(|e, c| e.abort(c, true)))),
    ("PCABORT", (true, Does(Emulator::abort_process))),
    ("PCEND", (true, Does(Emulator::end_process_cycle))),
    ("PCEXECUTE", (true, Does(Emulator::execute_process))),
    ("PCPROCEED", (true, Does(Emulator::proceed_process))),
    ("PCSTATUS", (true, Show(Emulator::process_lines))),
    ("POINT", (false, Asks(Emulator::point))),
    (
        "PROCEED",
        (false, Does(|e, c| e.resume_program(c, false, false))),
    ),
    ("RENAME", (false, Does(|e, c| e.rename(c, false)))),
    ("RESET", (true, Does(Emulator::reset))),
    (
        "RETRY",
        (false, Does(|e, c| e.resume_program(c, true, false))),
    ),
    ("SIGNAL", (true, Does(Emulator::set_signals))),
    ("SPEED", (true, Does(Emulator::set_speed))),
    ("STATUS", (true, Show(Emulator::status_lines))),
    ("STORE", (true, Does(|e, c| e.store(None, c)))),
    ("STOREL", (true, Does(|e, c| e.store(Some(Kind::Place), c)))),
    (
        "STOREP",
        (true, Does(|e, c| e.store(Some(Kind::Program), c))),
    ),
    ("STORER", (true, Does(|e, c| e.store(Some(Kind::Real), c)))),
    ("SWITCH", (true, Show(Emulator::switch_lines))),
    ("TOOL", (true, Does(Emulator::tool))),
    ("WHERE", (true, Show(Emulator::where_lines))),
];

/// Switches that `ENABLE` and `DISABLE` know.
const SWITCHES: [&str; 10] = [
    "CP",
    "DRY.RUN",
    "FORCE",
    "INT.EVAL",
    "INTERACTIVE",
    "MESSAGES",
    "SCALE.AMPS",
    "SET.SPEED",
    "TRACE",
    "UPPER",
];

/// Erases everything; no abbreviation of it is accepted.
const ZERO: (bool, Work) = (false, Asks(|e, c| e.ask_sure(c, Confirm::Zero)));

impl Emulator {
    /// Carries out a line typed at the monitor.
    pub(crate) fn command(&mut self, line: &str) {
        if let Err(fault) = self.try_command(line) {
            self.refuse(fault);
            self.prompt();
        }
    }

    fn try_command(&mut self, line: &str) -> Result<(), Fault> {
        let translated = self.profile.first_val.then(|| val::translated(line));
        let line = translated.as_deref().unwrap_or(line);
        let tokens = tokens(line).map_err(|fault| match line.trim_start().chars().next() {
            Some(c) if c.is_ascii_alphabetic() => fault,
            _ => Message::IllegalCommand.into(),
        })?;
        let mut cursor = Cursor::new(&tokens);
        let Some(first) = cursor.next() else {
            self.prompt();
            return Ok(());
        };
        let Token::Name(name) = first else {
            return Err(Message::IllegalCommand.into());
        };
        let (while_running, work) = if name == "ZERO" {
            ZERO
        } else {
            *keyword(name, &COMMANDS, Message::IllegalCommand)?
        };
        let running = self.job.as_ref().is_some_and(Job::is_program);
        if running && !while_running {
            return Err(Message::Busy.into());
        }
        let cursor = &mut cursor;
        let lines = match work {
            Asks(asks) => return asks(self, cursor),
            Does(does) => does(self, cursor).map(|()| Vec::new())?,
            Show(show) => {
                cursor.expect_end()?;
                show(self)
            }
            List(list) => {
                let name = |c: &mut Cursor<'_>| PlaceName::parse(c)?.key(&self.scope());
                let names = cursor.rest(|c| c.list(name))?.unwrap_or_default();
                cursor.expect_end()?;
                list(self, &names)?
            }
        };
        for line in lines {
            self.print_line(&line);
        }
        self.prompt();
        Ok(())
    }

    fn ask_sure(&mut self, cursor: &Cursor<'_>, confirm: Confirm) -> Result<(), Fault> {
        cursor.expect_end()?;
        self.ask(confirm);
        Ok(())
    }

    fn ask_calibration(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        cursor.expect_end()?;
        if !self.arm.power && !self.powers_up_to_calibrate() {
            return Err(Message::ArmPowerOff.into());
        }
        self.ask(Confirm::Calibrate);
        Ok(())
    }

    /// Carries out `HERE name`, which shows the location and asks for changes.
    fn here_dialogue(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        let names = PlaceName::parse_compound(cursor)?;
        cursor.expect_end()?;
        let (key, place) = self.taught(&names)?;
        self.memory.set_place(key.clone(), place, &self.profile)?;
        self.ask_change(key, place);
        Ok(())
    }

    /// Carries out `TEACH name`: the location is where the arm stands, without a dialogue.
    pub(crate) fn teach(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        let names = PlaceName::parse_compound(cursor)?;
        cursor.expect_end()?;
        let (key, place) = self.taught(&names)?;
        self.memory.set_place(key, place, &self.profile)
    }

    /// Carries out `PARAMETER [name[=value]]`, which shows or sets.
    fn parameter(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        let name = cursor.rest(Cursor::name)?;
        if let Some(name) = &name
            && let Some(value) = cursor.after_sign("=", Expr::parse)?
        {
            let value = value.value(&self.scope())?;
            self.memory
                .set_parameter(name.clone(), value, &self.profile)?;
        }
        cursor.expect_end()?;
        let shown = self.parameter_lines(name.as_slice())?;
        for line in shown {
            self.print_line(&line);
        }
        self.prompt();
        Ok(())
    }

    /// Carries out `PRIME`: `PROCEED` starts the program.
    fn prime(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        self.execute(cursor)?;
        self.paused = self.job.take();
        Ok(())
    }

    fn list_file(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        let name = cursor.name()?;
        cursor.expect_end()?;
        let text = self.floppy.get(&name).ok_or(Message::File)?.clone();
        for line in text.lines() {
            self.print_line(line);
        }
        self.prompt();
        Ok(())
    }

    /// Carries out `FCOPY new = old`.
    fn copy_file(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        let new = cursor.name()?;
        cursor.expect_sign("=")?;
        let old = cursor.name()?;
        cursor.expect_end()?;
        let text = self.floppy.get(&old).ok_or(Message::File)?.clone();
        self.profile.check_name(&new)?;
        self.store_file(new, text)
    }

    fn set_speed(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        let percent = Expr::parse(cursor)?.value(&self.scope())?;
        cursor.expect_end()?;
        if percent <= 0.0 {
            return Err(Message::InvalidArgument.into());
        }
        self.arm.monitor_speed = percent.clamp(0.01, self.profile.speed_max.max(0.01));
        Ok(())
    }

    fn base(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        let shift = arguments(cursor)?;
        cursor.expect_end()?;
        self.need_standing_arm()?;
        let shift = values(&shift, &self.scope())?;
        self.set_base(shift);
        Ok(())
    }

    fn tool(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        let tool = cursor.rest(PlaceExpr::parse)?;
        cursor.expect_end()?;
        self.need_standing_arm()?;
        let scope = self.scope();
        let tool = tool.map(|t| t.transformation(&scope)).transpose()?;
        self.arm.frames.tool = tool.unwrap_or_default();
        Ok(())
    }

    fn set_signals(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        let numbers = Expr::parse_list(cursor)?;
        cursor.expect_end()?;
        self.command_signals(&numbers)
    }

    fn reset(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        cursor.expect_end()?;
        self.signals.reset_outputs();
        Ok(())
    }

    fn delete_file(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        let name = cursor.name()?;
        cursor.expect_end()?;
        if !self.floppy.contains_key(&name) {
            return Err(Message::File.into());
        }
        self.ask(Confirm::Delete(vec![(Kind::File, name)]));
        Ok(())
    }

    fn need_standing_arm(&self) -> Result<(), Fault> {
        if self.arm.moving() {
            return Err(Message::Busy.into());
        }
        Ok(())
    }

    /// Carries out `POINT name [= expression]`. A new location starts as zero.
    fn point(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        let name = PlaceName::parse(cursor)?;
        let to = cursor.after_sign("=", PlaceExpr::parse)?;
        cursor.expect_end()?;
        let scope = self.scope();
        let key = name.key(&scope)?;
        let place = match to {
            Some(to) => to.place(&scope)?,
            None => scope.place(&key).unwrap_or(if name.precision {
                Place::PrecisionPoint(Joints::default())
            } else {
                Place::Transformation(Xyzoat::default().pose())
            }),
        };
        if name.precision != matches!(place, Place::PrecisionPoint(_)) {
            return Err(Message::InvalidArgument.into());
        }
        self.memory.set_place(key.clone(), place, &self.profile)?;
        self.ask_change(key, place);
        Ok(())
    }

    /// Parses `[program][,cycles][,step]`: the name, the cycles or `None` for ever, and the index
    /// of the step. Negative cycles run for ever; no name means `last`.
    pub(crate) fn what_to_execute(
        &self,
        cursor: &mut Cursor<'_>,
        last: Option<&String>,
    ) -> Result<(String, Option<u32>, usize), Fault> {
        let name = match cursor.peek() {
            Some(Token::Name(_)) => cursor.name()?,
            _ => last.cloned().ok_or(Message::UndefinedProgram)?,
        };
        let mut numbers = [1, 1];
        for number in &mut numbers {
            if !cursor.sign(",") {
                break;
            }
            if let Some(value) = Expr::parse_optional(cursor)? {
                *number = whole(value.value(&self.scope())?, -32768, 32767)?;
            }
        }
        cursor.expect_end()?;
        let [cycles, step] = numbers;
        if step < 1 || cycles == 0 {
            return Err(Message::InvalidArgument.into());
        }
        Ok((name, u32::try_from(cycles).ok(), step as usize - 1))
    }

    /// Carries out `EXECUTE [program][,cycles][,step]`.
    fn execute(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        let (name, cycles, step) = self.what_to_execute(cursor, self.executed_last.as_ref())?;
        self.need_standing_arm()?;
        self.start_program(&name, cycles, step, false)?;
        self.executed_last = Some(name);
        Ok(())
    }

    /// Carries out `ABORT`, which slows the arm down, or `PANIC`, which stops it at once.
    fn abort(&mut self, cursor: &Cursor<'_>, at_once: bool) -> Result<(), Fault> {
        cursor.expect_end()?;
        if at_once && self.arm.moving() {
            self.arm.break_off(self.now, self.profile.stop_time / 4);
        }
        if self.job.is_some() {
            // The prompt comes with the end of the program.
            self.stop_job(Message::Aborted);
            return Ok(());
        }
        if self.arm.moving() {
            self.arm.break_off(self.now, self.profile.stop_time);
        } else if !at_once {
            return Err(Message::NotRunning.into());
        }
        self.prompt();
        Ok(())
    }

    /// Carries out `DELETE` and its letter forms, which take one kind.
    fn delete(&mut self, kind: Option<Kind>, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        let found = cursor.list(|c| {
            let key = PlaceName::parse(c)?.key(&self.scope())?;
            let there = self.memory.kind_of(&key, kind);
            Ok((there.ok_or(Message::UndefinedValue)?, key))
        })?;
        cursor.expect_end()?;
        self.ask(Confirm::Delete(found));
        Ok(())
    }

    /// Carries out `RENAME new = old` and `COPY new = old`. A comma serves for the equals sign.
    fn rename(&mut self, cursor: &mut Cursor<'_>, keep: bool) -> Result<(), Fault> {
        let new = cursor.name()?;
        if !cursor.sign("=") {
            cursor.expect_sign(",")?;
        }
        let old = cursor.name()?;
        cursor.expect_end()?;
        self.profile.check_name(&new)?;
        let program = self.memory.program(&old)?;
        if self.memory.programs.contains_key(&new) {
            return Err(Message::InvalidArgument.into());
        }
        let program = (**program).clone();
        self.memory.set_program(new, program, &self.profile)?;
        if !keep {
            self.memory.programs.remove(&old);
        }
        Ok(())
    }

    fn set_switch(&mut self, cursor: &mut Cursor<'_>, on: bool) -> Result<(), Fault> {
        let names = cursor.list(Cursor::name)?;
        cursor.expect_end()?;
        self.set_switches(&names, on)
    }

    /// Sets switches, or none of them if one is unknown.
    pub(crate) fn set_switches(&mut self, names: &[String], on: bool) -> Result<(), Fault> {
        if !names.iter().all(|name| SWITCHES.contains(&name.as_str())) {
            return Err(Message::UnknownSwitch.into());
        }
        self.switches
            .extend(names.iter().map(|name| (name.clone(), on)));
        Ok(())
    }
}
