//! Everything in the controller's memory as text, and back.

use std::collections::HashSet;

use crate::client::dialogue::{last_line, shortened};
use crate::client::programs::{check_line, name_of};
use crate::client::reader::Ending;
use crate::client::val2_client::Val2Client;
use crate::client::wire::is_doubt;
use crate::error::ArmError;
use crate::kinematics::xyzoat::Xyzoat;
use crate::transport::Transport;

/// Contents of a controller, or of a backup of one: names and their values, in order.
#[derive(Debug, Default, PartialEq)]
struct Contents {
    programs: Vec<(String, Body)>,
    /// Locations; the name of a precision point begins with `#`.
    places: Vec<(String, [f64; 6])>,
    reals: Vec<(String, f64)>,
}

/// A program without its name.
#[derive(Debug, Default)]
struct Body {
    /// Parameters in brackets, or nothing.
    parameters: String,
    steps: Vec<String>,
    /// Numbers of the steps' lines in a text.
    lines: Vec<usize>,
}

impl PartialEq for Body {
    fn eq(&self, other: &Self) -> bool {
        let mut steps = self.steps.iter().zip(&other.steps);
        self.parameters == other.parameters
            && self.steps.len() == other.steps.len()
            && steps.all(|(a, b)| same_step(a, b))
    }
}

impl<T: Transport> Val2Client<T> {
    /// Returns all programs, locations and real variables as text, for [`Val2Client::restore`] and
    /// [`Emulator::load_text`](crate::Emulator::load_text). Each listing is read until it is shown
    /// the same twice; two backups of one state are equal.
    ///
    /// # Errors
    /// Errors of the line or the controller.
    pub fn backup(&mut self) -> Result<String, ArmError> {
        Ok(self.contents()?.text())
    }

    fn contents(&mut self) -> Result<Contents, ArmError> {
        let mut contents = Contents::default();
        for name in self.programs()? {
            let (head, steps) = self.listed(&name)?;
            let body = Body {
                parameters: head[name_of(&head).len()..].to_owned(),
                steps,
                lines: Vec::new(),
            };
            contents.programs.push((name, body));
        }
        for line in self.listing("LISTL")? {
            let mut words = line.split_whitespace();
            let name = words.next().unwrap_or_default().to_owned();
            let values: Option<Vec<f64>> = words.map(|word| word.parse().ok()).collect();
            // The heading holds no numbers.
            if let Some(values) = values.and_then(|values| values.try_into().ok()) {
                contents.places.push((name, values));
            }
        }
        for line in self.listing("LISTR")? {
            let value = line
                .split_once(' ')
                .and_then(|(name, value)| Some((name.to_owned(), value.trim().parse().ok()?)));
            contents.reals.extend(value);
        }
        Ok(contents)
    }

    /// Returns what [`Val2Client::restore`] would do, a line for each name: `keep`, `store` or
    /// `replace`, the kind and the name. Nothing is changed.
    ///
    /// # Errors
    /// [`ArmError::Text`] for a text that is no backup; otherwise errors of the line or the
    /// controller.
    pub fn restore_plan(&mut self, text: &str) -> Result<Vec<String>, ArmError> {
        let wanted = Contents::parse(text)?;
        Ok(plan(&wanted, &self.contents()?))
    }

    /// Stores the programs, locations and real variables of a backup, and compares everything with
    /// the controller's listings. What the controller holds with the same contents is left alone.
    ///
    /// All programs are typed under other names (`PGN0` and up, but none of the backup's) before
    /// the first one is put in place: a step that is refused leaves the controller as it was.
    ///
    /// # Errors
    /// [`ArmError::Text`] for a text that is no backup; [`ArmError::Conflict`] unless `replace`, if
    /// the controller holds other contents of the same name; both before anything is changed.
    /// [`ArmError::Step`] for a step that the controller does not take, by its line; otherwise
    /// errors of the line.
    pub fn restore(&mut self, text: &str, replace: bool) -> Result<Vec<String>, ArmError> {
        let wanted = Contents::parse(text)?;
        let plan = plan(&wanted, &self.contents()?);
        let replaced = plan.iter().filter_map(|line| line.strip_prefix("replace "));
        let names: Vec<&str> = replaced.collect();
        if !names.is_empty() && !replace {
            return Err(ArmError::Conflict {
                port: self.wire.port(),
                names: names.join(", "),
            });
        }
        let programs = wanted.programs.iter();
        let names: HashSet<&str> = programs.map(|(name, _)| name.as_str()).collect();
        self.delete_scratch(&names)?;
        if let Err(error) = self.store_all(&wanted, &plan, &names) {
            // A line that is gone cannot take the unfinished programs away either.
            let _ = self.delete_scratch(&names);
            return Err(error);
        }
        let missing = self.restore_plan(text)?;
        let missing = missing.iter().find(|line| !line.starts_with("keep "));
        match missing {
            None => Ok(plan),
            Some(name) => Err(self.wire.garbled("LISTP", "all of the backup", name)),
        }
    }

    fn store_all(
        &mut self,
        wanted: &Contents,
        plan: &[String],
        names: &HashSet<&str>,
    ) -> Result<(), ArmError> {
        let changes = |kind: &str, name: &str| !plan.contains(&format!("keep {kind} {name}"));
        let programs = wanted.programs.iter().filter(|p| changes("program", &p.0));
        let programs: Vec<_> = programs.collect();
        let free = (0..).map(|i| format!("PGN{i}"));
        let free = free.filter(|name| !names.contains(name.as_str()));
        let scratch: Vec<String> = free.take(programs.len()).collect();
        for ((_, body), scratch) in programs.iter().zip(&scratch) {
            let head = format!("{scratch}{}", body.parameters);
            let typed = self.type_program(&head, &body.steps);
            typed.map_err(|error| body.located(error))?;
        }
        for (name, values) in &wanted.places {
            if changes("location", name) {
                self.define_place(name, *values)?;
            }
        }
        for (name, value) in &wanted.reals {
            if changes("real", name) {
                self.command(&format!("DO {name} = {value}"))?;
            }
        }
        for ((name, _), scratch) in programs.iter().zip(&scratch) {
            // A line that fails once, by Ctrl-C for instance, leaves no half of the programs.
            let placed = self.put_in_place(name, scratch);
            placed.or_else(|_| self.put_in_place(name, scratch))?;
        }
        Ok(())
    }

    /// Deletes what has this name: a program, a location or a real variable.
    ///
    /// # Errors
    /// [`ArmError::Refused`] if nothing has this name; otherwise errors of the line.
    pub fn remove(&mut self, name: &str) -> Result<(), ArmError> {
        check_line("a name", name)?;
        let contents = self.contents()?;
        let same = |other: &String| other.eq_ignore_ascii_case(name);
        let kind = if contents.programs.iter().any(|p| same(&p.0)) {
            'P'
        } else if contents.reals.iter().any(|r| same(&r.0)) {
            'R'
        } else {
            'L'
        };
        self.delete(kind, name)
    }

    /// Defines a location as the arm's present position and returns the values that the controller
    /// shows: joint angles for a name that begins with `#`, otherwise X Y Z O A T.
    ///
    /// # Errors
    /// [`ArmError::Garbled`] if the values are not those of `WHERE`; otherwise errors of the line
    /// or the controller.
    pub fn here(&mut self, name: &str) -> Result<[f64; 6], ArmError> {
        check_line("the name of a location", name)?;
        let place = self.where_()?;
        let stands = if name.starts_with('#') {
            place.joints.degrees()
        } else {
            place.hand.val()
        };
        let line = format!("HERE {name}");
        let shown = self
            .ask_point(&line)?
            .map(|shown| shown.map(|(value, _)| value));
        let shown = shown.filter(|shown| near(name, shown, &stands));
        let Some(shown) = shown else {
            self.wire.settle()?;
            return Err(self
                .wire
                .garbled(&line, "the position that WHERE shows", "another"));
        };
        self.leave_point()?;
        Ok(shown)
    }

    /// Sets an output or a soft signal; a negative number switches it off.
    ///
    /// # Errors
    /// Errors of the line or the controller: there is no such signal, for instance.
    pub fn set_signal(&mut self, number: i32) -> Result<(), ArmError> {
        self.command(&format!("SIGNAL {number}")).map(drop)
    }

    /// Starts a program and does not wait for its end. `cycles` is the number of its runs, a
    /// negative one stands for runs without end.
    ///
    /// # Errors
    /// [`ArmError::Setting`] for a name that is not one line of printable characters;
    /// [`ArmError::Asked`] if the program asks for values; [`ArmError::Unconfirmed`], the arm
    /// stopped, if it is not known whether the program runs; otherwise errors of the line or the
    /// controller.
    pub fn start(&mut self, program: &str, cycles: i32) -> Result<(), ArmError> {
        check_line("the name of a program", program)?;
        self.refuse_under_guard("a program")?;
        self.last_known = None;
        let line = self.line_to_start(program, cycles)?;
        let reply = match self.wire.exchange(&line, self.wire.config.patience()) {
            Err(failed) if failed.maybe_done && is_doubt(&failed.error) => {
                match self.wire.spoil() {
                    Ok(reply) if reply.ending != Ending::Idle => reply,
                    _ => return Err(self.lost(failed.error)),
                }
            }
            Err(failed) if failed.maybe_done => return Err(self.lost(failed.error)),
            other => {
                let reply = other?;
                self.without_message(&line, &reply)?;
                reply
            }
        };
        if reply.ending == Ending::Question {
            let port = self.wire.port();
            let question = shortened(last_line(&reply.text));
            return Err(ArmError::Asked { port, question });
        }
        Ok(())
    }

    /// Returns the values of a location, read until they are shown the same twice.
    #[cfg(feature = "cli")]
    pub(crate) fn location(&mut self, name: &str) -> Result<[f64; 6], ArmError> {
        check_line("the name of a location", name)?;
        let line = format!("LISTL {name}");
        let listed = self.listing(&line)?;
        let found = listed.iter().find_map(|shown| {
            let (of, values) = shown.trim().split_once(' ')?;
            let values: Option<Vec<f64>> = values.split_whitespace().map(number).collect();
            let values = values?.try_into().ok()?;
            of.eq_ignore_ascii_case(name).then_some(values)
        });
        found.ok_or_else(|| self.wire.garbled(&line, "the location", &listed.join("\n")))
    }
}

/// Returns `true` for values of a location that differ by no more than a display does: of
/// millimetres in hundredths, of degrees in thousandths. Angles that turn the hand into one pose
/// are the same.
fn near(name: &str, a: &[f64; 6], b: &[f64; 6]) -> bool {
    let is_point = name.starts_with('#');
    let digit = |i: usize| if i < 3 && !is_point { 0.006 } else { 0.000_6 };
    let close = |i: usize| (a[i] - b[i]).abs() < digit(i);
    let [one, other] = [a, b].map(|values| Xyzoat::from_val(*values).pose().rotation);
    (0..6).all(close)
        || !is_point && (0..3).all(close) && one.angle_to(&other).to_degrees() < 0.000_9
}

/// Returns `true` for steps that differ only in the case of their words, not of texts or remarks.
fn same_step(a: &str, b: &str) -> bool {
    let (mut quoted, mut remark) = (false, false);
    let mut pairs = a.bytes().zip(b.bytes());
    a.len() == b.len()
        && pairs.all(|(a, b)| {
            quoted ^= a == b'"' && !remark;
            remark |= a == b';' && !quoted;
            a == b || !quoted && !remark && a.eq_ignore_ascii_case(&b)
        })
}

/// Returns a line for each name of `wanted`.
fn plan(wanted: &Contents, held: &Contents) -> Vec<String> {
    fn lines<'a, V>(
        kind: &'a str,
        wanted: &'a [(String, V)],
        held: &'a [(String, V)],
        equal: impl Fn(&str, &V, &V) -> bool + 'a,
    ) -> impl Iterator<Item = String> + 'a {
        wanted.iter().map(move |(name, value)| {
            let word = match held.iter().find(|(other, _)| other == name) {
                None => "store",
                Some((_, other)) if equal(name, value, other) => "keep",
                Some(_) => "replace",
            };
            format!("{word} {kind} {name}")
        })
    }
    let program = |_: &str, a: &Body, b: &Body| a == b;
    let real = |_: &str, a: &f64, b: &f64| (a - b).abs() <= 1e-6 * a.abs();
    lines("program", &wanted.programs, &held.programs, program)
        .chain(lines("location", &wanted.places, &held.places, near))
        .chain(lines("real", &wanted.reals, &held.reals, real))
        .collect()
}

impl Contents {
    fn text(&self) -> String {
        let mut text = String::new();
        for (name, body) in &self.programs {
            text.push_str(&format!(".PROGRAM {name}{}\n", body.parameters));
            for step in &body.steps {
                text.push_str(&format!(" {step}\n"));
            }
            text.push_str(".END\n");
        }
        let places = self.places.iter().map(|(name, values)| {
            let values = values.map(|v| v.to_string()).join(",");
            format!("{name} {values}\n")
        });
        let reals = self
            .reals
            .iter()
            .map(|(name, value)| format!("{name} {value}\n"));
        for (heading, lines) in [
            (".LOCATIONS", places.collect::<String>()),
            (".REALS", reals.collect()),
        ] {
            if !lines.is_empty() {
                text.push_str(&format!("{heading}\n{lines}.END\n"));
            }
        }
        text
    }

    fn parse(text: &str) -> Result<Self, ArmError> {
        let mut contents = Self::default();
        let mut section = String::new();
        let mut names = HashSet::new();
        // Files of DOS end with Ctrl-Z.
        for (index, line) in text.trim_end_matches('\x1a').lines().enumerate() {
            let line = line.trim();
            let upper = line.to_ascii_uppercase();
            let wrong = |problem| ArmError::Text {
                line: index + 1,
                text: line.chars().take(80).collect(),
                problem,
            };
            let mut once = |kind: &str, name: &str| {
                let new = names.insert(format!("{kind} {name}"));
                new.then_some(())
                    .ok_or_else(|| wrong("has a name that came before"))
            };
            if upper == ".END" && !section.is_empty() {
                section.clear();
            } else if section == ".PROGRAM" {
                let body = contents.programs.last_mut().map(|(_, body)| body);
                let Some(body) = body else { continue };
                // A listing counts the steps.
                let number = format!("{}.", body.steps.len() + 1);
                let line = line.strip_prefix(&number).map_or(line, str::trim_start);
                if !line.is_empty() {
                    check_line("a step of a program", line).map_err(|_| wrong("is no step"))?;
                    body.steps.push(line.to_owned());
                    body.lines.push(index + 1);
                }
            } else if section.is_empty() {
                let (head, name) = upper.split_once(' ').unwrap_or((&upper, ""));
                match (head, name.trim()) {
                    ("", _) => continue,
                    (".LOCATIONS" | ".REALS", "") => {}
                    (".PROGRAM", head) => {
                        let named = split_head(head);
                        let (name, parameters) = named.ok_or_else(|| wrong("names no program"))?;
                        once(".PROGRAM", &name)?;
                        let body = Body {
                            parameters,
                            ..Body::default()
                        };
                        contents.programs.push((name, body));
                    }
                    _ => return Err(wrong("begins no program, locations or reals")),
                }
                head.clone_into(&mut section);
            } else {
                let (name, values) = upper.split_once(' ').unwrap_or((&upper, ""));
                let values: Option<Vec<f64>> = values.split(',').map(number).collect();
                let values = values.unwrap_or_default();
                if section == ".REALS" && is_name(name) && values.len() == 1 {
                    once(".REALS", name)?;
                    contents.reals.push((name.to_owned(), values[0]));
                    continue;
                }
                let plain = name.strip_prefix('#').unwrap_or(name);
                match values.try_into() {
                    Ok(values) if section == ".LOCATIONS" && is_name(plain) => {
                        once(".LOCATIONS", name)?;
                        contents.places.push((name.to_owned(), values));
                    }
                    _ => return Err(wrong("is no name with its value or six values")),
                }
            }
        }
        if section.is_empty() {
            return Ok(contents);
        }
        Err(ArmError::Text {
            line: text.lines().count(),
            text: section,
            problem: "is not closed by .END",
        })
    }
}

impl Body {
    /// Returns the error of a step with the number of its line.
    fn located(&self, error: ArmError) -> ArmError {
        let ArmError::Refused {
            port,
            sent,
            message,
        } = &error
        else {
            return error;
        };
        let Some(at) = self.steps.iter().position(|step| step == sent) else {
            return error;
        };
        let mut words = sent.split_whitespace();
        let first = words.find(|word| word.parse::<u32>().is_err());
        let unknown = message.to_ascii_uppercase().contains("INSTRUCTION");
        ArmError::Step {
            port: port.clone(),
            line: self.lines.get(at).copied().unwrap_or_default(),
            step: sent.clone(),
            word: first.filter(|_| unknown).map(str::to_owned),
            message: message.clone(),
        }
    }
}

/// Splits the head of a program into its name and its parameters; empty brackets are left out.
fn split_head(head: &str) -> Option<(String, String)> {
    let (name, parameters) = head.split_at(head.find('(').unwrap_or(head.len()));
    let inner = parameters.strip_prefix('(');
    let names: Vec<&str> = match inner.map(|list| list.strip_suffix(')')) {
        None => Vec::new(),
        Some(list) => list?.split(',').map(str::trim).collect(),
    };
    let is_named = |name: &&str| is_name(name.strip_prefix('#').unwrap_or(name));
    let (name, parameters) = match names[..] {
        [] | [""] => (name.trim(), String::new()),
        _ if names.iter().all(is_named) => (name.trim(), format!("({})", names.join(","))),
        _ => return None,
    };
    is_name(name).then(|| (name.to_owned(), parameters))
}

/// Parses a finite number; words are refused.
fn number(text: &str) -> Option<f64> {
    let value: f64 = text.trim().parse().ok()?;
    value.is_finite().then_some(value)
}

/// Returns `true` for the name of a program, location or variable, possibly with indices.
fn is_name(name: &str) -> bool {
    let (plain, indices) = name.split_at(name.find('[').unwrap_or(name.len()));
    let letter = |c: char| c.is_ascii_alphanumeric() || "._".contains(c);
    let inner = indices.strip_prefix('[').and_then(|i| i.strip_suffix(']'));
    let sound = |all: &str| all.split(',').all(|index| index.parse::<u16>().is_ok());
    plain.starts_with(|c: char| c.is_ascii_alphabetic())
        && plain.chars().all(letter)
        && (indices.is_empty() || inner.is_some_and(sound))
}
