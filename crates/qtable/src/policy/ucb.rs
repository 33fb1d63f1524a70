//! Upper confidence bounds.

use rand::{Rng, RngExt};

use crate::elementary::ln;
use crate::error::{Error, check_not_negative};
use crate::policy::rule::{Policy, Ties};
use crate::step::{Action, State};
use crate::table::QTable;
use crate::validated::validated;

validated! {
    /// The policy that takes the action with the highest upper confidence bound
    /// `Q(s,a) + c sqrt(ln N(s) / N(s,a))` (Auer, Cesa-Bianchi and Fischer 2002, state by state),
    /// where N counts the table's visits. Actions never tried come first.
    ///
    /// Of several best ones it draws one, so that actions never tried come in random order, unless
    /// [`with_ties`](Ucb::with_ties) says otherwise.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Ucb {
        width: f64,
        ties: Ties,
    }
}

impl Ucb {
    /// Creates the policy with `c`, in units of the values: about the spread of the returns;
    /// `sqrt(2)` times it for the bound of Auer and others. At 0 the policy is greedy once
    /// everything was tried.
    ///
    /// # Errors
    /// [`Error::Setting`] if `c` is negative or not finite.
    pub fn new(c: f64) -> Result<Self, Error> {
        let (width, ties) = (c, Ties::default());
        Self { width, ties }.restore()
    }

    /// Sets the choice among equally good actions.
    #[must_use]
    pub fn with_ties(self, ties: Ties) -> Self {
        Self { ties, ..self }
    }

    /// Returns the bound of an action by the logarithm of the state's visits.
    fn bound(&self, table: &QTable, state: State, log_visits: f64, action: Action) -> f64 {
        match table.visits(state, action) {
            0 => f64::INFINITY,
            n => table.value(state, action) + self.width * (log_visits / f64::from(n)).sqrt(),
        }
    }

    /// Returns the offered actions of the highest bound, by ascending index.
    fn best<'a>(&self, table: &'a QTable, state: State) -> impl Iterator<Item = Action> + 'a {
        let visits: u64 = table.visit_row(state).iter().map(|&n| u64::from(n)).sum();
        let (log_visits, ucb) = (ln(visits.max(1) as f64), *self);
        let bound = move |action| ucb.bound(table, state, log_visits, action);
        let bounds = table.offered(state).map(bound);
        let highest = bounds.fold(f64::NEG_INFINITY, f64::max);
        table
            .offered(state)
            .filter(move |&action| bound(action) >= highest)
    }

    fn restore(self) -> Result<Self, Error> {
        check_not_negative("c", self.width)?;
        Ok(self)
    }
}

impl Policy for Ucb {
    fn choose(&mut self, table: &QTable, state: State, rng: &mut dyn Rng) -> Action {
        let mut best = self.best(table, state);
        let lowest = best.next().unwrap_or_else(|| table.best(state));
        let equals = best.count() + 1;
        // The generator is asked only if there are several.
        if self.ties == Ties::Lowest || equals < 2 {
            return lowest;
        }
        let mut best = self.best(table, state);
        best.nth(rng.random_range(0..equals)).unwrap_or(lowest)
    }

    fn probabilities(&self, table: &QTable, state: State, probabilities: &mut [f64]) -> bool {
        let mut winners: Vec<Action> = self.best(table, state).collect();
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
