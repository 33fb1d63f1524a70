//! A training run that can stop, be saved, and go on.

use std::num::NonZeroU64;
use std::ops::ControlFlow;

use rand::Rng;

use crate::error::{Error, positive};
use crate::learner::{Experience, Learner};
use crate::policy::Policy;
use crate::problem::Environment;
use crate::step::{Action, State, Status, Step};
use crate::table::QTable;
use crate::training::course::{Actor, Course, Until};
use crate::training::curve::{Record, Tally};
use crate::training::episode::check_fit;

/// A training run: table, learner, policy, counters, learning curve, and the episode that is going
/// on.
///
/// Environment and generator are the caller's and are handed to every call. A run that is stopped,
/// saved together with these two, loaded and continued ends in the same bits as one that was never
/// stopped:
///
#[cfg_attr(feature = "files", doc = "```")]
#[cfg_attr(not(feature = "files"), doc = "```ignore")]
/// use qtable::rand::{SeedableRng, rngs::Xoshiro256PlusPlus};
/// use qtable::{
///     EpsilonGreedy, ModelEnvironment, QLearning, QTable, Schedule, Training, Until, decode,
///     encode,
/// };
///
/// fn main() -> Result<(), Box<dyn std::error::Error>> {
///     let mut lake = ModelEnvironment::frozen_lake("4x4", false)?;
///     let learner = QLearning::new(Schedule::constant(0.1)?, 0.95)?;
///     let policy = EpsilonGreedy::new(Schedule::linear(1.0, 0.0, 10_000)?)?;
///     let mut training = Training::new(&lake, QTable::new(16, 4)?, learner, policy)?;
///     let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
///     training.run(&mut lake, Until::Actions(7_001), &mut rng)?;
///
///     let saved = encode("lake-training/1", &(&training, &lake, &rng))?;
///     type Run = (Training<QLearning, EpsilonGreedy>, ModelEnvironment, Xoshiro256PlusPlus);
///     let (mut resumed, mut same_lake, mut same_rng): Run = decode("lake-training/1", &saved)?;
///
///     training.run(&mut lake, Until::Actions(20_000), &mut rng)?;
///     resumed.run(&mut same_lake, Until::Actions(20_000), &mut same_rng)?;
///     assert_eq!(training, resumed);
///     Ok(())
/// }
/// ```
///
/// An environment that cannot be saved is left between episodes: run to [`Until::Episodes`] and
/// save then ([`is_in_episode`](Training::is_in_episode)).
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Training<L, P> {
    pub(super) table: QTable,
    pub(super) learner: L,
    pub(super) policy: P,
    pub(super) course: Course,
    pub(super) curve: Vec<Record>,
}

impl<L: Learner, P: Policy> Training<L, P> {
    /// Creates a run with a table, which may hold knowledge from before. If the environment
    /// restricts its actions, the table takes over the mask. By default episodes have no limit and
    /// a record is made every 1000 actions.
    ///
    /// # Errors
    /// [`Error::ShapeMismatch`] if table and environment differ.
    pub fn new<E: Environment + ?Sized>(
        environment: &E,
        mut table: QTable,
        learner: L,
        policy: P,
    ) -> Result<Self, Error> {
        check_fit(environment, &table)?;
        table.restrict_as(environment);
        let course = Course {
            episode_limit: NonZeroU64::MAX,
            record_every: positive("record_every", 1000)?,
            actions: 0,
            episodes: 0,
            running: None,
            tally: Tally::default(),
        };
        Ok(Self {
            table,
            learner,
            policy,
            course,
            curve: Vec::new(),
        })
    }

    /// Truncates an episode after a number of actions, at least 1. A run that has begun keeps
    /// everything else.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn with_episode_limit(mut self, actions: u64) -> Result<Self, Error> {
        self.course.episode_limit = positive("episode_limit", actions)?;
        Ok(self)
    }

    /// Makes a record a number of actions after the last one, at least 1. A run that has begun
    /// keeps everything else.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn with_record_every(mut self, actions: u64) -> Result<Self, Error> {
        self.course.record_every = positive("record_every", actions)?;
        Ok(self)
    }

    /// Trains until a total is reached; not at all if it is reached already.
    ///
    /// # Errors
    /// An environment of another shape or with a fault (state out of range, reward not finite), or
    /// a policy or learner that fails. What was learned before stays; the episode is given up.
    pub fn run<E: Environment + ?Sized, R: Rng + ?Sized>(
        &mut self,
        environment: &mut E,
        until: Until,
        rng: &mut R,
    ) -> Result<(), Error> {
        self.run_with(environment, until, rng, |_, _| ControlFlow::Continue(()))
            .map(|_| ())
    }

    /// Trains like [`run`](Training::run) and calls `on_record` with every record and the run, for
    /// a progress bar, an evaluation, a change of the policy, or an early stop. Returns `true` if
    /// it was stopped early.
    ///
    /// ```
    /// use std::ops::ControlFlow;
    ///
    /// use qtable::rand::{SeedableRng, rngs::Xoshiro256PlusPlus};
    /// use qtable::{EpsilonGreedy, ModelEnvironment, QLearning, QTable, Schedule, Training, Until};
    ///
    /// fn main() -> Result<(), qtable::Error> {
    ///     let mut chain = ModelEnvironment::chain(5)?;
    ///     let learner = QLearning::new(Schedule::constant(0.5)?, 0.9)?;
    ///     let policy = EpsilonGreedy::new(Schedule::constant(0.5)?)?;
    ///     let careful = EpsilonGreedy::new(Schedule::constant(0.1)?)?;
    ///     let mut training = Training::new(&chain, QTable::new(5, 2)?, learner, policy)?;
    ///     let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    ///     let until = Until::Actions(100_000);
    ///     let stopped = training.run_with(&mut chain, until, &mut rng, |record, training| {
    ///         *training.policy_mut() = careful.clone();
    ///         match record.mean_steps < Some(5.0) {
    ///             true => ControlFlow::Break(()),
    ///             false => ControlFlow::Continue(()),
    ///         }
    ///     })?;
    ///     assert!(stopped && training.actions() < 100_000);
    ///     Ok(())
    /// }
    /// ```
    ///
    /// # Errors
    /// [`run`](Training::run) lists them.
    pub fn run_with<E: Environment + ?Sized, R: Rng + ?Sized>(
        &mut self,
        environment: &mut E,
        until: Until,
        mut rng: &mut R,
        mut on_record: impl FnMut(&Record, &mut Self) -> ControlFlow<()>,
    ) -> Result<bool, Error> {
        check_fit(environment, &self.table)?;
        while !self.course.has_reached(until) {
            let (course, mut pair) = self.parts();
            let Some(record) = course.run(environment, &mut pair, until, u64::MAX, &mut rng)?
            else {
                return Ok(false);
            };
            self.curve.push(record);
            if on_record(&record, self).is_break() {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Returns the counters beside the policy and the learner on their table.
    pub(super) fn parts(&mut self) -> (&mut Course, Pair<'_, L, P>) {
        let pair = Pair {
            table: &mut self.table,
            learner: &mut self.learner,
            policy: &mut self.policy,
        };
        (&mut self.course, pair)
    }

    /// Returns the table.
    pub fn table(&self) -> &QTable {
        &self.table
    }

    /// Returns the learner.
    pub fn learner(&self) -> &L {
        &self.learner
    }

    /// Returns the policy.
    pub fn policy(&self) -> &P {
        &self.policy
    }

    /// Returns the policy, to be changed while the run goes on.
    pub fn policy_mut(&mut self) -> &mut P {
        &mut self.policy
    }

    /// Returns the learning curve so far, oldest record first.
    pub fn curve(&self) -> &[Record] {
        &self.curve
    }

    /// Takes the learning curve out of the run, which goes on with an empty one.
    pub fn take_curve(&mut self) -> Vec<Record> {
        std::mem::take(&mut self.curve)
    }

    /// Returns the number of actions taken so far.
    pub fn actions(&self) -> u64 {
        self.course.actions
    }

    /// Returns the number of episodes ended so far.
    pub fn episodes(&self) -> u64 {
        self.course.episodes
    }

    /// Returns `true` if an episode is going on, so that the environment's own state belongs to the
    /// state of the run.
    pub fn is_in_episode(&self) -> bool {
        self.course.running.is_some()
    }

    /// Gives up the episode that is going on: the next action begins another one.
    pub fn end_episode(&mut self) {
        self.course.running = None;
    }

    /// Returns table, learner and policy.
    pub fn into_parts(self) -> (QTable, L, P) {
        (self.table, self.learner, self.policy)
    }
}

/// A policy that acts on a table, and a learner that improves it.
pub(super) struct Pair<'a, L, P> {
    table: &'a mut QTable,
    learner: &'a mut L,
    policy: &'a mut P,
}

impl<L: Learner, P: Policy> Actor for Pair<'_, L, P> {
    fn begin_episode(&mut self) {
        self.learner.begin_episode();
        self.policy.begin_episode();
    }

    fn meet<E: Environment + ?Sized>(
        &mut self,
        environment: &E,
        state: State,
    ) -> Result<(), Error> {
        self.table.meet(environment, state)
    }

    #[inline(always)]
    fn choose(
        &mut self,
        state: State,
        before: Option<Action>,
        rng: &mut dyn Rng,
    ) -> Result<Action, Error> {
        let action = match before {
            Some(action) => action,
            None => {
                self.table.prepare(state)?;
                self.policy.choose(self.table, state, rng)
            }
        };
        self.table.check_choice(state, action).map(|()| action)
    }

    #[inline(always)]
    fn learn(
        &mut self,
        state: State,
        action: Action,
        step: Step,
        rng: &mut dyn Rng,
    ) -> Result<(f64, Option<Action>), Error> {
        let goes_on = step.status != Status::Terminated;
        let next_action = match self.learner.needs_next_action() && goes_on {
            true => Some(self.choose(step.observation, None, rng)?),
            false => None,
        };
        let experience = Experience {
            state,
            action,
            step,
            next_action,
        };
        let learned = self
            .learner
            .learn(self.table, &experience, self.policy, rng)?;
        Ok((learned, next_action))
    }
}
