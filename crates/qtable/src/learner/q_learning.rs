//! One-step Q-learning.

use rand::Rng;

use crate::error::{Error, check_finite};
use crate::learner::rule::{Experience, Learner, Rates};
use crate::policy::Policy;
use crate::schedule::Schedule;
use crate::step::{Action, State, Step};
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
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct QLearning {
    rates: Rates,
}

impl QLearning {
    /// Creates the learner with a schedule of α over its updates, episodes or visits, and the
    /// discount factor γ.
    ///
    /// # Errors
    /// [`Error::Setting`] if α or γ leaves `0..=1`.
    pub fn new(alpha: Schedule, gamma: f64) -> Result<Self, Error> {
        let rates = Rates::new(alpha, gamma)?;
        Ok(Self { rates })
    }

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
        if let Err(Error::NotFinite { .. }) = learned {
            // The value is refused; the reward may be the cause.
            check_finite("reward", state, action, step.reward)?;
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
        table.check(state, action)?;
        table.check_state(step.observation)?;
        check_finite("reward", state, action, step.reward)?;
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

    #[inline(always)]
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
