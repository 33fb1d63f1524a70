//! The one-step learners: Q-learning, SARSA and Expected SARSA.

use rand::Rng;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::{Error, check_reward};
use crate::learner::rule::{Experience, Learner, Rates, check, constructor, next_value};
use crate::policy::Policy;
use crate::schedule::Schedule;
use crate::scratch::Scratch;
use crate::step::{Action, State, Status, Step};
use crate::table::QTable;

/// One-step Q-learning (Watkins and Dayan 1992):
/// `Q(s,a) <- (1 - α) Q(s,a) + α (r + γ max over b of Q(s',b))`.
///
/// It learns the optimal policy whatever policy acts, as long as that one keeps trying everything.
/// The term in γ is left out when the step *terminated* the episode and kept when it was only
/// *truncated*.
///
/// ```
/// use qtable::{Action, QLearning, QTable, Schedule, State, Status, Step};
///
/// fn main() -> Result<(), qtable::Error> {
///     let mut table = QTable::new(2, 1)?;
///     let mut learner = QLearning::new(Schedule::constant(0.5)?, 0.9)?;
///     let step = Step { observation: State(1), reward: 4.0, status: Status::Continuing };
///     let error = learner.update(&mut table, State(0), Action(0), &step)?;
///     assert_eq!((error, table.max(State(0))), (4.0, 2.0));
///     Ok(())
/// }
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct QLearning {
    rates: Rates,
}

impl QLearning {
    constructor!();

    /// Learns from one step: `action` taken in `state` led to `step`. Counts the visit and returns
    /// the error `r + γ max Q(s',·) - Q(s,a)` before the update.
    ///
    /// # Errors
    /// A state or action out of range or forbidden, a reward that is not finite, or a value that
    /// would not be. The table is unchanged then.
    #[inline(always)]
    pub fn update(
        &mut self,
        table: &mut QTable,
        state: State,
        action: Action,
        step: &Step,
    ) -> Result<f64, Error> {
        table.check_state(step.observation)?;
        let target = self.rates.greedy_target(table, step);
        let learned = self.rates.learn(table, state, action, target);
        if let Err(Error::ValueNotFinite { .. }) = learned {
            // The value is refused; the reward may be the cause.
            check_reward(state, action, step.reward)?;
        }
        learned
    }

    /// Learns from a step that a model made up: no visit is counted, and the clock stands still.
    pub(super) fn update_imagined(
        &self,
        table: &mut QTable,
        state: State,
        action: Action,
        step: &Step,
    ) -> Result<(), Error> {
        check(table, state, action, step)?;
        let target = self.rates.greedy_target(table, step);
        let old = table.value(state, action);
        let alpha = self.rates.alpha(table, state, action);
        table.store(state, action, old + alpha * (target - old))
    }

    /// Returns α of the next update of a pair with a number of visits.
    #[inline(always)]
    pub(crate) fn alpha(&self, visits: u32) -> f64 {
        self.rates.alpha.now(&self.rates.clock, visits)
    }

    /// Returns `true` if α goes by visits.
    pub(crate) fn is_by_visits(&self) -> bool {
        self.rates.alpha.is_by_visits()
    }

    pub(crate) fn gamma(&self) -> f64 {
        self.rates.gamma
    }

    /// Counts an update that was made in cached weights.
    #[inline(always)]
    pub(crate) fn tick(&mut self) {
        self.rates.clock.tick();
    }
}

impl Learner for QLearning {
    fn begin_episode(&mut self) {
        self.rates.clock.begin_episode();
    }

    #[inline]
    fn learn(
        &mut self,
        table: &mut QTable,
        experience: &Experience,
        _policy: &dyn Policy,
        _rng: &mut dyn Rng,
    ) -> Result<f64, Error> {
        self.update(table, experience.state, experience.action, &experience.step)
    }
}

/// SARSA (Rummery and Niranjan 1994): `Q(s,a) <- Q(s,a) + α (r + γ Q(s',a') - Q(s,a))` with the
/// action `a'` that the policy takes next.
///
/// It learns the value of the policy that acts, exploration included, and so keeps away from
/// cliffs. The action after a truncated step is chosen for the update only: it advances a policy's
/// schedule by one choice more than with Q-learning.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct Sarsa {
    rates: Rates,
}

impl Sarsa {
    constructor!();
}

impl Learner for Sarsa {
    fn needs_next_action(&self) -> bool {
        true
    }

    fn begin_episode(&mut self) {
        self.rates.clock.begin_episode();
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
        let next = next_value(table, experience)?;
        let target = self.rates.target(step, || next);
        self.rates.learn(table, state, action, target)
    }
}

/// Expected SARSA (van Seijen and others 2009):
/// `Q(s,a) <- Q(s,a) + α (r + γ Σ p(b|s') Q(s',b) - Q(s,a))`, with p from the policy that acts.
///
/// It is SARSA without the chance in the next action. It needs a policy that tells its
/// probabilities, as all of this crate do.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct ExpectedSarsa {
    rates: Rates,
    #[cfg_attr(feature = "serde", serde(skip))]
    probabilities: Scratch,
}

impl ExpectedSarsa {
    constructor!(probabilities: Scratch::default());

    fn expected(
        &mut self,
        table: &QTable,
        state: State,
        policy: &dyn Policy,
    ) -> Result<f64, Error> {
        let probabilities = self.probabilities.of_length(table.actions());
        if !policy.probabilities(table, state, probabilities) {
            return Err(Error::NoProbabilities);
        }
        // Forbidden actions have probability 0 and, being finite, no part in the sum.
        let row = table.row(state);
        Ok(probabilities.iter().zip(row).map(|(p, q)| p * q).sum())
    }
}

impl Learner for ExpectedSarsa {
    fn begin_episode(&mut self) {
        self.rates.clock.begin_episode();
    }

    fn learn(
        &mut self,
        table: &mut QTable,
        experience: &Experience,
        policy: &dyn Policy,
        _rng: &mut dyn Rng,
    ) -> Result<f64, Error> {
        let (state, action, step) = (experience.state, experience.action, &experience.step);
        check(table, state, action, step)?;
        let next = match step.status {
            Status::Terminated => 0.0,
            Status::Continuing | Status::Truncated => {
                self.expected(table, step.observation, policy)?
            }
        };
        let target = self.rates.target(step, || next);
        self.rates.learn(table, state, action, target)
    }
}
