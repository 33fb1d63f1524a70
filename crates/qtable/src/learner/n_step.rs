//! Q-learning with n-step returns.

use std::collections::VecDeque;

use rand::Rng;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::{Error, check_setting};
use crate::learner::rule::{Experience, Learner, Rates, check, constructor, is_greedy};
use crate::policy::Policy;
use crate::schedule::Schedule;
use crate::step::{Action, State, Status};
use crate::table::QTable;
use crate::validated::validated;

validated! {
    /// n-step Q-learning: `Q(s0,a0) <- Q(s0,a0) + α (r1 + γ r2 + … + γ^(n-1) rn + γ^n max over b of
    /// Q(sn,b) - Q(s0,a0))`.
    ///
    /// A return is closed early when the episode ends, and, after Watkins (1989), before an
    /// exploratory action: what comes after it is not what the greedy policy would have met.
    /// [`uncut`](NStepQ::uncut) lets the return run on (as in Mnih and others 2016), which is
    /// quicker while much is explored and biased as long as it is. Default: n = 4, cut. A pair is
    /// updated up to n steps after its visit; the visit is counted at once.
    #[derive(Clone, Debug, PartialEq)]
    pub struct NStepQ {
        rates: Rates,
        n: usize,
        cut: bool,
        /// Pairs not yet updated, oldest first.
        pending: VecDeque<Pending>,
    }
}

/// A visit whose update is still to come.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
struct Pending {
    state: State,
    action: Action,
    /// The reward that followed.
    reward: f64,
    /// Visits of the pair before this one.
    visits: u32,
}

impl NStepQ {
    constructor!(n: 4, cut: true, pending: VecDeque::new());

    /// Sets n, at least 1; 1 is one-step Q-learning.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn with_steps(self, n: usize) -> Result<Self, Error> {
        Self { n, ..self }.restore()
    }

    /// Lets a return run on through exploratory actions.
    #[must_use]
    pub fn uncut(self) -> Self {
        Self { cut: false, ..self }
    }

    fn restore(self) -> Result<Self, Error> {
        check_setting("n", self.n as f64, self.n > 0, "at least 1")?;
        Ok(self)
    }

    /// Updates the oldest pending pair with its rewards and the value of what follows the last of
    /// them.
    fn close_oldest(&mut self, table: &mut QTable, following: f64) -> Result<(), Error> {
        let rewards = self.pending.iter().rev();
        let target = rewards.fold(following, |rest, visit| {
            visit.reward + self.rates.gamma * rest
        });
        if let Some(visit) = self.pending.pop_front() {
            let (state, action) = (visit.state, visit.action);
            table.check(state, action)?;
            let alpha = self.rates.alpha.now(&self.rates.clock, visit.visits);
            let old = table.value(state, action);
            table.store(state, action, old + alpha * (target - old))?;
            self.rates.clock.tick();
        }
        Ok(())
    }

    fn close_all(&mut self, table: &mut QTable, end: Option<State>) -> Result<(), Error> {
        while !self.pending.is_empty() {
            // Asked again each time: the update before may have changed it.
            self.close_oldest(table, end.map_or(0.0, |state| table.max(state)))?;
        }
        Ok(())
    }
}

impl Learner for NStepQ {
    fn begin_episode(&mut self) {
        self.rates.clock.begin_episode();
        self.pending.clear();
    }

    fn learn(
        &mut self,
        table: &mut QTable,
        experience: &Experience,
        _policy: &dyn Policy,
        _rng: &mut dyn Rng,
    ) -> Result<f64, Error> {
        let (state, action, step) = (experience.state, experience.action, &experience.step);
        check(table, state, action, step)?;
        if self.cut && !is_greedy(table, state, action) {
            self.close_all(table, Some(state))?;
        }
        let target = self.rates.greedy_target(table, step);
        let error = target - table.value(state, action);
        self.pending.push_back(Pending {
            state,
            action,
            reward: step.reward,
            visits: table.visits(state, action),
        });
        table.visit(state, action)?;
        match step.status {
            Status::Terminated => self.close_all(table, None)?,
            Status::Truncated => self.close_all(table, Some(step.observation))?,
            Status::Continuing if self.pending.len() >= self.n => {
                self.close_oldest(table, table.max(step.observation))?;
            }
            Status::Continuing => {}
        }
        Ok(error)
    }
}
