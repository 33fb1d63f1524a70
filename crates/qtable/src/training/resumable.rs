//! A training run with any learner and policy, which can stop, be saved, and go on.

use std::ops::ControlFlow;

use rand::Rng;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::learner::Learner;
use crate::policy::Policy;
use crate::problem::Environment;
use crate::table::{QTable, Value};
use crate::training::course::{Course, Pair, fit};
use crate::training::curve::Record;

/// When [`Training::run`] stops: at a total since the training began, not since the call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Until {
    /// After this many actions in all.
    Actions(u64),
    /// After this many episodes in all.
    Episodes(u64),
}

/// A training run: table, learner, policy, counters, learning curve, and the episode that is going
/// on.
///
/// Environment and generator are the caller's and are handed to every call. A run that is stopped,
/// saved together with these two, loaded and continued, ends in the same bits as one that was never
/// stopped:
///
#[cfg_attr(feature = "serde", doc = "```")]
#[cfg_attr(not(feature = "serde"), doc = "```ignore")]
/// use qtable::{EpsilonGreedy, QLambda, QTable, Schedule, Training, Until, decode, encode, toys};
/// use rand::{SeedableRng, rngs::Xoshiro256PlusPlus};
///
/// let mut lake = toys::frozen_lake(&toys::FROZEN_LAKE_4X4, false)?;
/// let learner = QLambda::new(Schedule::constant(0.1)?, 0.95)?;
/// let policy = EpsilonGreedy::new(Schedule::linear(1.0, 0.0, 10_000)?)?;
/// let mut training =
///     Training::new(&lake, QTable::new(16, 4)?, learner, policy)?.with_episode_limit(100)?;
/// let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
/// training.run(&mut lake, Until::Actions(7_001), &mut rng)?;
///
/// let saved = encode("lake-training/1", &(&training, &lake, &rng))?;
/// let (mut resumed, mut same_lake, mut same_rng) = (training.clone(), lake.clone(), rng.clone());
/// (resumed, same_lake, same_rng) = decode("lake-training/1", &saved)?;
///
/// training.run(&mut lake, Until::Actions(20_000), &mut rng)?;
/// resumed.run(&mut same_lake, Until::Actions(20_000), &mut same_rng)?;
/// assert_eq!(training, resumed);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// An environment that cannot be saved is left between episodes: run to [`Until::Episodes`] and save then
/// ([`is_in_episode`](Training::is_in_episode)).
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(Serialize, Deserialize),
    serde(bound(
        serialize = "L: Serialize, P: Serialize, V: Serialize",
        deserialize = "L: Deserialize<'de>, P: Deserialize<'de>, V: Deserialize<'de>"
    ))
)]
pub struct Training<L, P, V: Value = f64> {
    table: QTable<V>,
    learner: L,
    policy: P,
    course: Course,
    curve: Vec<Record>,
}

impl<L: Learner<V>, P: Policy<V>, V: Value> Training<L, P, V> {
    /// With a table, which may hold knowledge from before. If the environment restricts its
    /// actions, the table takes over the mask. Episodes have no limit and a record is made every
    /// 1000 actions, unless changed.
    ///
    /// # Errors
    /// [`Error::ShapeMismatch`] if table and environment differ, or a mask that leaves a state
    /// without action.
    pub fn new<E: Environment + ?Sized>(
        environment: &E,
        mut table: QTable<V>,
        learner: L,
        policy: P,
    ) -> Result<Self, Error> {
        fit(environment, &mut table)?;
        Ok(Self {
            table,
            learner,
            policy,
            course: Course::new(u64::MAX, 1000)?,
            curve: Vec::new(),
        })
    }

    /// Truncates an episode after a number of actions, at least 1. All else stays, also of a run
    /// that has begun.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn with_episode_limit(mut self, episode_limit: u64) -> Result<Self, Error> {
        self.course = self.course.with_episode_limit(episode_limit)?;
        Ok(self)
    }

    /// Makes a record whenever the actions taken are a multiple of a number, at least 1. All else
    /// stays, also of a run that has begun.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn with_record_every(mut self, actions: u64) -> Result<Self, Error> {
        self.course = self.course.with_record_every(actions)?;
        Ok(self)
    }

    /// Trains until a total is reached; at once if it is already.
    ///
    /// # Errors
    /// An environment of another shape or with a fault (state out of range, reward not finite), a
    /// policy or learner that fails. What was learned before stays; the episode is given up.
    pub fn run<E: Environment + ?Sized>(
        &mut self,
        environment: &mut E,
        until: Until,
        rng: &mut dyn Rng,
    ) -> Result<(), Error> {
        self.run_with(environment, until, rng, |_, _| ControlFlow::Continue(()))
            .map(|_| ())
    }

    /// Trains as [`run`](Training::run) does and calls `on_record` with every record and the table,
    /// for a progress bar or an early stop. Returns whether it was stopped early.
    ///
    /// ```
    /// # use std::ops::ControlFlow;
    /// # use qtable::{EpsilonGreedy, QLearning, QTable, Schedule, Training, Until, toys};
    /// # use rand::{SeedableRng, rngs::Xoshiro256PlusPlus};
    /// # let mut chain = toys::chain(5)?;
    /// # let learner = QLearning::new(Schedule::constant(0.5)?, 0.9)?;
    /// # let policy = EpsilonGreedy::new(Schedule::constant(0.5)?)?;
    /// # let mut training = Training::new(&chain, QTable::new(5, 2)?, learner, policy)?;
    /// # let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    /// let stopped = training.run_with(&mut chain, Until::Actions(1_000_000), &mut rng, |record, _table| {
    ///     match record.mean_td_error {
    ///         Some(error) if error < 1e-9 => ControlFlow::Break(()),
    ///         _ => ControlFlow::Continue(()),
    ///     }
    /// })?;
    /// assert!(stopped);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`run`](Training::run).
    pub fn run_with<E: Environment + ?Sized>(
        &mut self,
        environment: &mut E,
        until: Until,
        rng: &mut dyn Rng,
        mut on_record: impl FnMut(&Record, &QTable<V>) -> ControlFlow<()>,
    ) -> Result<bool, Error> {
        while let Some(record) = self.next_record(environment, until, rng)? {
            if on_record(&record, &self.table).is_break() {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Trains as [`run`](Training::run) does, one record of the learning curve at a time. Ends
    /// after the first error.
    pub fn records<'a, E: Environment + ?Sized>(
        &'a mut self,
        environment: &'a mut E,
        until: Until,
        rng: &'a mut dyn Rng,
    ) -> impl Iterator<Item = Result<Record, Error>> + 'a {
        let mut failed = false;
        std::iter::from_fn(move || {
            if failed {
                return None;
            }
            let next = self.next_record(environment, until, rng).transpose();
            failed = matches!(next, Some(Err(_)));
            next
        })
    }

    /// The table.
    pub fn table(&self) -> &QTable<V> {
        &self.table
    }

    /// The learner.
    pub fn learner(&self) -> &L {
        &self.learner
    }

    /// The policy.
    pub fn policy(&self) -> &P {
        &self.policy
    }

    /// The learning curve so far, oldest record first.
    pub fn curve(&self) -> &[Record] {
        &self.curve
    }

    /// Actions taken so far.
    pub fn actions(&self) -> u64 {
        self.course.actions
    }

    /// Episodes ended so far.
    pub fn episodes(&self) -> u64 {
        self.course.episodes
    }

    /// Whether an episode is going on, so that the environment's own state belongs to the state of
    /// the run.
    pub fn is_in_episode(&self) -> bool {
        self.course.is_in_episode()
    }

    /// The table alone.
    pub fn into_table(self) -> QTable<V> {
        self.table
    }

    /// Trains to the next record, or to the total, whichever is first.
    fn next_record<E: Environment + ?Sized>(
        &mut self,
        environment: &mut E,
        until: Until,
        rng: &mut dyn Rng,
    ) -> Result<Option<Record>, Error> {
        self.table.check_shape(
            "the environment",
            environment.states(),
            environment.actions(),
        )?;
        loop {
            let reached = match until {
                Until::Actions(actions) => self.course.actions >= actions,
                Until::Episodes(episodes) => self.course.episodes >= episodes,
            };
            if reached {
                return Ok(None);
            }
            let Self {
                table,
                learner,
                policy,
                course,
                curve,
            } = self;
            if let Some(record) = course.step(
                environment,
                &mut Pair {
                    table,
                    learner,
                    policy,
                },
                rng,
            )? {
                curve.push(record);
                return Ok(Some(record));
            }
        }
    }
}
