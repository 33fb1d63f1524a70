//! Q-learning with n-step returns.

use std::collections::VecDeque;

use rand::Rng;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::{Error, check_setting};
use crate::index::{Action, State};
use crate::learner::rule::{Experience, Learner, Rates, check, is_greedy};
use crate::policy::Policy;
use crate::problem::Status;
use crate::schedule::Schedule;
use crate::table::{QTable, Value};
use crate::validated::validated;

/// n-step Q-learning:
/// `Q(s0,a0) <- Q(s0,a0) + α (r1 + γ r2 + … + γ^(n-1) rn + γ^n max over b of Q(sn,b) - Q(s0,a0))`.
///
/// A return is closed early when the episode ends, and, after Watkins (1989), before an exploratory
/// action: what comes after that is not what the greedy policy would have met.
/// [`uncut`](NStepQ::uncut) lets it run on (as in Mnih and others 2016): quicker while much is
/// explored, biased as long as it is. Default: n = 4, cut. A pair is updated up to n steps after
/// its visit.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(Serialize, Deserialize),
    serde(remote = "Self")
)]
pub struct NStepQ {
    rates: Rates,
    n: usize,
    cut: bool,
    /// Pairs not yet updated, each with the reward that followed it; oldest first.
    pending: VecDeque<(State, Action, f64)>,
}

impl NStepQ {
    /// With α following a schedule over the updates made, or the visits.
    ///
    /// # Errors
    /// [`Error::ScheduleRange`] if α leaves `0..=1`, [`Error::Setting`] if γ does.
    pub fn new(alpha: Schedule, gamma: f64) -> Result<Self, Error> {
        Ok(Self {
            rates: Rates::new(alpha, gamma)?,
            n: 4,
            cut: true,
            pending: VecDeque::new(),
        })
    }

    /// Another n, at least 1, at which it is one-step Q-learning.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn with_steps(self, n: usize) -> Result<Self, Error> {
        Self { n, ..self }.restore()
    }

    /// Lets a return run on through exploratory actions.
    pub fn uncut(self) -> Self {
        Self { cut: false, ..self }
    }

    fn restore(self) -> Result<Self, Error> {
        check_setting("n", self.n as f64, self.n > 0, "at least 1")?;
        Ok(self)
    }

    /// Updates the oldest pending pair with its rewards and the value of what follows the last of
    /// them.
    fn close_oldest<V: Value>(
        &mut self,
        table: &mut QTable<V>,
        following: f64,
    ) -> Result<(), Error> {
        let target = self
            .pending
            .iter()
            .rev()
            .fold(following, |rest, &(.., reward)| {
                reward + self.rates.gamma * rest
            });
        if let Some((state, action, _)) = self.pending.pop_front() {
            table.check(state, action)?;
            self.rates.learn(table, state, action, target)?;
        }
        Ok(())
    }

    fn close_all<V: Value>(
        &mut self,
        table: &mut QTable<V>,
        end: Option<State>,
    ) -> Result<(), Error> {
        while !self.pending.is_empty() {
            // Asked anew each time: the update before may have changed it.
            self.close_oldest(table, end.map_or(0.0, |state| table.max(state).to_f64()))?;
        }
        Ok(())
    }
}

validated!(NStepQ);

impl<V: Value> Learner<V> for NStepQ {
    fn begin_episode(&mut self) {
        self.pending.clear();
    }

    fn learn(
        &mut self,
        table: &mut QTable<V>,
        experience: &Experience,
        _policy: &dyn Policy<V>,
        _rng: &mut dyn Rng,
    ) -> Result<f64, Error> {
        let Experience {
            state,
            action,
            step,
            ..
        } = *experience;
        check(table, state, action, &step)?;
        if self.cut && !is_greedy(table, state, action) {
            self.close_all(table, Some(state))?;
        }
        let target = self
            .rates
            .target(&step, || table.max(step.observation).to_f64());
        let error = target - table.value(state, action).to_f64();
        self.pending.push_back((state, action, step.reward));
        match step.status {
            Status::Terminated => self.close_all(table, None)?,
            Status::Truncated => self.close_all(table, Some(step.observation))?,
            Status::Continuing if self.pending.len() >= self.n => {
                self.close_oldest(table, table.max(step.observation).to_f64())?;
            }
            Status::Continuing => {}
        }
        Ok(error)
    }
}
