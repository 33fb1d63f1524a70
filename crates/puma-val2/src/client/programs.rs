//! Programs on the controller: typed, listed, run.

use std::collections::HashSet;
use std::time::Duration;

use crate::client::dialogue::{Mode, last_line};
use crate::client::reader::{Ending, lines_said};
use crate::client::val2_client::Val2Client;
use crate::client::wire::{Failed, is_doubt};
use crate::error::ArmError;
use crate::transport::Transport;

/// Names of a program that is being typed, and of the one that it replaces.
const NEW: &str = "PGNEW";
const OLD: &str = "PGOLD";

/// Longest listing, bytes, and the longest time of one.
const LISTING: usize = 1 << 20;
const LISTING_TIME: Duration = Duration::from_secs(1800);

impl<T: Transport> Val2Client<T> {
    /// Types any line to the monitor and returns what the controller says, without the echo and the
    /// prompt. A question is the last line; it is left with no.
    ///
    /// # Errors
    /// [`ArmError::Setting`] for a line that is not printable; otherwise errors of the line. A
    /// message of the controller is no error here.
    pub fn send_line(&mut self, line: &str) -> Result<String, ArmError> {
        check_line("a line", line)?;
        self.last_known = None;
        let reply = self.wire.exchange(line, self.longest_motion())?;
        let mut lines = lines_said(&reply.text, line);
        if reply.ending == Ending::Question {
            lines.push(last_line(&reply.text).trim().to_owned());
            self.wire.settle()?;
        }
        Ok(lines.join("\n"))
    }

    /// Reads a listing until it is shown the same twice in a row.
    pub(super) fn listing(&mut self, line: &str) -> Result<Vec<String>, ArmError> {
        let limit = std::mem::replace(&mut self.wire.config.reply_limit, LISTING);
        let listed = self.same_twice(line);
        self.wire.config.reply_limit = limit;
        listed
    }

    fn same_twice(&mut self, line: &str) -> Result<Vec<String>, ArmError> {
        let mut before = None;
        for _ in 0..self.wire.config.retries.saturating_add(3) {
            match self.wire.exchange(line, LISTING_TIME) {
                Ok(reply) => {
                    self.without_message(line, &reply)?;
                    let lines = lines_said(&reply.text, line);
                    if before.as_ref() == Some(&lines) {
                        return Ok(lines);
                    }
                    before = Some(lines);
                }
                Err(failed) if is_doubt(&failed.error) => drop(self.wire.settle()?),
                Err(failed) => return Err(failed.error),
            }
        }
        let expected = "the same listing twice in a row";
        Err(self.wire.garbled(line, expected, "others"))
    }

    /// Returns the names of the programs on the controller.
    ///
    /// # Errors
    /// Errors of the line or the controller.
    pub fn programs(&mut self) -> Result<Vec<String>, ArmError> {
        let lines = self.listing("DIRECTORY")?;
        let names = lines.iter().flat_map(|line| line.split_whitespace());
        Ok(names.map(str::to_owned).collect())
    }

    /// Returns the steps of a program on the controller, with their labels.
    ///
    /// # Errors
    /// [`ArmError::Setting`] for a name that is not one line of printable characters;
    /// [`ArmError::Refused`] if there is no such program; otherwise errors of the line.
    pub fn program(&mut self, name: &str) -> Result<Vec<String>, ArmError> {
        Ok(self.listed(name)?.1)
    }

    /// Returns the head of a program, its name and its parameters in brackets, and its steps.
    pub(crate) fn listed(&mut self, name: &str) -> Result<(String, Vec<String>), ArmError> {
        check_line("the name of a program", name)?;
        let lines = self.listing(&format!("LISTP {name}"))?;
        let head = lines.iter().find_map(|line| line.strip_prefix(".PROGRAM "));
        let head = without_blanks(&head.unwrap_or(name).to_ascii_uppercase());
        // `.PROGRAM NAME` and `.END` are not steps.
        let steps = lines.iter().filter(|line| !line.starts_with('.'));
        let steps = steps.map(|line| without_number(line).to_owned());
        Ok((head, steps.collect()))
    }

    /// Stores a program. One of the same name is replaced, but only after the new one has been
    /// typed under another name (`PGNEW`), listed and compared. Parameters of the program follow
    /// its name in brackets.
    ///
    /// # Errors
    /// [`ArmError::Setting`], before anything is sent, for a name or a step that is not one line of
    /// printable characters; [`ArmError::Refused`] for a step that the controller does not take;
    /// [`ArmError::Garbled`] if the listing differs several times over; otherwise errors of the
    /// line. The program of before is kept.
    pub fn store_program(&mut self, name: &str, steps: &[String]) -> Result<(), ArmError> {
        check_line("the name of a program", name)?;
        for step in steps {
            check_line("a step of a program", step)?;
        }
        let bare = name_of(name);
        let head = name.replacen(bare, NEW, 1);
        if let Err(error) = self.type_program(&head, steps) {
            // A line that is gone cannot take the unfinished program away either.
            let _ = self.delete_scratch(&HashSet::new());
            return Err(error);
        }
        self.put_in_place(bare, NEW)
    }

    /// Renames the program `new` to `name`, replacing the old program of that name. At every moment
    /// the old program or the new one exists.
    pub(super) fn put_in_place(&mut self, name: &str, new: &str) -> Result<(), ArmError> {
        let known = self.programs()?;
        let is_there = |wanted: &str| known.iter().any(|name| name.eq_ignore_ascii_case(wanted));
        if is_there(name) && !is_there(new) {
            return Ok(());
        }
        let mut old = OLD.to_owned();
        for number in 1.. {
            if !is_there(&old) {
                break;
            }
            // It may be the only copy of what an interrupted call has replaced.
            let notice = format!("{old} is a program that an interrupted replacement has left");
            self.wire.notices.push(notice);
            old = format!("{OLD}{number}");
        }
        if !is_there(name) {
            return self.rename(name, new);
        }
        let replaced = self
            .rename(&old, name)
            .and_then(|()| self.rename(name, new));
        if replaced.is_err() {
            let names = self.wire.settle().and_then(|_| self.names_now());
            let _ = match names {
                Ok(names) if names.iter().any(|n| n.eq_ignore_ascii_case(name)) => {
                    self.delete('P', &old)
                }
                _ => self.rename(name, &old),
            };
            return replaced;
        }
        let mut deleted = self.delete('P', &old);
        if deleted.is_err() {
            deleted = self.wire.settle().and_then(|_| self.delete('P', &old));
        }
        deleted
    }

    /// Deletes the programs that were being typed when a call failed, but none of `spared`.
    pub(super) fn delete_scratch(&mut self, spared: &HashSet<&str>) -> Result<(), ArmError> {
        self.wire.settle()?;
        for name in self.names_now()? {
            let number = name.strip_prefix("PGN");
            let is_scratch = name == NEW || number.is_some_and(|n| n.parse::<u32>().is_ok());
            if is_scratch && !spared.contains(name.as_str()) {
                self.delete('P', &name)?;
            }
        }
        Ok(())
    }

    /// Returns the names of the programs as shown once: after a failure a listing could take half
    /// an hour.
    fn names_now(&mut self) -> Result<Vec<String>, ArmError> {
        let reply = self.say("DIRECTORY")?;
        self.without_message("DIRECTORY", &reply)?;
        let lines = lines_said(&reply.text, "DIRECTORY");
        let names = lines.iter().flat_map(|line| line.split_whitespace());
        Ok(names.map(str::to_owned).collect())
    }

    fn rename(&mut self, new: &str, old: &str) -> Result<(), ArmError> {
        let line = format!("RENAME {new}={old}");
        for tries in 0.. {
            let outcome = self.say(&line);
            let refused = match outcome {
                Ok(reply) => self.without_message(&line, &reply).err(),
                Err(error) if is_doubt(&error) => Some(error),
                Err(error) => return Err(error),
            };
            let Some(error) = refused else { break };
            // The line may have done its work before the doubt.
            self.wire.settle()?;
            let names = self.programs()?;
            let is_there = |wanted: &str| names.iter().any(|n| n.eq_ignore_ascii_case(wanted));
            if is_there(new) && !is_there(old) {
                break;
            }
            if tries >= self.wire.config.retries {
                return Err(error);
            }
        }
        Ok(())
    }

    /// Deletes a program (`P`), location (`L`) or real variable (`R`).
    pub(super) fn delete(&mut self, kind: char, name: &str) -> Result<(), ArmError> {
        let line = format!("DELETE{kind} {name}");
        let reply = self.say(&line)?;
        self.without_message(&line, &reply)?;
        if reply.ending == Ending::Question {
            self.say("Y")?;
        }
        Ok(())
    }

    /// Types a program into the controller's editor, replaces one of the same name, and compares
    /// the listing. The name may have parameters in brackets.
    pub(super) fn type_program(&mut self, head: &str, steps: &[String]) -> Result<(), ArmError> {
        let mut tries = 0;
        loop {
            let Err(error) = self.store_once(head, steps) else {
                return Ok(());
            };
            // Out of the editor in any case.
            let left = self.wire.settle();
            if tries >= self.wire.config.retries || !self.is_doubtful(&error) {
                return Err(error);
            }
            left?;
            tries += 1;
        }
    }

    fn store_once(&mut self, head: &str, steps: &[String]) -> Result<(), ArmError> {
        let name = name_of(head);
        // An old program of this name, if there is one; that there is none is no fault.
        if self.say(&format!("DELETEP {name}"))?.ending == Ending::Question {
            self.say("Y")?;
        }
        // Steps belong into the editor: at the monitor some of them would be carried out.
        let edit = format!("EDIT {head}");
        for line in std::iter::once(&edit).chain(steps) {
            let reply = self.say(line)?;
            self.without_message(line, &reply)?;
            if reply.ending != Ending::Question {
                return Err(self.wire.garbled(line, "the editor's prompt", &reply.text));
            }
        }
        self.say("E")?;
        let listed = self.say(&format!("LISTP {name}"))?.text;
        let listed = listed.to_ascii_uppercase();
        let has_head = without_blanks(&listed).contains(&without_blanks(head).to_uppercase());
        if has_head && holds(&listed, steps) {
            return Ok(());
        }
        Err(self
            .wire
            .garbled(name, "a listing of what was typed", &listed))
    }

    /// Runs a stored program to its end and returns its output. A program that asks for values is
    /// aborted: at once if its question ends with a question mark, otherwise after
    /// `config.motion_timeout`.
    ///
    /// # Errors
    /// [`ArmError::Setting`] for a name that is not one line of printable characters, and while a
    /// proximity guard is armed; [`ArmError::Silence`] after `config.motion_timeout`, the program
    /// aborted; otherwise errors of the line or the controller.
    pub fn execute(&mut self, program: &str) -> Result<String, ArmError> {
        check_line("the name of a program", program)?;
        self.refuse_under_guard("a program")?;
        self.last_known = None;
        let line = self.line_to_start(program, 1)?;
        self.wire.mode = Mode::Program;
        let limit = self.wire.config.motion_timeout;
        let outcome = self.run(&line, limit);
        self.wire.mode = Mode::Session;
        let Err(failed) = outcome else {
            return outcome.map_err(ArmError::from);
        };
        if failed.maybe_done && is_doubt(&failed.error) {
            self.end_program().map_err(|error| self.lost(error))?;
        }
        Err(failed.error)
    }

    /// Aborts the program that runs, if any.
    ///
    /// # Errors
    /// Errors of the line.
    pub fn abort(&mut self) -> Result<(), ArmError> {
        self.last_known = None;
        self.end_program()
    }

    pub(super) fn end_program(&mut self) -> Result<(), ArmError> {
        let patience = self.wire.config.motion_timeout;
        let mut tries = 0;
        loop {
            let error = match self.wire.exchange_to_end("ABORT", patience) {
                Ok(reply) if reply.ending == Ending::Idle => return Ok(()),
                Ok(reply) => {
                    let expected = "the idle monitor's prompt";
                    self.wire.garbled("ABORT", expected, &reply.text)
                }
                Err(failed) => failed.error,
            };
            // A program that asks for values is left here.
            self.wire.retry(error, &mut tries)?;
        }
    }

    /// Runs a program until it ends. A question of the program is an error.
    pub(super) fn run(&mut self, line: &str, limit: Duration) -> Result<String, Failed> {
        let reply = self.wire.exchange_to_end(line, limit)?;
        self.answered(line, reply, "a program that asks for nothing")
    }
}

/// Refuses text that would not arrive as one line.
pub(super) fn check_line(what: &'static str, text: &str) -> Result<(), ArmError> {
    if !text.trim().is_empty() && text.bytes().all(|b| matches!(b, 0x20..=0x7e)) {
        return Ok(());
    }
    Err(ArmError::Setting {
        what,
        value: format!("{text:?}"),
        allowed: "one line of printable ASCII characters",
    })
}

fn without_blanks(text: &str) -> String {
    text.split_whitespace().collect()
}

/// Returns the name in the head of a program.
pub(super) fn name_of(head: &str) -> &str {
    head.split('(').next().unwrap_or_default().trim()
}

/// Returns a line of a listing without the number of its step.
fn without_number(line: &str) -> &str {
    let line = line.trim();
    let rest = line.trim_start_matches(|c: char| c.is_ascii_digit());
    match rest.strip_prefix('.') {
        Some(step) if rest.len() < line.len() => step.trim(),
        _ => line,
    }
}

/// Returns `true` if a listing shows exactly these steps in their order.
fn holds(listing: &str, steps: &[String]) -> bool {
    let steps = steps.iter().map(|step| step.trim().to_ascii_uppercase());
    let steps: Vec<String> = steps.collect();
    let shown: Vec<&str> = listing
        .split(['\r', '\n'])
        .map(str::trim)
        // `.PROGRAM`, `.END` and prompts are not steps.
        .filter(|line| {
            !line.starts_with(['.', '*']) && steps.iter().any(|step| line.ends_with(step.as_str()))
        })
        .collect();
    shown.len() == steps.len()
        && shown
            .iter()
            .zip(&steps)
            .all(|(line, step)| line.ends_with(step.as_str()))
}
