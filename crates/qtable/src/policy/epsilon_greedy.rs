//! The ε-greedy policy.

use rand::{Rng, RngExt};
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::index::{Action, State};
use crate::policy::rule::{Policy, Ties};
use crate::schedule::Schedule;
use crate::table::{QTable, Value};
use crate::validated::validated;

/// A random offered action with probability ε, the best one otherwise. Of equals the lowest index,
/// unless [`with_ties`](EpsilonGreedy::with_ties) says otherwise.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(Serialize, Deserialize),
    serde(remote = "Self")
)]
pub struct EpsilonGreedy {
    epsilon: Schedule,
    ties: Ties,
    choices: u64,
}

impl EpsilonGreedy {
    /// With ε following a schedule over the choices made.
    ///
    /// # Errors
    /// [`Error::ScheduleRange`] if ε leaves `0..=1`.
    pub fn new(epsilon: Schedule) -> Result<Self, Error> {
        Self {
            epsilon,
            ties: Ties::Lowest,
            choices: 0,
        }
        .restore()
    }

    /// Takes one of equally good actions by another rule.
    pub fn with_ties(self, ties: Ties) -> Self {
        Self { ties, ..self }
    }

    /// ε of the next choice.
    #[inline]
    pub fn epsilon(&self) -> f64 {
        self.epsilon.at_visit(self.choices, self.choices)
    }

    fn restore(self) -> Result<Self, Error> {
        self.epsilon.check("epsilon", 0.0, 1.0, "in 0..=1")?;
        Ok(self)
    }
}

validated!(EpsilonGreedy);

impl<V: Value> Policy<V> for EpsilonGreedy {
    #[inline]
    fn choose(&mut self, table: &QTable<V>, state: State, rng: &mut dyn Rng) -> Action {
        let epsilon = self.epsilon();
        self.choices = self.choices.saturating_add(1);
        if rng.random::<f64>() >= epsilon {
            return match self.ties {
                Ties::Lowest => table.best(state),
                Ties::Random => self.ties.pick(table, state, rng, |action| {
                    table.value(state, action).to_f64()
                }),
            };
        }
        if table.mask().is_none() {
            return Action(rng.random_range(0..table.actions()));
        }
        let offered = table.offered(state).count();
        table
            .offered(state)
            .nth(rng.random_range(0..offered))
            .unwrap_or_else(|| table.best(state))
    }

    fn probabilities(&self, table: &QTable<V>, state: State, probabilities: &mut [f64]) -> bool {
        let epsilon = self.epsilon();
        probabilities.fill(0.0);
        let share = epsilon / table.offered(state).count() as f64;
        let is_best = |action| match self.ties {
            Ties::Lowest => action == table.best(state),
            Ties::Random => table.value(state, action) >= table.max(state),
        };
        let equals = table
            .offered(state)
            .filter(|&action| is_best(action))
            .count();
        for action in table.offered(state) {
            let greedy = if is_best(action) {
                (1.0 - epsilon) / equals as f64
            } else {
                0.0
            };
            probabilities[action.0] = share + greedy;
        }
        true
    }
}
