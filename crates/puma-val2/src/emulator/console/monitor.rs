//! Monitor commands.

use crate::emulator::console::mode::{Confirm, Kind};
use crate::emulator::controller::Emulator;
use crate::emulator::language::expr::{Expr, whole};
use crate::emulator::language::instruction::Instruction;
use crate::emulator::language::lexer::{Cursor, Token, keyword, tokens};
use crate::emulator::language::place::Place;
use crate::emulator::language::place_expr::{PlaceExpr, PlaceName, arguments, values};
use crate::emulator::language::scope::Scope;
use crate::emulator::machine::job::Job;
use crate::emulator::message::{Fault, Message};
use crate::emulator::profile::StartPower;
use crate::joints::Joints;
use crate::kinematics::xyzoat::Xyzoat;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Command {
    Abort,
    Base,
    Calibrate,
    Copy,
    Delete(Option<Kind>),
    Directory,
    Disable,
    Do,
    Edit,
    Enable,
    Execute,
    FileDelete,
    FileDirectory,
    Format,
    Here,
    Io,
    ListLocations,
    ListPrograms,
    ListReals,
    Load(Option<Kind>),
    Next,
    Panic,
    Point,
    Proceed,
    Rename,
    Reset,
    Retry,
    Signal,
    Speed,
    Status,
    Store(Option<Kind>),
    Switch,
    Tool,
    Where,
    Zero,
}

/// Commands; `true` for those that may be given while a program runs.
const COMMANDS: [(&str, (Command, bool)); 43] = [
    ("ABORT", (Command::Abort, true)),
    ("BASE", (Command::Base, false)),
    ("CALIBRATE", (Command::Calibrate, false)),
    ("COPY", (Command::Copy, true)),
    ("DELETE", (Command::Delete(None), false)),
    ("DELETEL", (Command::Delete(Some(Kind::Place)), false)),
    ("DELETEP", (Command::Delete(Some(Kind::Program)), false)),
    ("DELETER", (Command::Delete(Some(Kind::Real)), false)),
    ("DIRECTORY", (Command::Directory, true)),
    ("DISABLE", (Command::Disable, true)),
    ("DO", (Command::Do, false)),
    ("EDIT", (Command::Edit, false)),
    ("ENABLE", (Command::Enable, true)),
    ("EXECUTE", (Command::Execute, false)),
    ("FDELETE", (Command::FileDelete, true)),
    ("FDIRECTORY", (Command::FileDirectory, true)),
    ("FORMAT", (Command::Format, false)),
    ("HERE", (Command::Here, true)),
    ("IO", (Command::Io, true)),
    ("LISTL", (Command::ListLocations, true)),
    ("LISTP", (Command::ListPrograms, true)),
    ("LISTR", (Command::ListReals, true)),
    ("LOAD", (Command::Load(None), true)),
    ("LOADL", (Command::Load(Some(Kind::Place)), true)),
    ("LOADP", (Command::Load(Some(Kind::Program)), true)),
    ("LOADR", (Command::Load(Some(Kind::Real)), true)),
    ("NEXT", (Command::Next, false)),
    ("PANIC", (Command::Panic, true)),
    ("POINT", (Command::Point, false)),
    ("PROCEED", (Command::Proceed, false)),
    ("RENAME", (Command::Rename, false)),
    ("RESET", (Command::Reset, true)),
    ("RETRY", (Command::Retry, false)),
    ("SIGNAL", (Command::Signal, true)),
    ("SPEED", (Command::Speed, true)),
    ("STATUS", (Command::Status, true)),
    ("STORE", (Command::Store(None), true)),
    ("STOREL", (Command::Store(Some(Kind::Place)), true)),
    ("STOREP", (Command::Store(Some(Kind::Program)), true)),
    ("STORER", (Command::Store(Some(Kind::Real)), true)),
    ("SWITCH", (Command::Switch, true)),
    ("TOOL", (Command::Tool, true)),
    ("WHERE", (Command::Where, true)),
];

impl Emulator {
    /// Carries out a line typed at the monitor.
    pub(crate) fn command(&mut self, line: &str) {
        if let Err(fault) = self.try_command(line) {
            self.refuse(fault);
            self.prompt();
        }
    }

    fn try_command(&mut self, line: &str) -> Result<(), Fault> {
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
        // `ZERO` erases everything: no abbreviation of it is accepted.
        let (command, while_running) = if name == "ZERO" {
            (Command::Zero, false)
        } else {
            keyword(name, &COMMANDS, Message::IllegalCommand)?
        };
        let running = self.job.as_ref().is_some_and(Job::is_program);
        if running && !while_running {
            return Err(Message::Busy.into());
        }
        self.carry_out_command(command, &mut cursor)
    }

    fn carry_out_command(
        &mut self,
        command: Command,
        cursor: &mut Cursor<'_>,
    ) -> Result<(), Fault> {
        match command {
            Command::Where => {
                cursor.expect_end()?;
                self.show_where();
            }
            Command::Here => {
                let name = PlaceName::parse(cursor)?;
                cursor.expect_end()?;
                let (key, place) = (name.key(&self.scope())?, self.here(name.precision));
                self.memory.set_place(key.clone(), place, &self.profile)?;
                self.ask_change(key, place);
                return Ok(());
            }
            Command::Point => return self.point(cursor),
            Command::Do => {
                let instruction = Instruction::parse(cursor)?;
                return self.do_instruction(&instruction);
            }
            Command::Calibrate => {
                cursor.expect_end()?;
                if !self.arm.power
                    && (self.panel_used || self.profile.start_power != StartPower::OnAtCalibration)
                {
                    return Err(Message::ArmPowerOff.into());
                }
                self.ask(Confirm::Calibrate);
                return Ok(());
            }
            Command::Speed => {
                let percent = Expr::parse(cursor)?.value(&self.scope())?;
                cursor.expect_end()?;
                if percent <= 0.0 {
                    return Err(Message::InvalidArgument.into());
                }
                self.arm.monitor_speed = percent.clamp(0.01, self.profile.speed_max.max(0.01));
            }
            Command::Base => {
                let shift = arguments(cursor)?;
                cursor.expect_end()?;
                self.need_standing_arm()?;
                let shift = values(&shift, &self.scope())?;
                self.set_base(shift);
            }
            Command::Tool => {
                let tool = if cursor.at_end() {
                    None
                } else {
                    Some(PlaceExpr::parse(cursor)?)
                };
                cursor.expect_end()?;
                self.need_standing_arm()?;
                let scope = self.scope();
                let tool = tool.map(|t| t.transformation(&scope)).transpose()?;
                self.arm.frames.tool = tool.unwrap_or_default();
            }
            Command::Signal => {
                let scope = self.scope();
                let mut numbers = vec![Expr::parse(cursor)?.value(&scope)?];
                while cursor.sign(",") {
                    numbers.push(Expr::parse(cursor)?.value(&scope)?);
                }
                cursor.expect_end()?;
                for number in numbers {
                    self.command_signal(number)?;
                }
            }
            Command::Reset => {
                cursor.expect_end()?;
                self.signals.reset_outputs();
            }
            Command::Enable | Command::Disable => {
                self.set_switch(cursor, command == Command::Enable)?;
            }
            Command::Execute => return self.execute(cursor),
            Command::Abort | Command::Panic => {
                cursor.expect_end()?;
                return self.abort(command == Command::Panic);
            }
            Command::Proceed | Command::Retry | Command::Next => {
                cursor.expect_end()?;
                self.resume_program(command == Command::Retry, command == Command::Next)?;
            }
            Command::Zero => {
                cursor.expect_end()?;
                self.ask(Confirm::Zero);
                return Ok(());
            }
            Command::Format => {
                cursor.expect_end()?;
                self.ask(Confirm::Format);
                return Ok(());
            }
            Command::Delete(kind) => return self.delete(kind, cursor),
            Command::FileDelete => {
                let name = cursor.name()?;
                cursor.expect_end()?;
                if !self.floppy.contains_key(&name) {
                    return Err(Message::File.into());
                }
                self.ask(Confirm::Delete(vec![(Kind::File, name)]));
                return Ok(());
            }
            Command::Rename | Command::Copy => self.rename(cursor, command == Command::Copy)?,
            Command::Edit => return self.edit(cursor),
            Command::Store(kind) => self.store(kind, cursor)?,
            Command::Load(kind) => self.load(kind, cursor)?,
            Command::Directory
            | Command::FileDirectory
            | Command::Io
            | Command::ListLocations
            | Command::ListPrograms
            | Command::ListReals
            | Command::Status
            | Command::Switch => self.list(command, cursor)?,
        }
        self.prompt();
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
        let to = if cursor.sign("=") {
            Some(PlaceExpr::parse(cursor)?)
        } else {
            None
        };
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

    /// Carries out `EXECUTE [program][,cycles][,step]`. Negative cycles run for ever; no name means
    /// the program executed last.
    fn execute(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        let name = match cursor.peek() {
            Some(Token::Name(_)) => cursor.name()?,
            _ => self
                .executed_last
                .clone()
                .ok_or(Message::UndefinedProgram)?,
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
        self.need_standing_arm()?;
        let cycles = u32::try_from(cycles).ok();
        self.start_program(&name, cycles, step as usize - 1, false)?;
        self.executed_last = Some(name);
        self.prompt();
        Ok(())
    }

    /// Carries out `ABORT`, which slows the arm down, or `PANIC`, which stops it at once.
    fn abort(&mut self, at_once: bool) -> Result<(), Fault> {
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
        let mut found = Vec::new();
        loop {
            let name = PlaceName::parse(cursor)?;
            let key = name.key(&self.scope())?;
            let kinds = match kind {
                Some(kind) => vec![kind],
                None => vec![Kind::Program, Kind::Place, Kind::Real],
            };
            let there = kinds.into_iter().find(|kind| match kind {
                Kind::Program => self.memory.programs.contains_key(&key),
                Kind::Place => self.memory.places.contains_key(&key),
                Kind::Real => self.memory.reals.contains_key(&key),
                Kind::File => self.floppy.contains_key(&key),
            });
            found.push((there.ok_or(Message::UndefinedValue)?, key));
            if !cursor.sign(",") {
                break;
            }
        }
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
        let program = self
            .memory
            .programs
            .get(&old)
            .ok_or(Message::UndefinedProgram)?;
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
        let name = cursor.name()?;
        cursor.expect_end()?;
        self.profile.check_name(&name)?;
        if self.switches.len() >= 64 && !self.switches.contains_key(&name) {
            return Err(Message::OutOfMemory.into());
        }
        self.switches.insert(name, on);
        Ok(())
    }
}
