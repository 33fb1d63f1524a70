//! How a table improves from experience.

use rand::Rng;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::{Error, check_gamma};
use crate::index::{Action, State};
use crate::policy::Policy;
use crate::problem::{Status, Step};
use crate::schedule::Schedule;
use crate::table::{QTable, Value};
use crate::validated::validated;

/// What a learner learns from: an action, what came of it, and what follows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Experience {
    /// The state the action was taken in.
    pub state: State,
    /// The action.
    pub action: Action,
    /// The environment's answer.
    pub step: Step,
    /// The action that the policy has chosen in the observed state. Present for learners that ask
    /// for it ([`Learner::on_policy`]) unless the step terminated the episode.
    pub next_action: Option<Action>,
}

/// A rule that improves a table.
///
/// The table is the caller's: it is what policies act upon and what is reported. What a rule needs
/// beside it (traces, a model, a second table) it keeps itself, so that the pair of table and
/// learner is the whole state of the learning.
pub trait Learner<V: Value = f64> {
    /// Whether the learner needs the action that will be taken next ([`Experience::next_action`]).
    /// Then it is chosen before the update, otherwise after it.
    fn on_policy(&self) -> bool {
        false
    }

    /// Prepares for an episode: forgets what an episode that was broken off left behind.
    fn begin_episode(&mut self) {}

    /// Learns from one action and returns its one-step temporal-difference error as it was before
    /// the update. `policy` is the one that acts.
    ///
    /// The visit is counted in the table. Nothing is bootstrapped through a step that terminated
    /// the episode; through one that was truncated it is.
    ///
    /// # Errors
    /// A state or action out of range or forbidden, a reward that is not finite, a value that would
    /// not be, or something missing that the learner needs. The table never holds a value that is
    /// not finite.
    fn learn(
        &mut self,
        table: &mut QTable<V>,
        experience: &Experience,
        policy: &dyn Policy<V>,
        rng: &mut dyn Rng,
    ) -> Result<f64, Error>;
}

impl<V: Value, L: Learner<V> + ?Sized> Learner<V> for Box<L> {
    fn on_policy(&self) -> bool {
        (**self).on_policy()
    }

    fn begin_episode(&mut self) {
        (**self).begin_episode();
    }

    fn learn(
        &mut self,
        table: &mut QTable<V>,
        experience: &Experience,
        policy: &dyn Policy<V>,
        rng: &mut dyn Rng,
    ) -> Result<f64, Error> {
        (**self).learn(table, experience, policy, rng)
    }
}

/// Learning rate, discount and clock, which nearly all learners have.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(Serialize, Deserialize),
    serde(remote = "Self")
)]
pub(super) struct Rates {
    pub(super) alpha: Schedule,
    pub(super) gamma: f64,
    pub(super) updates: u64,
}

impl Rates {
    pub(super) fn new(alpha: Schedule, gamma: f64) -> Result<Self, Error> {
        Self {
            alpha,
            gamma,
            updates: 0,
        }
        .restore()
    }

    fn restore(self) -> Result<Self, Error> {
        self.alpha.check("alpha", 0.0, 1.0, "in 0..=1")?;
        check_gamma(self.gamma)?;
        Ok(self)
    }

    /// α for the next update of a pair.
    #[inline]
    pub(super) fn alpha<V: Value>(&self, table: &QTable<V>, state: State, action: Action) -> f64 {
        self.alpha
            .at_visit(self.updates, u64::from(table.visits(state, action)))
    }

    /// `r + γ next`, without the second term after termination.
    #[inline(always)]
    pub(super) fn target(&self, step: &Step, next: impl FnOnce() -> f64) -> f64 {
        match step.status {
            Status::Terminated => step.reward,
            Status::Continuing | Status::Truncated => step.reward + self.gamma * next(),
        }
    }

    /// Moves a checked pair toward a target by α, counts the visit and ticks the clock. Returns the
    /// error before.
    #[inline(always)]
    pub(super) fn learn<V: Value>(
        &mut self,
        table: &mut QTable<V>,
        state: State,
        action: Action,
        target: f64,
    ) -> Result<f64, Error> {
        let entry = table.entry(state, action)?;
        let (old, visits) = table.at(entry);
        let error = target - old.to_f64();
        let alpha = self.alpha.at_visit(self.updates, u64::from(visits));
        table.store(state, action, old.to_f64() + alpha * error)?;
        table.count(entry);
        self.tick();
        Ok(error)
    }

    /// Counts an update.
    #[inline(always)]
    pub(super) fn tick(&mut self) {
        self.updates = self.updates.saturating_add(1);
    }
}

validated!(Rates);

/// Checks that an experience fits the table.
#[inline(always)]
pub(super) fn check<V: Value>(
    table: &QTable<V>,
    state: State,
    action: Action,
    step: &Step,
) -> Result<(), Error> {
    table.check(state, action)?;
    table.check_state(step.observation)?;
    if step.reward.is_finite() {
        Ok(())
    } else {
        Err(Error::RewardNotFinite {
            state,
            action,
            reward: step.reward,
        })
    }
}

/// The value of the action that an on-policy learner's policy has chosen next.
pub(super) fn next_value<V: Value>(
    table: &QTable<V>,
    experience: &Experience,
) -> Result<f64, Error> {
    if experience.step.status == Status::Terminated {
        return Ok(0.0);
    }
    let state = experience.step.observation;
    let action = experience
        .next_action
        .ok_or(Error::NextActionMissing { state })?;
    table.check(state, action)?;
    Ok(table.value(state, action).to_f64())
}

/// Whether the action is one of the best of its state, as a greedy policy would choose.
pub(super) fn is_greedy<V: Value>(table: &QTable<V>, state: State, action: Action) -> bool {
    table.value(state, action) >= table.max(state)
}
