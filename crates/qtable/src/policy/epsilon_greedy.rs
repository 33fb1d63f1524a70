//! The ε-greedy policy.

use rand::Rng;

use crate::clock::Clock;
use crate::error::Error;
use crate::policy::rule::{Policy, Ties};
use crate::schedule::Schedule;
use crate::step::{Action, State};
use crate::table::QTable;
use crate::validated::validated;

validated! {
    /// The policy that takes a random offered action with probability ε and the best one otherwise.
    /// Of several best ones it draws one, unless [`with_ties`](EpsilonGreedy::with_ties) says
    /// otherwise. ε is kept to within 2^-32; of `n` actions each is drawn with a probability that
    /// differs from `1/n` by less than 2^-32.
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

    /// Draws one of the best actions, or of all that are offered, by 32 random bits. Out of line,
    /// since a table that has learned has few ties and most have no mask.
    #[cold]
    #[inline(never)]
    fn draw(&self, table: &QTable, state: State, bits: u32, explores: bool) -> Action {
        let count = match (explores, self.ties) {
            (true, _) => table.offered(state).count(),
            (false, Ties::Random) => table.equals(state),
            (false, Ties::Lowest) => 1,
        };
        // The row is read once, from the first candidate on.
        let (row, lowest) = (table.row(state), table.best(state));
        let (highest, first) = match explores {
            true => (f64::NEG_INFINITY, 0),
            false => (table.max(state), lowest.0),
        };
        let (candidates, nth) = (first..row.len(), part(bits, count));
        let drawn = match table.mask_row(state) {
            None => candidates.filter(|&a| row[a] >= highest).nth(nth),
            Some(offered) => candidates
                .filter(|&a| offered[a] && row[a] >= highest)
                .nth(nth),
        };
        drawn.map_or(lowest, Action)
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
        // One half of the bits decides whether to explore, the other one what is drawn.
        let drawn = rng.next_u64();
        let bits = drawn as u32;
        let explores = f64::from((drawn >> 32) as u32) * 2.0f64.powi(-32) < epsilon;
        if explores && !table.is_restricted() {
            return Action(part(bits, table.actions()));
        }
        match table.only_best(state) {
            Some(best) if !explores => best,
            _ => self.draw(table, state, bits, explores),
        }
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

/// Returns the part, of `count` equal ones, that 32 random bits fall into.
#[inline(always)]
fn part(bits: u32, count: usize) -> usize {
    ((u64::from(bits) * count as u64) >> 32) as usize
}

/// Returns `true` for an action of the highest value.
fn is_best(table: &QTable, state: State, action: Action) -> bool {
    table.value(state, action) >= table.max(state)
}
