//! A limit on the steps of an episode.

use std::num::NonZeroU64;

use rand::Rng;

use crate::error::{Error, positive};
use crate::problem::environment::Environment;
use crate::step::{Action, State, Status, Step};

/// An environment whose episodes are truncated after a number of steps. Training has a limit of its
/// own ([`Training::with_episode_limit`](crate::Training::with_episode_limit)).
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TimeLimit<E> {
    inner: E,
    limit: NonZeroU64,
    steps: u64,
}

impl<E: Environment> TimeLimit<E> {
    /// Limits episodes to `limit` steps, at least 1.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn new(inner: E, limit: u64) -> Result<Self, Error> {
        Ok(Self {
            inner,
            limit: positive("limit", limit)?,
            steps: 0,
        })
    }
}

impl<E: Environment> Environment for TimeLimit<E> {
    fn states(&self) -> usize {
        self.inner.states()
    }

    fn actions(&self) -> usize {
        self.inner.actions()
    }

    fn reset(&mut self, rng: &mut dyn Rng) -> Result<State, Error> {
        self.steps = 0;
        self.inner.reset(rng)
    }

    fn step(&mut self, action: Action, rng: &mut dyn Rng) -> Result<Step, Error> {
        let mut step = self.inner.step(action, rng)?;
        self.steps = self.steps.saturating_add(1);
        if step.status == Status::Continuing && self.steps >= self.limit.get() {
            step.status = Status::Truncated;
        }
        Ok(step)
    }

    fn allows(&self, state: State, action: Action) -> bool {
        self.inner.allows(state, action)
    }

    fn is_dynamic(&self) -> bool {
        self.inner.is_dynamic()
    }

    fn player(&self) -> usize {
        self.inner.player()
    }

    fn succeeded(&self, last: &Step) -> Option<bool> {
        self.inner.succeeded(last)
    }
}
