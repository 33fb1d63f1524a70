//! Double Q-learning.

use rand::{Rng, RngExt};
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::learner::rule::{Experience, Learner, Rates, check};
use crate::policy::Policy;
use crate::schedule::Schedule;
use crate::table::{QTable, Value};
use crate::validated::validated;

/// Double Q-learning (van Hasselt 2010). Two tables A and B; a coin decides which one learns:
/// `A(s,a) <- A(s,a) + α (r + γ B(s', argmax over b of A(s',b)) - A(s,a))`, or the same with A and
/// B exchanged.
///
/// One table chooses the next action and the other one values it, so that a value overestimated by
/// chance is not chosen for being overestimated. The caller's table shows the mean of both, and the
/// policy acts on it; A and B begin as copies of it and are kept here. An α by visits goes by those
/// of the table that learns. There are no defaults.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(Serialize, Deserialize),
    serde(
        remote = "Self",
        bound(serialize = "V: Serialize", deserialize = "V: Deserialize<'de>")
    )
)]
pub struct DoubleQLearning<V: Value = f64> {
    rates: Rates,
    tables: Option<[QTable<V>; 2]>,
}

impl<V: Value> DoubleQLearning<V> {
    /// With α following a schedule over the updates made, or the visits.
    ///
    /// # Errors
    /// [`Error::ScheduleRange`] if α leaves `0..=1`, [`Error::Setting`] if γ does.
    pub fn new(alpha: Schedule, gamma: f64) -> Result<Self, Error> {
        Ok(Self {
            rates: Rates::new(alpha, gamma)?,
            tables: None,
        })
    }

    #[cfg(feature = "serde")]
    fn restore(self) -> Result<Self, Error> {
        if let Some([a, b]) = &self.tables {
            a.check_shape("the second table", b.states(), b.actions())?;
        }
        Ok(self)
    }
}

validated!(DoubleQLearning<V: Value>);

impl<V: Value> Learner<V> for DoubleQLearning<V> {
    fn learn(
        &mut self,
        table: &mut QTable<V>,
        experience: &Experience,
        _policy: &dyn Policy<V>,
        rng: &mut dyn Rng,
    ) -> Result<f64, Error> {
        let Experience {
            state,
            action,
            step,
            ..
        } = *experience;
        check(table, state, action, &step)?;
        let tables = self
            .tables
            .get_or_insert_with(|| [table.clone(), table.clone()]);
        table.check_shape(
            "the table of Double Q-learning",
            tables[0].states(),
            tables[0].actions(),
        )?;
        let (learning, valuing) = if rng.random() { (0, 1) } else { (1, 0) };
        let choice = tables[learning].best(step.observation);
        let target = self.rates.target(&step, || {
            tables[valuing].value(step.observation, choice).to_f64()
        });
        let alpha = self.rates.alpha(&tables[learning], state, action);
        let old = tables[learning].value(state, action).to_f64();
        let error = target - old;
        tables[learning].store(state, action, old + alpha * error)?;
        let mean = tables
            .each_ref()
            .map(|one| 0.5 * one.value(state, action).to_f64());
        table.store(state, action, mean[0] + mean[1])?;
        tables[learning].visit(state, action)?;
        table.visit(state, action)?;
        self.rates.tick();
        Ok(error)
    }
}
