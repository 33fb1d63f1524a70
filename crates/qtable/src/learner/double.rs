//! Double Q-learning.

use rand::{Rng, RngExt};

use crate::error::Error;
use crate::learner::rule::{Experience, Learner, Rates};
use crate::policy::Policy;
use crate::schedule::Schedule;
use crate::step::{Action, State};
use crate::table::QTable;
use crate::validated::validated;

validated! {
    /// Double Q-learning (van Hasselt 2010). Of two tables A and B a coin decides which one learns:
    /// `A(s,a) <- A(s,a) + α (r + γ B(s', argmax over b of A(s',b)) - A(s,a))`, or the same with A
    /// and B exchanged.
    ///
    /// One table chooses the next action and the other one values it, so that a value overestimated
    /// by chance is not chosen for being overestimated. The caller's table shows the mean of both,
    /// and the policy acts on it; A and B are kept here. An α by visits goes by the visits of the
    /// table that learns.
    ///
    /// A learner belongs to the table it was made for; another table, or one changed by hand, is
    /// refused with [`Error::OtherTable`].
    ///
    /// ```
    /// use qtable::{DoubleQLearning, QTable, Schedule};
    ///
    /// fn main() -> Result<(), qtable::Error> {
    ///     let table = QTable::new(48, 4)?;
    ///     let learner = DoubleQLearning::new(&table, Schedule::constant(0.1)?, 0.99)?;
    ///     // Training::new(&environment, table, learner, policy)?
    ///     Ok(())
    /// }
    /// ```
    #[derive(Clone, Debug, PartialEq)]
    pub struct DoubleQLearning {
        rates: Rates,
        tables: [QTable; 2],
    }
}

impl DoubleQLearning {
    /// Creates the learner for a table, with a schedule of α over its updates, episodes or visits,
    /// and the discount factor γ.
    ///
    /// # Errors
    /// [`Error::Setting`] if α or γ leaves `0..=1`.
    pub fn new(table: &QTable, alpha: Schedule, gamma: f64) -> Result<Self, Error> {
        Ok(Self {
            rates: Rates::new(alpha, gamma)?,
            tables: [table.clone(), table.clone()],
        })
    }

    /// Returns the mean of A and B.
    fn mean(&self, state: State, action: Action) -> f64 {
        let [a, b] = self.tables.each_ref();
        0.5 * a.value(state, action) + 0.5 * b.value(state, action)
    }

    /// Returns the best action of a state by one of the two tables. The caller's table knows which
    /// actions there are.
    fn choice(&self, learning: usize, table: &QTable, state: State) -> Action {
        let own = &self.tables[learning];
        if table.mask_row(state).is_none() {
            return own.best(state);
        }
        let higher = |best: Action, action: Action| {
            let better = own.value(state, action) > own.value(state, best);
            if better { action } else { best }
        };
        table.offered(state).reduce(higher).unwrap_or_default()
    }

    /// Refuses a table that does not show the mean.
    fn check_mean(&self, table: &QTable, state: State, action: Action) -> Result<(), Error> {
        if table.value(state, action).to_bits() == self.mean(state, action).to_bits() {
            return Ok(());
        }
        Err(Error::OtherTable(state, action))
    }

    #[cfg(feature = "serde")]
    fn restore(self) -> Result<Self, Error> {
        let [a, b] = &self.tables;
        a.check_shape("the second table", b.shape())?;
        Ok(self)
    }
}

impl Learner for DoubleQLearning {
    fn begin_episode(&mut self) {
        self.rates.clock.begin_episode();
    }

    fn learn(
        &mut self,
        table: &mut QTable,
        experience: &Experience,
        _policy: &dyn Policy,
        rng: &mut dyn Rng,
    ) -> Result<f64, Error> {
        let (state, action, step) = experience.parts(table)?;
        for own in &mut self.tables {
            own.grow(table.states())?;
        }
        table.check_shape("the learner's own table", self.tables[0].shape())?;
        let (learning, valuing) = if rng.random() { (0, 1) } else { (1, 0) };
        let choice = self.choice(learning, table, step.observation);
        self.check_mean(table, state, action)?;
        self.check_mean(table, step.observation, choice)?;
        let target = self.rates.target(step, || {
            self.tables[valuing].value(step.observation, choice)
        });
        let error = self
            .rates
            .learn(&mut self.tables[learning], state, action, target)?;
        table.store(state, action, self.mean(state, action))?;
        table.visit(state, action)?;
        Ok(error)
    }
}
