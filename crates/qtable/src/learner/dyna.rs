//! Dyna-Q: learning from remembered experience between real steps.

use rand::Rng;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::learner::one_step::QLearning;
use crate::learner::rule::{Experience, Learner};
use crate::model::ModelEstimate;
use crate::policy::Policy;
use crate::schedule::Schedule;
use crate::table::QTable;

/// Dyna-Q (Sutton 1990): one-step Q-learning on each real step, then on k steps drawn from a model:
/// a pair tried before, each as likely as the other, and one of its outcomes, as often as it was
/// seen.
///
/// Imagined steps use the α of the present, and count neither as visits nor for the schedule.
/// Default: k = 5.
///
/// A learner belongs to the table it was made for; another table is refused with
/// [`Error::OtherTable`].
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct DynaQ {
    real: QLearning,
    planning_steps: u32,
    model: ModelEstimate,
}

impl DynaQ {
    /// Creates the learner for a table, with a schedule of α over its updates, episodes or visits,
    /// and the discount factor γ.
    ///
    /// # Errors
    /// [`Error::ScheduleRange`] if α leaves `0..=1`, [`Error::Setting`] if γ does.
    pub fn new(table: &QTable, alpha: Schedule, gamma: f64) -> Result<Self, Error> {
        Ok(Self {
            real: QLearning::new(alpha, gamma)?,
            planning_steps: 5,
            model: ModelEstimate::new(table.states(), table.actions())?,
        })
    }

    /// Sets the number of imagined steps after each real one; 0 is plain Q-learning.
    #[must_use]
    pub fn with_planning_steps(self, planning_steps: u32) -> Self {
        Self {
            planning_steps,
            ..self
        }
    }

    /// Returns the model learned so far.
    pub fn model(&self) -> &ModelEstimate {
        &self.model
    }
}

impl Learner for DynaQ {
    fn begin_episode(&mut self) {
        self.real.begin_episode();
    }

    fn learn(
        &mut self,
        table: &mut QTable,
        experience: &Experience,
        _policy: &dyn Policy,
        rng: &mut dyn Rng,
    ) -> Result<f64, Error> {
        let (state, action, step) = (experience.state, experience.action, &experience.step);
        self.model.check_table(table)?;
        let error = self.real.update(table, state, action, step)?;
        self.model.observe(state, action, step)?;
        for _ in 0..self.planning_steps {
            if let Some((state, action, step)) = self.model.draw(rng) {
                self.real.update_imagined(table, state, action, &step)?;
            }
        }
        Ok(error)
    }
}
