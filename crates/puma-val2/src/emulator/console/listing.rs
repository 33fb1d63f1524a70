//! Commands that show what is there.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::emulator::console::display;
use crate::emulator::console::editor::numbered;
use crate::emulator::controller::Emulator;
use crate::emulator::language::place::Place;
use crate::emulator::language::program::Program;
use crate::emulator::machine::job::Job;
use crate::emulator::machine::signals::BANKS;
use crate::emulator::message::{Fault, Message};
use crate::kinematics::xyzoat::Xyzoat;

impl Emulator {
    pub(crate) fn where_lines(&self) -> Vec<String> {
        let joints = self.arm.shown();
        let hand = Xyzoat::from_pose(&self.arm.hand(&joints));
        display::whereabouts(&joints, &hand, self.arm.gripper, &self.profile)
    }

    pub(crate) fn switch_lines(&self) -> Vec<String> {
        let line =
            |(name, on): (&String, &bool)| format!("{name:<16}{}", if *on { "ON" } else { "OFF" });
        self.switches.iter().map(line).collect()
    }

    pub(crate) fn location_lines(&self, names: &[String]) -> Result<Vec<String>, Fault> {
        let heading = format!("{:16}{}", "", display::place_heading(&self.profile));
        let line = |name: &String, place: &Place| {
            format!("{name:<16}{}", display::place_values(place, &self.profile))
        };
        let rows = named(&self.memory.places, names, Message::UndefinedValue, line)?;
        Ok(std::iter::once(heading).chain(rows).collect())
    }

    pub(crate) fn real_lines(&self, names: &[String]) -> Result<Vec<String>, Fault> {
        let line = |name: &String, value: &f64| format!("{name:<15} {}", display::exact(*value));
        named(&self.memory.reals, names, Message::UndefinedValue, line)
    }

    pub(crate) fn parameter_lines(&self, names: &[String]) -> Result<Vec<String>, Fault> {
        let line = |name: &String, value: &f64| format!("{name:<16}{}", display::plain(*value));
        named(
            &self.memory.parameters,
            names,
            Message::UndefinedValue,
            line,
        )
    }

    /// Returns the share of the memory for names that is free.
    pub(crate) fn free_lines(&self) -> Vec<String> {
        let memory = &self.memory;
        let used = memory.programs.len() + memory.places.len() + memory.reals.len();
        let all = 3 * self.profile.max_entries.max(1);
        vec![format!(
            "{:.1}% FREE",
            100.0 - 100.0 * used as f64 / all as f64
        )]
    }

    pub(crate) fn program_lines(&self, names: &[String]) -> Result<Vec<String>, Fault> {
        let lines = |name: &String, program: &Arc<Program>| {
            let steps = program.steps.iter().enumerate();
            let mut lines = vec![program.head(name)];
            lines.extend(steps.map(|(i, step)| numbered(i, &step.text)));
            lines.push(".END".into());
            lines
        };
        let programs = &self.memory.programs;
        let all = named(programs, names, Message::UndefinedProgram, lines)?;
        Ok(all.concat())
    }

    pub(crate) fn signal_lines(&self) -> Vec<String> {
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

    pub(crate) fn status_lines(&self) -> Vec<String> {
        let mut lines = vec![
            format!("MONITOR SPEED {}", display::plain(self.arm.monitor_speed)),
            format!(
                "PROGRAM SPEED {}",
                display::plain(self.arm.program_speed.shown())
            ),
        ];
        let job = self.job.as_ref().filter(|job| job.is_program());
        lines.extend(job_lines(job, "PROGRAM"));
        lines
    }

    pub(crate) fn process_lines(&self) -> Vec<String> {
        job_lines(self.process.as_ref(), "PROCESS PROGRAM")
    }
}

/// Returns what a running program does.
fn job_lines(job: Option<&Job>, what: &str) -> Vec<String> {
    let Some((job, (name, step))) = job.and_then(|job| Some((job, job.at()?))) else {
        return vec![format!("NO {what} EXECUTING")];
    };
    let left = job.cycles_left.map(|left| left.to_string());
    let mut lines = vec![
        format!("{what} {name}  STEP {step}"),
        format!("CYCLES LEFT {}", left.unwrap_or("FOREVER".into())),
    ];
    if job.waits() {
        lines.push("WAITING".into());
    }
    lines
}

/// Returns a line about each of the names, or about everything.
fn named<T, L>(
    map: &BTreeMap<String, T>,
    names: &[String],
    missing: Message,
    line: impl Fn(&String, &T) -> L,
) -> Result<Vec<L>, Fault> {
    if names.is_empty() {
        return Ok(map.iter().map(|(name, value)| line(name, value)).collect());
    }
    let known = |name: &String| map.get(name).map(|value| line(name, value));
    let lines = names.iter().map(|name| known(name).ok_or(missing.into()));
    lines.collect()
}
