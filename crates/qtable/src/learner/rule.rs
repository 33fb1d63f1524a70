//! The trait of a learner, and what learners share.

use rand::Rng;

use crate::clock::Clock;
use crate::error::{Error, check_finite, check_fraction};
use crate::policy::Policy;
use crate::schedule::Schedule;
use crate::step::{Action, State, Status, Step};
use crate::table::QTable;
use crate::validated::validated;

/// An action, its result, and the action that follows: what a learner learns from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Experience {
    /// State the action was taken in.
    pub state: State,
    /// The action.
    pub action: Action,
    /// Answer of the environment.
    pub step: Step,
    /// Action that the policy has chosen in the observed state. Present for learners that need it
    /// ([`Learner::needs_next_action`]) unless the step terminated the episode.
    pub next_action: Option<Action>,
}

impl Experience {
    /// Checks that the experience fits the table, and returns its state, action and step.
    #[inline(always)]
    pub(super) fn parts(&self, table: &QTable) -> Result<(State, Action, &Step), Error> {
        table.check(self.state, self.action)?;
        table.check_state(self.step.observation)?;
        check_finite("reward", self.state, self.action, self.step.reward)?;
        Ok((self.state, self.action, &self.step))
    }
}

/// A rule that improves a table.
///
/// The table is the caller's: policies act on it and reports show it. A learner keeps what else it
/// needs itself (traces, a model, a second table), so that table and learner together are the whole
/// state of the learning. [`Training`](crate::Training) runs it; a loop of your own looks so:
///
/// ```
/// use qtable::rand::{SeedableRng, rngs::Xoshiro256PlusPlus};
/// use qtable::{
///     Environment, EpsilonGreedy, Experience, Learner, ModelEnvironment, Policy, QLearning,
///     QTable, Schedule, State, Status,
/// };
///
/// fn main() -> Result<(), qtable::Error> {
///     let mut chain = ModelEnvironment::chain(4)?;
///     let mut table = QTable::new(4, 2)?;
///     let mut learner = QLearning::new(Schedule::constant(0.5)?, 0.9)?;
///     let mut policy = EpsilonGreedy::new(Schedule::constant(0.3)?)?;
///     let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
///     for _ in 0..100 {
///         let mut state = chain.reset(&mut rng)?;
///         learner.begin_episode();
///         loop {
///             let action = policy.choose(&table, state, &mut rng);
///             let step = chain.step(action, &mut rng)?;
///             let experience = Experience { state, action, step, next_action: None };
///             learner.learn(&mut table, &experience, &policy, &mut rng)?;
///             state = step.observation;
///             if step.status != Status::Continuing {
///                 break;
///             }
///         }
///     }
///     assert!((table.max(State(0)) - 0.81).abs() < 0.01);
///     Ok(())
/// }
/// ```
pub trait Learner {
    /// Returns `true` if the learner needs the action that will be taken next
    /// ([`Experience::next_action`]). Then that action is chosen before the update, otherwise
    /// after it.
    fn needs_next_action(&self) -> bool {
        false
    }

    /// Prepares for an episode: forgets what an episode that was broken off left behind.
    fn begin_episode(&mut self) {}

    /// Learns from one action, counts its visit in the table, and returns its one-step
    /// temporal-difference error before the update. `policy` is the policy that acts.
    ///
    /// Nothing is bootstrapped through a step that terminated the episode; through a truncated step
    /// it is.
    ///
    /// # Errors
    /// A state or action out of range or forbidden, a reward that is not finite, a value that would
    /// not be, or something missing that the learner needs.
    fn learn(
        &mut self,
        table: &mut QTable,
        experience: &Experience,
        policy: &dyn Policy,
        rng: &mut dyn Rng,
    ) -> Result<f64, Error>;
}

impl<L: Learner + ?Sized> Learner for Box<L> {
    fn needs_next_action(&self) -> bool {
        (**self).needs_next_action()
    }

    fn begin_episode(&mut self) {
        (**self).begin_episode();
    }

    fn learn(
        &mut self,
        table: &mut QTable,
        experience: &Experience,
        policy: &dyn Policy,
        rng: &mut dyn Rng,
    ) -> Result<f64, Error> {
        (**self).learn(table, experience, policy, rng)
    }
}

validated! {
    /// Learning rate, discount factor and clock of a learner.
    #[derive(Clone, Debug, PartialEq)]
    pub(super) struct Rates {
        pub(super) alpha: Schedule,
        pub(super) gamma: f64,
        pub(super) clock: Clock,
    }
}

impl Rates {
    pub(super) fn new(alpha: Schedule, gamma: f64) -> Result<Self, Error> {
        let clock = Clock::default();
        Self {
            alpha,
            gamma,
            clock,
        }
        .restore()
    }

    fn restore(self) -> Result<Self, Error> {
        self.alpha.check("alpha", 0.0, 1.0, "in 0..=1")?;
        check_fraction("gamma", self.gamma)?;
        Ok(self)
    }

    /// Returns α of the next update of a pair.
    #[inline]
    pub(super) fn alpha(&self, table: &QTable, state: State, action: Action) -> f64 {
        self.alpha.now(&self.clock, table.visits(state, action))
    }

    /// Returns `r + γ next`, without the second term after termination.
    #[inline(always)]
    pub(super) fn target(&self, step: &Step, next: impl FnOnce() -> f64) -> f64 {
        match step.status {
            Status::Terminated => step.reward,
            Status::Continuing | Status::Truncated => step.reward + self.gamma * next(),
        }
    }

    /// Returns `r + γ max over b of Q(s',b)`.
    #[inline(always)]
    pub(super) fn greedy_target(&self, table: &QTable, step: &Step) -> f64 {
        self.target(step, || table.max(step.observation))
    }

    /// Moves a pair toward a target by α, counts the visit and an update. Returns the error before.
    #[inline(always)]
    pub(super) fn learn(
        &mut self,
        table: &mut QTable,
        state: State,
        action: Action,
        target: f64,
    ) -> Result<f64, Error> {
        table.check(state, action)?;
        let (mut error, clock) = (0.0, &mut self.clock);
        table.update(state, action, 1, |old, visits| {
            error = target - old;
            old + self.alpha.current(clock, visits) * error
        })?;
        clock.tick();
        Ok(error)
    }
}

/// Returns `true` if the action is one of the best of its state.
pub(super) fn is_greedy(table: &QTable, state: State, action: Action) -> bool {
    table.value(state, action) >= table.max(state)
}
