//! The training loop: one action at a time, with its counters.

use std::num::NonZeroU64;

use rand::Rng;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::{Error, positive};
use crate::problem::Environment;
use crate::step::{Action, State, Status, Step};
use crate::training::curve::{Record, Tally};

/// Counters of a run, which stop at their largest number, the episode that is going on, and what
/// has not yet been recorded.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub(crate) struct Course {
    episode_limit: NonZeroU64,
    record_every: NonZeroU64,
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
    /// The action that was chosen already, for a learner that needs it.
    action: Option<Action>,
    steps: u64,
    sum: f64,
}

impl Course {
    pub(crate) fn new() -> Result<Self, Error> {
        Ok(Self {
            episode_limit: NonZeroU64::MAX,
            record_every: positive("record_every", 1000)?,
            actions: 0,
            episodes: 0,
            running: None,
            tally: Tally::default(),
        })
    }

    pub(crate) fn limit_episodes(&mut self, actions: u64) -> Result<(), Error> {
        self.episode_limit = positive("episode_limit", actions)?;
        Ok(())
    }

    pub(crate) fn record_every(&mut self, actions: u64) -> Result<(), Error> {
        self.record_every = positive("record_every", actions)?;
        Ok(())
    }

    pub(crate) fn is_in_episode(&self) -> bool {
        self.running.is_some()
    }

    pub(crate) fn end_episode(&mut self) {
        self.running = None;
    }

    /// Returns the number of actions since the last record, and the number from record to record.
    pub(crate) fn place(&self) -> (u64, u64) {
        (self.tally.actions(), self.record_every.get())
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
                    state: environment.reset(rng)?,
                    action: None,
                    steps: 0,
                    sum: 0.0,
                }
            }
        };
        let action = actor.choose(state, action, rng)?;
        let mut step = environment.step(action, rng)?;
        let (steps, sum) = (steps.saturating_add(1), sum + step.reward);
        if step.status == Status::Continuing && steps >= self.episode_limit.get() {
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
        let due = self.tally.actions() >= self.record_every.get();
        Ok(due.then(|| std::mem::take(&mut self.tally).record(self.actions, self.episodes)))
    }
}

/// The part of a run that acts and learns.
pub(crate) trait Actor {
    fn begin_episode(&mut self);

    /// Returns an offered action for a state that may be out of range: the one chosen before, which
    /// may come from a file and is checked, or a new one.
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
