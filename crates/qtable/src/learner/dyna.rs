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
use crate::table::{QTable, Value};

/// Dyna-Q (Sutton 1990): one-step Q-learning on each real step, then on k steps drawn from a model:
/// a pair tried before, each as likely as the other, and one of its outcomes, as often as it was
/// seen.
///
/// In Sutton's deterministic worlds an outcome is the last one seen; drawing from all of them is
/// the same there and right in a stochastic world too. Imagined steps use the α of the present, and
/// count neither as visits nor for the schedule. Default: k = 5.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct DynaQ {
    real: QLearning,
    planning_steps: u32,
    model: Option<ModelEstimate>,
}

impl DynaQ {
    /// With α following a schedule over the updates made, or the visits.
    ///
    /// # Errors
    /// [`Error::ScheduleRange`] if α leaves `0..=1`, [`Error::Setting`] if γ does.
    pub fn new(alpha: Schedule, gamma: f64) -> Result<Self, Error> {
        Ok(Self {
            real: QLearning::new(alpha, gamma)?,
            planning_steps: 5,
            model: None,
        })
    }

    /// Another number of imagined steps after each real one; 0 is plain Q-learning.
    pub fn with_planning_steps(self, planning_steps: u32) -> Self {
        Self {
            planning_steps,
            ..self
        }
    }

    /// What was learned of the environment, once there is something.
    pub fn model(&self) -> Option<&ModelEstimate> {
        self.model.as_ref()
    }

    fn imagine<V: Value>(&mut self, table: &mut QTable<V>, rng: &mut dyn Rng) -> Result<(), Error> {
        match self.model.as_ref().and_then(|model| model.draw(rng)) {
            Some((state, action, step)) => self.real.update_imagined(table, state, action, &step),
            None => Ok(()),
        }
    }
}

impl<V: Value> Learner<V> for DynaQ {
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
        } = experience;
        let error = self.real.update(table, *state, *action, step)?;
        if self.model.is_none() {
            self.model = Some(ModelEstimate::new(table.states(), table.actions())?);
        }
        if let Some(model) = &mut self.model {
            model.observe(*state, *action, step)?;
        }
        for _ in 0..self.planning_steps {
            self.imagine(table, rng)?;
        }
        Ok(error)
    }
}
