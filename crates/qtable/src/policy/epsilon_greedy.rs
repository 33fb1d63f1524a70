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

    /// Draws one of the best actions, or of all, by a number in `0..1`. Out of line, since a table
    /// that has learned has few ties and most have no mask.
    #[cold]
    #[inline(never)]
    fn draw(&self, table: &QTable, state: State, share: f64, explores: bool) -> Action {
        let equals = match self.ties {
            Ties::Lowest => 1,
            Ties::Random => table.equals(state),
        };
        let count = match explores {
            true => table.offered(state).count(),
            false => equals,
        };
        let mut wanted = table
            .offered(state)
            .filter(|&action| explores || is_best(table, state, action));
        wanted.nth(part(share, count)).unwrap_or(table.best(state))
    }

    fn restore(self) -> Result<Self, Error> {
        self.epsilon.check("epsilon", 0.0, 1.0, "in 0..=1")?;
        Ok(self)
    }
}

impl Policy for EpsilonGreedy {
    #[inline(always)]
    fn choose(&mut self, table: &QTable, state: State, rng: &mut dyn Rng) -> Action {
        let epsilon = self.epsilon.current(&mut self.clock, 0);
        self.clock.tick();
        // One number decides both: where it falls below ε, its place there is uniform again.
        let drawn: f64 = rng.random();
        let explores = drawn < epsilon;
        let tied = table.equals(state) > 1 && self.ties == Ties::Random;
        if table.is_restricted() | (tied & !explores) {
            let share = match explores {
                true => drawn / epsilon,
                false => (drawn - epsilon) / (1.0 - epsilon),
            };
            return self.draw(table, state, share, explores);
        }
        if explores {
            return Action(part(drawn / epsilon, table.actions()));
        }
        table.best(state)
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

/// Returns the part, of `count` equal ones, that a number of `0..1` falls into.
#[inline(always)]
fn part(share: f64, count: usize) -> usize {
    // As a signed number, which the processor converts at once.
    ((share * count as i64 as f64) as i64 as usize).min(count.saturating_sub(1))
}

/// Returns `true` for an action of the highest value.
fn is_best(table: &QTable, state: State, action: Action) -> bool {
    table.value(state, action) >= table.max(state)
}
