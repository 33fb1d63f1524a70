//! The one-step learners: Q-learning, SARSA and Expected SARSA.

use rand::Rng;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::index::{Action, State};
use crate::learner::rule::{Experience, Learner, Rates, check, next_value};
use crate::policy::Policy;
use crate::problem::{Status, Step};
use crate::schedule::Schedule;
use crate::scratch::Scratch;
use crate::table::{QTable, Value};

/// One-step Q-learning (Watkins and Dayan 1992; the paper's Eq. 3):
/// `Q(s,a) <- (1 - α) Q(s,a) + α (r + γ max over b of Q(s',b))`.
///
/// Learns the optimal policy whatever policy acts, as long as that one keeps trying everything. The
/// term in γ is left out when the step *terminated* the episode and kept when it was only
/// *truncated*. There are no defaults; the paper has γ = 0.9 and [`Schedule::paper_alpha`].
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct QLearning {
    rates: Rates,
}

impl QLearning {
    /// With α following a schedule over the updates made, or the visits.
    ///
    /// # Errors
    /// [`Error::ScheduleRange`] if α leaves `0..=1`, [`Error::Setting`] if γ does.
    pub fn new(alpha: Schedule, gamma: f64) -> Result<Self, Error> {
        Ok(Self {
            rates: Rates::new(alpha, gamma)?,
        })
    }

    /// Learns from one step: `action` taken in `state` led to `step`. Counts the visit and returns
    /// the error `r + γ max Q(s',·) - Q(s,a)` as it was before the update.
    ///
    /// # Errors
    /// A state or action out of range or forbidden, a reward that is not finite, or a value that
    /// would not be. The table is unchanged then.
    #[inline(always)]
    pub fn update<V: Value>(
        &mut self,
        table: &mut QTable<V>,
        state: State,
        action: Action,
        step: &Step,
    ) -> Result<f64, Error> {
        table.check_state(step.observation)?;
        let target = self
            .rates
            .target(step, || table.max(step.observation).to_f64());
        // A reward that is not finite makes a value that is not, which is refused; only its name is
        // to be found.
        match self.rates.learn(table, state, action, target) {
            Err(Error::ValueNotFinite { .. }) if !step.reward.is_finite() => {
                Err(Error::RewardNotFinite {
                    state,
                    action,
                    reward: step.reward,
                })
            }
            learned => learned,
        }
    }

    /// Learns from a step that did not really happen: no visit is counted, and the clock stands
    /// still.
    pub(super) fn update_imagined<V: Value>(
        &self,
        table: &mut QTable<V>,
        state: State,
        action: Action,
        step: &Step,
    ) -> Result<(), Error> {
        check(table, state, action, step)?;
        let target = self
            .rates
            .target(step, || table.max(step.observation).to_f64());
        let old = table.value(state, action).to_f64();
        table.store(
            state,
            action,
            old + self.rates.alpha(table, state, action) * (target - old),
        )
    }

    /// α of the next update of a pair never visited.
    pub fn alpha(&self) -> f64 {
        self.rates.alpha.at_visit(self.rates.updates, 0)
    }

    /// The discount factor.
    pub fn gamma(&self) -> f64 {
        self.rates.gamma
    }
}

impl<V: Value> Learner<V> for QLearning {
    #[inline]
    fn learn(
        &mut self,
        table: &mut QTable<V>,
        experience: &Experience,
        _policy: &dyn Policy<V>,
        _rng: &mut dyn Rng,
    ) -> Result<f64, Error> {
        self.update(table, experience.state, experience.action, &experience.step)
    }
}

/// SARSA (Rummery and Niranjan 1994): `Q(s,a) <- Q(s,a) + α (r + γ Q(s',a') - Q(s,a))` with the
/// action `a'` that the policy really takes next.
///
/// Learns the value of the policy that acts, exploration included, and so keeps away from cliffs.
/// There are no defaults.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct Sarsa {
    rates: Rates,
}

impl Sarsa {
    /// With α following a schedule over the updates made, or the visits.
    ///
    /// # Errors
    /// [`Error::ScheduleRange`] if α leaves `0..=1`, [`Error::Setting`] if γ does.
    pub fn new(alpha: Schedule, gamma: f64) -> Result<Self, Error> {
        Ok(Self {
            rates: Rates::new(alpha, gamma)?,
        })
    }
}

impl<V: Value> Learner<V> for Sarsa {
    fn on_policy(&self) -> bool {
        true
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
        } = experience;
        check(table, *state, *action, step)?;
        let next = next_value(table, experience)?;
        let target = self.rates.target(step, || next);
        self.rates.learn(table, *state, *action, target)
    }
}

/// Expected SARSA (van Seijen and others 2009):
/// `Q(s,a) <- Q(s,a) + α (r + γ Σ p(b|s') Q(s',b) - Q(s,a))`, with p from the policy that acts.
///
/// As SARSA, without the chance in the next action. There are no defaults. It needs a policy that
/// tells its probabilities, as all of this crate do.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct ExpectedSarsa {
    rates: Rates,
    #[cfg_attr(feature = "serde", serde(skip))]
    probabilities: Scratch,
}

impl ExpectedSarsa {
    /// With α following a schedule over the updates made, or the visits.
    ///
    /// # Errors
    /// [`Error::ScheduleRange`] if α leaves `0..=1`, [`Error::Setting`] if γ does.
    pub fn new(alpha: Schedule, gamma: f64) -> Result<Self, Error> {
        Ok(Self {
            rates: Rates::new(alpha, gamma)?,
            probabilities: Scratch::default(),
        })
    }

    fn expected<V: Value>(
        &mut self,
        table: &QTable<V>,
        state: State,
        policy: &dyn Policy<V>,
    ) -> Result<f64, Error> {
        let probabilities = self.probabilities.of_length(table.actions());
        if !policy.probabilities(table, state, probabilities) {
            return Err(Error::NoProbabilities);
        }
        let row = table.row(state);
        // Forbidden actions have probability 0 and, being finite, no part in the sum.
        Ok(probabilities
            .iter()
            .zip(row)
            .map(|(p, value)| p * value.to_f64())
            .sum())
    }
}

impl<V: Value> Learner<V> for ExpectedSarsa {
    fn learn(
        &mut self,
        table: &mut QTable<V>,
        experience: &Experience,
        policy: &dyn Policy<V>,
        _rng: &mut dyn Rng,
    ) -> Result<f64, Error> {
        let Experience {
            state,
            action,
            step,
            ..
        } = experience;
        check(table, *state, *action, step)?;
        let next = match step.status {
            Status::Terminated => 0.0,
            Status::Continuing | Status::Truncated => {
                self.expected(table, step.observation, policy)?
            }
        };
        let target = self.rates.target(step, || next);
        self.rates.learn(table, *state, *action, target)
    }
}
