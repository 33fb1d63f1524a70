//! A limit on the steps of an episode.

use rand::Rng;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::{Error, check_count};
use crate::index::{Action, State};
use crate::problem::environment::{Environment, Status, Step};
use crate::validated::validated;

/// An environment whose episodes are truncated after a number of steps.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(Serialize, Deserialize),
    serde(
        remote = "Self",
        bound(serialize = "E: Serialize", deserialize = "E: Deserialize<'de>")
    )
)]
pub struct TimeLimit<E: Environment> {
    inner: E,
    limit: u64,
    steps: u64,
}

impl<E: Environment> TimeLimit<E> {
    /// With at most `limit` steps to an episode, at least 1.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn new(inner: E, limit: u64) -> Result<Self, Error> {
        Self {
            inner,
            limit,
            steps: 0,
        }
        .restore()
    }

    /// The environment inside.
    pub fn inner(&self) -> &E {
        &self.inner
    }

    /// The environment alone.
    pub fn into_inner(self) -> E {
        self.inner
    }

    fn restore(self) -> Result<Self, Error> {
        check_count("limit", self.limit)?;
        Ok(self)
    }
}

validated!(TimeLimit<E: Environment>);

impl<E: Environment> Environment for TimeLimit<E> {
    fn states(&self) -> usize {
        self.inner.states()
    }

    fn actions(&self) -> usize {
        self.inner.actions()
    }

    fn reset(&mut self, rng: &mut dyn Rng) -> State {
        self.steps = 0;
        self.inner.reset(rng)
    }

    fn step(&mut self, action: Action, rng: &mut dyn Rng) -> Step {
        let mut step = self.inner.step(action, rng);
        self.steps = self.steps.saturating_add(1);
        if step.status == Status::Continuing && self.steps >= self.limit {
            step.status = Status::Truncated;
        }
        step
    }

    fn allows(&self, state: State, action: Action) -> bool {
        self.inner.allows(state, action)
    }

    fn succeeded(&self, last: &Step) -> bool {
        self.inner.succeeded(last)
    }
}
