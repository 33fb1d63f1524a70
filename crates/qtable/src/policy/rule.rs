//! How an action is chosen from a table.

use rand::{Rng, RngExt};
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::index::{Action, State};
use crate::table::{QTable, Value};

/// A rule that chooses an action. Actions that the table's mask forbids are never chosen.
///
/// A policy whose exploration changes with time counts its own choices, so that the same object
/// goes on where it stopped.
pub trait Policy<V: Value = f64> {
    /// Chooses an action for a state of the table.
    fn choose(&mut self, table: &QTable<V>, state: State, rng: &mut dyn Rng) -> Action;

    /// Writes the probability of every action, as the next call of [`choose`](Policy::choose) would
    /// have it, into `probabilities` (one entry for each action) and returns `true`; returns
    /// `false` if the policy cannot say.
    fn probabilities(&self, table: &QTable<V>, state: State, probabilities: &mut [f64]) -> bool {
        let _ = (table, state, probabilities);
        false
    }
}

impl<V: Value, P: Policy<V> + ?Sized> Policy<V> for Box<P> {
    fn choose(&mut self, table: &QTable<V>, state: State, rng: &mut dyn Rng) -> Action {
        (**self).choose(table, state, rng)
    }

    fn probabilities(&self, table: &QTable<V>, state: State, probabilities: &mut [f64]) -> bool {
        (**self).probabilities(table, state, probabilities)
    }
}

/// Always the best action; of equals the lowest index. ([`EpsilonGreedy`] with ε = 0 and
/// [`Ties::Random`] is the greedy policy that draws among equals.)
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct Greedy;

impl<V: Value> Policy<V> for Greedy {
    fn choose(&mut self, table: &QTable<V>, state: State, _rng: &mut dyn Rng) -> Action {
        table.best(state)
    }

    fn probabilities(&self, table: &QTable<V>, state: State, probabilities: &mut [f64]) -> bool {
        probabilities.fill(0.0);
        probabilities[table.best(state).0] = 1.0;
        true
    }
}

/// Which of several equally good actions is taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub enum Ties {
    /// The one with the lowest index.
    #[default]
    Lowest,
    /// Each with the same probability, by the caller's generator.
    Random,
}

impl Ties {
    /// One of the offered actions for which `score` is highest. The generator is asked only if
    /// there are several.
    pub(super) fn pick<V: Value>(
        self,
        table: &QTable<V>,
        state: State,
        rng: &mut dyn Rng,
        score: impl Fn(Action) -> f64,
    ) -> Action {
        let mut best = table.best(state);
        let (mut highest, mut equals) = (f64::NEG_INFINITY, 0);
        for action in table.offered(state) {
            let found = score(action);
            if found > highest {
                (best, highest, equals) = (action, found, 1);
            } else if found >= highest {
                equals += 1;
            }
        }
        if self == Self::Lowest || equals < 2 {
            return best;
        }
        let drawn = rng.random_range(0..equals);
        table
            .offered(state)
            .filter(|&action| score(action) >= highest)
            .nth(drawn)
            .unwrap_or(best)
    }
}
