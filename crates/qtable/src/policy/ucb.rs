//! Optimism by upper confidence bounds.

use rand::Rng;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::elementary::ln;
use crate::error::{Error, check_setting};
use crate::index::{Action, State};
use crate::policy::rule::{Policy, Ties};
use crate::table::{QTable, Value};
use crate::validated::validated;

/// The action with the highest upper confidence bound `Q(s,a) + c sqrt(ln N(s) / N(s,a))` (Auer,
/// Cesa-Bianchi and Fischer 2002, state by state), where N counts the table's visits. Actions never
/// tried come first.
///
/// The visits are those that a learner counts in the table. Of equals the lowest index, unless
/// [`with_ties`](Ucb::with_ties) says otherwise; with [`Ties::Random`] the actions never tried come
/// in random order.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(Serialize, Deserialize),
    serde(remote = "Self")
)]
pub struct Ucb {
    width: f64,
    ties: Ties,
}

impl Ucb {
    /// With `c`, in units of the values: about the spread of the returns; `sqrt(2)` times it for
    /// the bound of the paper by Auer and others. At 0 it is greedy once everything was tried.
    ///
    /// # Errors
    /// [`Error::Setting`] if `c` is negative or not finite.
    pub fn new(c: f64) -> Result<Self, Error> {
        Self {
            width: c,
            ties: Ties::Lowest,
        }
        .restore()
    }

    /// Takes one of equally good actions by another rule.
    pub fn with_ties(self, ties: Ties) -> Self {
        Self { ties, ..self }
    }

    fn bound<V: Value>(
        &self,
        table: &QTable<V>,
        state: State,
        log_visits: f64,
        action: Action,
    ) -> f64 {
        match table.visits(state, action) {
            0 => f64::INFINITY,
            n => {
                table.value(state, action).to_f64()
                    + self.width * (log_visits / f64::from(n)).sqrt()
            }
        }
    }

    fn restore(self) -> Result<Self, Error> {
        check_setting(
            "c",
            self.width,
            self.width.is_finite() && self.width >= 0.0,
            "finite and not negative",
        )?;
        Ok(self)
    }
}

validated!(Ucb);

fn log_visits<V: Value>(table: &QTable<V>, state: State) -> f64 {
    let visits: u64 = table.visit_row(state).iter().map(|&n| u64::from(n)).sum();
    ln(visits.max(1) as f64)
}

impl<V: Value> Policy<V> for Ucb {
    fn choose(&mut self, table: &QTable<V>, state: State, rng: &mut dyn Rng) -> Action {
        let log_visits = log_visits(table, state);
        self.ties.pick(table, state, rng, |action| {
            self.bound(table, state, log_visits, action)
        })
    }

    fn probabilities(&self, table: &QTable<V>, state: State, probabilities: &mut [f64]) -> bool {
        let log_visits = log_visits(table, state);
        let bound = |action| self.bound(table, state, log_visits, action);
        let highest = table
            .offered(state)
            .map(bound)
            .fold(f64::NEG_INFINITY, f64::max);
        let mut winners: Vec<Action> = table
            .offered(state)
            .filter(|&action| bound(action) >= highest)
            .collect();
        if self.ties == Ties::Lowest {
            winners.truncate(1);
        }
        probabilities.fill(0.0);
        for action in &winners {
            probabilities[action.0] = 1.0 / winners.len() as f64;
        }
        true
    }
}
