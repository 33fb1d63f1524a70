//! Where a run is: the one loop that every driver turns.

use rand::Rng;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::{Error, check_count};
use crate::index::{Action, State};
use crate::learner::{Experience, Learner};
use crate::policy::Policy;
use crate::problem::{Environment, Status, Step};
use crate::table::{ActionMask, QTable, Value};
use crate::training::curve::{Record, Tally};
use crate::validated::validated;

/// Counters of a run, which stop at their largest number, the episode that is going on, and what
/// has not yet been recorded.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(Serialize, Deserialize),
    serde(remote = "Self")
)]
pub(crate) struct Course {
    pub(crate) episode_limit: u64,
    pub(crate) record_every: u64,
    pub(crate) actions: u64,
    pub(crate) episodes: u64,
    running: Option<Running>,
    tally: Tally,
}

/// An episode that is going on.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
struct Running {
    state: State,
    /// The action that was chosen already, for an on-policy learner.
    action: Option<Action>,
    steps: u64,
    sum: f64,
}

impl Course {
    pub(crate) fn new(episode_limit: u64, record_every: u64) -> Result<Self, Error> {
        let tally = Tally::default();
        Self {
            episode_limit,
            record_every,
            actions: 0,
            episodes: 0,
            running: None,
            tally,
        }
        .restore()
    }

    /// The same course with another limit.
    pub(crate) fn with_episode_limit(self, episode_limit: u64) -> Result<Self, Error> {
        Self {
            episode_limit,
            ..self
        }
        .restore()
    }

    /// The same course with records further apart or closer together.
    pub(crate) fn with_record_every(self, record_every: u64) -> Result<Self, Error> {
        Self {
            record_every,
            ..self
        }
        .restore()
    }

    fn restore(self) -> Result<Self, Error> {
        check_count("episode_limit", self.episode_limit)?;
        check_count("record_every", self.record_every)?;
        Ok(self)
    }

    /// Whether an episode is going on.
    pub(crate) fn is_in_episode(&self) -> bool {
        self.running.is_some()
    }

    /// Takes one action and learns from it. Returns a record if one is due.
    ///
    /// After an error the episode is given up; the next action begins another.
    #[inline]
    pub(crate) fn step<E: Environment + ?Sized>(
        &mut self,
        environment: &mut E,
        actor: &mut impl Actor,
        rng: &mut dyn Rng,
    ) -> Result<Option<Record>, Error> {
        let Running {
            state,
            action,
            steps,
            sum,
        } = match self.running.take() {
            Some(running) => running,
            None => {
                actor.begin_episode();
                Running {
                    state: environment.reset(rng),
                    action: None,
                    steps: 0,
                    sum: 0.0,
                }
            }
        };
        let action = actor.choose(state, action, rng)?;
        let mut step = environment.step(action, rng);
        let (steps, sum) = (steps.saturating_add(1), sum + step.reward);
        if step.status == Status::Continuing && steps >= self.episode_limit {
            step.status = Status::Truncated;
        }
        let (td_error, next_action) = actor.learn(state, action, step, rng)?;

        self.actions = self.actions.saturating_add(1);
        self.tally.add_action(step.reward, td_error);
        if step.status == Status::Continuing {
            self.running = Some(Running {
                state: step.observation,
                action: next_action,
                steps,
                sum,
            });
        } else {
            self.episodes = self.episodes.saturating_add(1);
            self.tally
                .add_episode(steps, sum, environment.succeeded(&step));
        }
        Ok(self
            .actions
            .is_multiple_of(self.record_every)
            .then(|| self.record()))
    }

    /// Closes a record with what has happened since the last one.
    pub(crate) fn record(&mut self) -> Record {
        std::mem::take(&mut self.tally).record(self.actions, self.episodes)
    }
}

validated!(Course);

/// Whoever acts and learns in a run.
pub(crate) trait Actor {
    fn begin_episode(&mut self) {}

    /// An offered action for a state that may be out of range: the one chosen before, which may
    /// come from a file and is checked, or a new one.
    fn choose(
        &mut self,
        state: State,
        before: Option<Action>,
        rng: &mut dyn Rng,
    ) -> Result<Action, Error>;

    /// Learns from a step whose state and reward may be anything. Returns the error before the
    /// update, and the next action if that was chosen already.
    fn learn(
        &mut self,
        state: State,
        action: Action,
        step: Step,
        rng: &mut dyn Rng,
    ) -> Result<(f64, Option<Action>), Error>;
}

/// A policy that acts on a table, and a learner that improves it.
pub(crate) struct Pair<'a, V: Value, L, P> {
    pub(crate) table: &'a mut QTable<V>,
    pub(crate) learner: &'a mut L,
    pub(crate) policy: &'a mut P,
}

impl<V: Value, L: Learner<V>, P: Policy<V>> Actor for Pair<'_, V, L, P> {
    fn begin_episode(&mut self) {
        self.learner.begin_episode();
    }

    #[inline]
    fn choose(
        &mut self,
        state: State,
        before: Option<Action>,
        rng: &mut dyn Rng,
    ) -> Result<Action, Error> {
        self.table.check_state(state)?;
        let action = match before {
            Some(action) => action,
            None => self.policy.choose(self.table, state, rng),
        };
        self.table.check(state, action).map(|()| action)
    }

    #[inline]
    fn learn(
        &mut self,
        state: State,
        action: Action,
        step: Step,
        rng: &mut dyn Rng,
    ) -> Result<(f64, Option<Action>), Error> {
        let goes_on = step.status != Status::Terminated;
        let next_action = match self.learner.on_policy() && goes_on {
            true => Some(self.choose(step.observation, None, rng)?),
            false => None,
        };
        let experience = Experience {
            state,
            action,
            step,
            next_action,
        };
        Ok((
            self.learner
                .learn(self.table, &experience, self.policy, rng)?,
            next_action,
        ))
    }
}

/// Checks that a table fits an environment, and has it take over the environment's mask if there is
/// one.
pub(crate) fn fit<V: Value, E: Environment + ?Sized>(
    environment: &E,
    table: &mut QTable<V>,
) -> Result<(), Error> {
    table.check_shape(
        "the environment",
        environment.states(),
        environment.actions(),
    )?;
    if let Some(mask) = ActionMask::of(environment)? {
        table.set_mask(Some(mask))?;
    }
    Ok(())
}
