//! Tables as text: CSV out and in, Markdown out.

use std::fmt::{Display, Write};
use std::str::FromStr;

use crate::error::Error;
use crate::index::{Action, State};
use crate::table::mask::ActionMask;
use crate::table::qtable::{QTable, Value};

const HEADER: &str = "state,action,value,visits,offered";

/// A text that is no table.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CsvError {
    /// The first line is not the header.
    #[error("line 1 is not the header `{HEADER}`")]
    Header,
    /// A line with more or fewer fields than five, or a field that is not what it should be.
    #[error("line {line}: {field} is not {expected}")]
    Field {
        /// The line, counted from 1.
        line: usize,
        /// Name of the field.
        field: &'static str,
        /// What it should be.
        expected: &'static str,
    },
    /// A line that is not for the pair that comes next: state by state, action by action, none left
    /// out.
    #[error("line {line} is not for the pair that comes next (state {}, action {})", state.0, action.0)]
    Order {
        /// The line, counted from 1.
        line: usize,
        /// The state that comes next.
        state: State,
        /// The action that comes next.
        action: Action,
    },
    /// Values or a mask that no table can hold.
    #[error(transparent)]
    Table(#[from] Error),
}

impl<V: Value + Display> QTable<V> {
    /// The table as CSV, one line for each pair after the header
    /// `state,action,value,visits,offered`; `offered` is 0 where the mask forbids the action.
    /// Values are written with as many digits as it takes to read back the same bits.
    pub fn to_csv(&self) -> String {
        let mut text = format!("{HEADER}\n");
        for state in (0..self.states()).map(State) {
            for action in (0..self.actions()).map(Action) {
                let (value, visits) = (self.value(state, action), self.visits(state, action));
                let offered = u8::from(self.allows(state, action));
                let (s, a) = (state.0, action.0);
                // Writing to a string does not fail.
                let _ = writeln!(text, "{s},{a},{value},{visits},{offered}");
            }
        }
        text
    }

    /// The table as Markdown: a row for each state, a column for each action, the best value of
    /// each row in bold, and a dash where the mask forbids the action. `digits` are those after the
    /// decimal point.
    pub fn to_markdown(&self, digits: usize) -> String {
        let mut text = String::from("| state |");
        for action in 0..self.actions() {
            let _ = write!(text, " {action} |");
        }
        text.push_str("\n|---:|");
        text.push_str(&"---:|".repeat(self.actions()));
        for state in (0..self.states()).map(State) {
            let _ = write!(text, "\n| {} |", state.0);
            for action in (0..self.actions()).map(Action) {
                let value = self.value(state, action);
                let _ = match (self.allows(state, action), self.best(state) == action) {
                    (false, _) => write!(text, " – |"),
                    (true, true) => write!(text, " **{value:.digits$}** |"),
                    (true, false) => write!(text, " {value:.digits$} |"),
                };
            }
        }
        text.push('\n');
        text
    }
}

impl<V: Value + FromStr> QTable<V> {
    /// The table of a CSV text as [`to_csv`](QTable::to_csv) writes it: all pairs, state by state.
    /// Blank lines at the end and Windows line ends are allowed. Memory stays in proportion to the
    /// text.
    ///
    /// # Errors
    /// [`CsvError`], which names the line.
    pub fn from_csv(text: &str) -> Result<Self, CsvError> {
        let mut lines = text.trim_end().lines().zip(1..);
        if lines.next().map(|(header, _)| header.trim()) != Some(HEADER) {
            return Err(CsvError::Header);
        }
        let pairs: Vec<Pair<V>> = lines
            .map(|(line, number)| parse_line(line, number))
            .collect::<Result<_, _>>()?;
        let actions = pairs
            .iter()
            .take_while(|pair| pair.state == State(0))
            .count();
        let states = pairs.len() / actions.max(1);
        let mut table = Self::filled(states, actions, V::from_f64(0.0))?;
        for (index, pair) in pairs.iter().enumerate() {
            let (state, action) = (State(index / actions), Action(index % actions));
            if (pair.state, pair.action) != (state, action) || state.0 >= states {
                return Err(CsvError::Order {
                    line: index + 2,
                    state,
                    action,
                });
            }
            table.set(state, action, pair.value)?;
            table.set_visits(state, action, pair.visits);
        }
        let mask = ActionMask::new(states, actions, |state, action| {
            pairs[state.0 * actions + action.0].offered
        })?;
        table.set_mask(mask.restricts().then_some(mask))?;
        Ok(table)
    }
}

struct Pair<V> {
    state: State,
    action: Action,
    value: V,
    visits: u32,
    offered: bool,
}

fn parse_line<V: FromStr>(text: &str, line: usize) -> Result<Pair<V>, CsvError> {
    let mut fields = text.split(',').map(str::trim);
    let pair = Pair {
        state: State(parse(fields.next(), line, "state", "a whole number")?),
        action: Action(parse(fields.next(), line, "action", "a whole number")?),
        value: parse(fields.next(), line, "value", "a number")?,
        visits: parse(fields.next(), line, "visits", "a whole number below 2^32")?,
        offered: parse_offered(fields.next(), line)?,
    };
    match fields.next() {
        None => Ok(pair),
        Some(_) => Err(CsvError::Field {
            line,
            field: "the line",
            expected: "five fields",
        }),
    }
}

fn parse_offered(text: Option<&str>, line: usize) -> Result<bool, CsvError> {
    match text {
        Some("0") => Ok(false),
        Some("1") => Ok(true),
        _ => Err(CsvError::Field {
            line,
            field: "offered",
            expected: "0 or 1",
        }),
    }
}

fn parse<T: FromStr>(
    text: Option<&str>,
    line: usize,
    field: &'static str,
    expected: &'static str,
) -> Result<T, CsvError> {
    text.and_then(|text| text.parse().ok())
        .ok_or(CsvError::Field {
            line,
            field,
            expected,
        })
}
