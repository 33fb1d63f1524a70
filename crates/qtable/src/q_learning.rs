//! One-step Q-learning.

#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::check_gamma;
use crate::validated::validated;
use crate::{Action, Error, QTable, Schedule, State, Status, Step, Value};

/// One-step Q-learning (Watkins and Dayan 1992; the paper's Eq. 3):
/// `Q(s,a) <- (1 - α) Q(s,a) + α (r + γ max over b of Q(s',b))`.
///
/// The term in γ is left out when the step *terminated* the episode and kept when it was only *truncated*.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize), serde(remote = "Self"))]
pub struct QLearning {
    alpha: Schedule,
    gamma: f64,
    updates: u64,
}

impl QLearning {
    /// With α following a schedule over the updates made.
    ///
    /// # Errors
    /// [`Error::ScheduleRange`] if α leaves `0..=1`, [`Error::Setting`] if γ does.
    pub fn new(alpha: Schedule, gamma: f64) -> Result<Self, Error> {
        alpha.check("alpha", 0.0, 1.0, "in 0..=1")?;
        check_gamma(gamma)?;
        Ok(Self {
            alpha,
            gamma,
            updates: 0,
        })
    }

    /// Learns from one step: `action` taken in `state` led to `step`. Counts the visit and returns the error
    /// `r + γ max Q(s',·) - Q(s,a)` as it was before the update.
    ///
    /// # Errors
    /// A state or action out of range or forbidden, a reward that is not finite, or a value that would not be.
    /// The table is unchanged then.
    #[inline]
    pub fn update<V: Value>(
        &mut self,
        table: &mut QTable<V>,
        state: State,
        action: Action,
        step: &Step,
    ) -> Result<f64, Error> {
        table.check(state, action)?;
        table.check_state(step.observation)?;
        if !step.reward.is_finite() {
            return Err(Error::RewardNotFinite {
                state,
                action,
                reward: step.reward,
            });
        }
        let next = match step.status {
            Status::Terminated => 0.0,
            Status::Continuing | Status::Truncated => table.max(step.observation).to_f64(),
        };
        let old = table.value(state, action).to_f64();
        let error = step.reward + self.gamma * next - old;
        let alpha = self.alpha.at(self.updates);
        table.set(state, action, V::from_f64(old + alpha * error))?;
        table.visit(state, action)?;
        self.updates += 1;
        Ok(error)
    }

    /// α of the next update.
    pub fn alpha(&self) -> f64 {
        self.alpha.at(self.updates)
    }

    /// The discount factor.
    pub fn gamma(&self) -> f64 {
        self.gamma
    }

    fn restore(self) -> Result<Self, Error> {
        self.alpha.check("alpha", 0.0, 1.0, "in 0..=1")?;
        check_gamma(self.gamma)?;
        Ok(self)
    }
}

validated!(QLearning);
