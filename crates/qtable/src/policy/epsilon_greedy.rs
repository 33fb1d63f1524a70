//! The ε-greedy policy.

use rand::{Rng, RngExt};

use crate::error::Error;
use crate::policy::rule::{Policy, Ties};
use crate::schedule::{Clock, Schedule};
use crate::step::{Action, State};
use crate::table::QTable;
use crate::validated::validated;

validated! {
    /// The policy that takes a random offered action with probability ε and the best one otherwise.
    /// Of several best ones it draws one, unless [`with_ties`](EpsilonGreedy::with_ties) says
    /// otherwise.
    #[derive(Clone, Debug, PartialEq)]
    pub struct EpsilonGreedy {
        epsilon: Schedule,
        ties: Ties,
        clock: Clock,
    }
}

impl EpsilonGreedy {
    /// Creates the policy with a schedule of ε over its choices, or over episodes.
    ///
    /// # Errors
    /// [`Error::Setting`] if ε leaves `0..=1`.
    pub fn new(epsilon: Schedule) -> Result<Self, Error> {
        let (ties, clock) = (Ties::default(), Clock::default());
        Self {
            epsilon,
            ties,
            clock,
        }
        .restore()
    }

    /// Sets the choice among equally good actions.
    #[must_use]
    pub fn with_ties(self, ties: Ties) -> Self {
        Self { ties, ..self }
    }

    /// Returns ε of the next choice.
    #[inline]
    pub fn epsilon(&self) -> f64 {
        self.epsilon.at_time(&self.clock)
    }

    /// Draws one of several best actions. Rare in a table that has learned, so kept out of line.
    #[cold]
    #[inline(never)]
    fn draw(&self, table: &QTable, state: State, equals: usize, rng: &mut dyn Rng) -> Action {
        self.ties.pick(table.best(state), equals, rng, || {
            let offered = table.offered(state);
            offered.filter(|&action| is_best(table, state, action))
        })
    }

    fn restore(self) -> Result<Self, Error> {
        self.epsilon.check("epsilon", 0.0, 1.0, "in 0..=1")?;
        Ok(self)
    }
}

impl Policy for EpsilonGreedy {
    #[inline]
    fn choose(&mut self, table: &QTable, state: State, rng: &mut dyn Rng) -> Action {
        let epsilon = self.epsilon();
        self.clock.tick();
        let lowest = table.best(state);
        if rng.random::<f64>() >= epsilon {
            return match table.equals(state) {
                0 | 1 => lowest,
                equals => self.draw(table, state, equals, rng),
            };
        }
        let Some(mask) = table.mask_row(state) else {
            return Action(rng.random_range(0..table.actions()));
        };
        let offered = mask.iter().filter(|&&offered| offered).count();
        let drawn = rng.random_range(0..offered.max(1));
        table.offered(state).nth(drawn).unwrap_or(lowest)
    }

    fn probabilities(&self, table: &QTable, state: State, probabilities: &mut [f64]) -> bool {
        let epsilon = self.epsilon();
        probabilities.fill(0.0);
        let share = epsilon / table.offered(state).count() as f64;
        let (lowest, equals) = (table.best(state), table.equals(state) as f64);
        for action in table.offered(state) {
            let greedy = match self.ties {
                Ties::Lowest if action == lowest => 1.0 - epsilon,
                Ties::Random if is_best(table, state, action) => (1.0 - epsilon) / equals,
                _ => 0.0,
            };
            probabilities[action.0] = share + greedy;
        }
        true
    }

    fn begin_episode(&mut self) {
        self.clock.begin_episode();
    }
}

/// Returns `true` for an action of the highest value.
fn is_best(table: &QTable, state: State, action: Action) -> bool {
    table.value(state, action) >= table.max(state)
}
