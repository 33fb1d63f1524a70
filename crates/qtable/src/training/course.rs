//! The training loop: one action at a time, with its counters.

use std::num::NonZeroU64;

use rand::Rng;

use crate::error::Error;
use crate::problem::Environment;
use crate::step::{Action, State, Status, Step};
use crate::training::curve::{Record, Tally};

/// Counters of a run, which stop at their largest number, the episode that is going on, and what
/// has not yet been recorded.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Course {
    pub(super) episode_limit: NonZeroU64,
    pub(super) record_every: NonZeroU64,
    pub(super) actions: u64,
    pub(super) episodes: u64,
    pub(super) running: Option<Running>,
    pub(super) tally: Tally,
}

/// An episode that is going on.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Running {
    pub(super) state: State,
    /// The action that was chosen already, for a learner that needs it.
    pub(super) action: Option<Action>,
    steps: u64,
    sum: f64,
}

impl Running {
    /// Returns an episode that begins in a state.
    pub(super) fn at(state: State) -> Self {
        Self {
            state,
            action: None,
            steps: 0,
            sum: 0.0,
        }
    }
}

impl Course {
    /// Takes one action and learns from it. Returns a record if one is due.
    ///
    /// After an error the episode is given up; the next action begins another.
    #[inline]
    pub(super) fn step<E: Environment + ?Sized>(
        &mut self,
        environment: &mut E,
        actor: &mut impl Actor,
        rng: &mut dyn Rng,
    ) -> Result<Option<Record>, Error> {
        let running = match self.running.take() {
            Some(running) => running,
            None => {
                actor.begin_episode();
                let state = environment.reset(rng)?;
                if environment.is_dynamic() {
                    actor.meet(environment, state)?;
                }
                Running::at(state)
            }
        };
        let action = actor.choose(running.state, running.action, rng)?;
        let step = environment.step(action, rng)?;
        self.learn(environment, actor, (running, action), step, rng)
    }

    /// Learns from the answer to an action of an episode. Returns a record if one is due.
    #[inline(always)]
    pub(super) fn learn<E: Environment + ?Sized>(
        &mut self,
        environment: &E,
        actor: &mut impl Actor,
        (running, action): (Running, Action),
        mut step: Step,
        rng: &mut dyn Rng,
    ) -> Result<Option<Record>, Error> {
        if environment.is_dynamic() {
            actor.meet(environment, step.observation)?;
        }
        let steps = running.steps.saturating_add(1);
        let sum = running.sum + step.reward;
        if step.status == Status::Continuing && steps >= self.episode_limit.get() {
            step.status = Status::Truncated;
        }
        let (td_error, next_action) = actor.learn(running.state, action, step, rng)?;

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
            let success = environment.succeeded(&step);
            self.tally.add_episode(steps, sum, success);
        }
        let due = self.tally.actions >= self.record_every.get();
        Ok(due.then(|| std::mem::take(&mut self.tally).record(self.actions, self.episodes)))
    }
}

/// The part of a run that acts and learns.
pub(super) trait Actor {
    fn begin_episode(&mut self);

    /// Notices a state of a dynamic environment.
    fn meet<E: Environment + ?Sized>(&mut self, environment: &E, state: State)
    -> Result<(), Error>;

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
