//! Commands that show what is there.

use crate::emulator::console::display;
use crate::emulator::console::editor::numbered;
use crate::emulator::console::monitor::Command;
use crate::emulator::controller::Emulator;
use crate::emulator::language::lexer::Cursor;
use crate::emulator::language::place_expr::PlaceName;
use crate::emulator::machine::signals::BANKS;
use crate::emulator::message::{Fault, Message};
use crate::kinematics::xyzoat::Xyzoat;

impl Emulator {
    pub(crate) fn show_where(&mut self) {
        let joints = self.arm.shown();
        let hand = Xyzoat::from_pose(&self.arm.hand(&joints));
        for line in display::whereabouts(&joints, &hand, self.arm.gripper, &self.profile) {
            self.print_line(&line);
        }
    }

    pub(crate) fn list(&mut self, command: Command, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        let of_names = [
            Command::ListLocations,
            Command::ListReals,
            Command::ListPrograms,
        ];
        if !of_names.contains(&command) {
            cursor.expect_end()?;
        }
        let mut names = Vec::new();
        while !cursor.at_end() {
            if !names.is_empty() {
                cursor.expect_sign(",")?;
            }
            names.push(PlaceName::parse(cursor)?.key(&self.scope())?);
        }
        let lines = match command {
            Command::ListLocations => self.location_lines(&names)?,
            Command::ListReals => self.real_lines(&names)?,
            Command::ListPrograms => self.program_lines(&names)?,
            Command::Directory => self.memory.programs.keys().cloned().collect(),
            Command::FileDirectory => self.floppy.keys().cloned().collect(),
            Command::Switch => {
                let line = |(name, on): (&String, &bool)| {
                    format!("{name:<16}{}", if *on { "ON" } else { "OFF" })
                };
                self.switches.iter().map(line).collect()
            }
            Command::Io => self.signal_lines(),
            Command::Status => self.status_lines(),
            _ => return Err(Message::IllegalCommand.into()),
        };
        for line in lines {
            self.print_line(&line);
        }
        Ok(())
    }

    fn location_lines(&self, names: &[String]) -> Result<Vec<String>, Fault> {
        let mut lines = vec![format!(
            "{:16}{}",
            "",
            display::place_heading(&self.profile)
        )];
        let line = |name: &str, place| {
            format!("{name:<16}{}", display::place_values(place, &self.profile))
        };
        if names.is_empty() {
            lines.extend(
                self.memory
                    .places
                    .iter()
                    .map(|(name, place)| line(name, place)),
            );
        }
        for name in names {
            let place = self
                .memory
                .places
                .get(name)
                .ok_or(Message::UndefinedValue)?;
            lines.push(line(name, place));
        }
        Ok(lines)
    }

    fn real_lines(&self, names: &[String]) -> Result<Vec<String>, Fault> {
        let line = |name: &str, value: f64| format!("{name:<16}{}", display::plain(value));
        if names.is_empty() {
            return Ok(self.memory.reals.iter().map(|(n, v)| line(n, *v)).collect());
        }
        let known = |name: &String| self.memory.reals.get(name).map(|v| line(name, *v));
        names
            .iter()
            .map(|name| known(name).ok_or(Message::UndefinedValue.into()))
            .collect()
    }

    fn program_lines(&self, names: &[String]) -> Result<Vec<String>, Fault> {
        let all: Vec<String> = self.memory.programs.keys().cloned().collect();
        let names = if names.is_empty() { &all } else { names };
        let mut lines = Vec::new();
        for name in names {
            let program = self
                .memory
                .programs
                .get(name)
                .ok_or(Message::UndefinedProgram)?;
            lines.push(format!(".PROGRAM {name}"));
            lines.extend(
                program
                    .steps
                    .iter()
                    .enumerate()
                    .map(|(i, s)| numbered(i, &s.text)),
            );
            lines.push(".END".into());
        }
        Ok(lines)
    }

    fn signal_lines(&self) -> Vec<String> {
        let row = |bank: usize| {
            let states: Vec<_> = self
                .signals
                .bank(bank, 32)
                .map(|on| if on { "1" } else { "0" })
                .collect();
            let groups: Vec<_> = states.chunks(8).map(<[&str]>::concat).collect();
            format!(
                "{:>4}-{:<4} {}",
                BANKS[bank],
                BANKS[bank] + 31,
                groups.join(" ")
            )
        };
        (0..3).map(row).collect()
    }

    fn status_lines(&self) -> Vec<String> {
        let mut lines = vec![
            format!("MONITOR SPEED {}", display::plain(self.arm.monitor_speed)),
            format!(
                "PROGRAM SPEED {}",
                display::plain(self.arm.program_speed.shown())
            ),
        ];
        let job = self.job.as_ref().filter(|job| job.is_program());
        match job.and_then(|job| job.at().map(|at| (job, at))) {
            Some((job, (name, step))) => {
                lines.push(format!("PROGRAM {name}  STEP {step}"));
                lines.push(match job.cycles_left() {
                    Some(left) => format!("CYCLES LEFT {left}"),
                    None => "CYCLES LEFT FOREVER".into(),
                });
                if job.waits() {
                    lines.push("WAITING".into());
                }
            }
            None => lines.push("NO PROGRAM EXECUTING".into()),
        }
        lines
    }
}
