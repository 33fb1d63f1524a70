//! Tables as CSV.

use std::fmt::Write;

#[cfg(feature = "csv")]
use crate::error::{Error, check_length};
use crate::step::{Action, State};
use crate::table::qtable::QTable;

/// One line of the text.
#[cfg(feature = "csv")]
#[derive(serde::Deserialize)]
struct Line {
    state: usize,
    action: usize,
    value: f64,
    #[serde(default)]
    visits: f64,
    #[serde(default = "offered")]
    offered: u8,
}

#[cfg(feature = "csv")]
fn offered() -> u8 {
    1
}

impl QTable {
    /// Returns the table as CSV, one line for each pair, with the columns `state`, `action`,
    /// `value`, `visits` and `offered` (0 where the mask forbids the action). A value has as many
    /// digits as it takes to read the same bits back.
    ///
    /// ```
    /// use qtable::{Action, QTable, State};
    ///
    /// fn main() -> Result<(), qtable::Error> {
    ///     let mut table = QTable::new(1, 2)?;
    ///     table.set(State(0), Action(1), 0.25)?;
    ///     let text = "state,action,value,visits,offered\n0,0,0,0,1\n0,1,0.25,0,1\n";
    ///     assert_eq!(table.to_csv(), text);
    ///     Ok(())
    /// }
    /// ```
    pub fn to_csv(&self) -> String {
        let mut text = String::from("state,action,value,visits,offered\n");
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

    /// Reads a table from CSV with the columns of [`to_csv`](QTable::to_csv), in any order of
    /// columns and lines. Without `visits` all counts are 0, without `offered` all actions are
    /// offered. Every pair of a state and an action must be there once.
    ///
    /// # Errors
    /// [`Error::Csv`], which names the line, or values that no table can hold.
    #[cfg(feature = "csv")]
    pub fn from_csv(text: &str) -> Result<Self, Error> {
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .from_reader(text.as_bytes());
        let mut lines = Vec::new();
        for line in reader.deserialize() {
            let line: Line = line.map_err(|error| {
                let number = error.position().map_or(1, csv::Position::line);
                Error::Csv(number, error.to_string())
            })?;
            lines.push(line);
        }
        let beyond = |of: fn(&Line) -> usize| {
            let highest = lines.iter().map(of).max();
            highest.map_or(0, |highest| highest.saturating_add(1))
        };
        let (states, actions) = (beyond(|line| line.state), beyond(|line| line.action));
        check_length("the CSV text", states.saturating_mul(actions), lines.len())?;
        let mut table = Self::new(states, actions)?;
        let mut allowed = vec![None; lines.len()];
        for (line, number) in lines.iter().zip(2..) {
            let problem = |problem: &str| Error::Csv(number, problem.to_owned());
            let (state, action) = (State(line.state), Action(line.action));
            let entry = &mut allowed[line.state * actions + line.action];
            if entry.replace(line.offered == 1).is_some() {
                return Err(problem("this pair of state and action is there twice"));
            }
            if line.offered > 1 {
                return Err(problem("`offered` must be 0 or 1"));
            }
            let visits = line.visits as u32;
            if f64::from(visits).to_bits() != line.visits.to_bits() {
                return Err(problem("`visits` must be a whole number below 2^32"));
            }
            table.set(state, action, line.value)?;
            table.set_visits(state, action, visits);
        }
        table.restrict(|state, action| allowed[state.0 * actions + action.0] == Some(true));
        Ok(table)
    }
}
