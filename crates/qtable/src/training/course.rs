//! The training loop: one action at a time, with its counters.

use std::num::NonZeroU64;

use rand::Rng;

use crate::error::Error;
use crate::problem::Environment;
use crate::step::{Action, State, Status, Step};
use crate::training::curve::{Record, Tally};

/// The end of [`Training::run`](crate::Training::run): a total since the training began, not since
/// the call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Until {
    /// This many actions in all.
    Actions(u64),
    /// This many episodes in all.
    Episodes(u64),
}

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
    /// Acts and learns until a record is due, which is returned, or the goal is reached.
    ///
    /// After an error the episode is given up; the next action begins another.
    #[inline(always)]
    pub(super) fn run<E: Environment + ?Sized>(
        &mut self,
        environment: &mut E,
        actor: &mut impl Actor,
        mut is_reached: impl FnMut(&Self) -> bool,
        rng: &mut dyn Rng,
    ) -> Result<Option<Record>, Error> {
        let mut running = self.running.take();
        while !is_reached(self) {
            let now = match running.take() {
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
            let action = actor.choose(now.state, now.action, rng)?;
            let step = environment.step(action, rng)?;
            let record;
            (running, record) = self.learn(environment, actor, (now, action), step, rng)?;
            if record.is_some() {
                self.running = running;
                return Ok(record);
            }
        }
        self.running = running;
        Ok(None)
    }

    /// Learns from the answer to an action of an episode. Returns the episode, if it goes on, and a
    /// record, if one is due.
    #[inline(always)]
    pub(super) fn learn<E: Environment + ?Sized>(
        &mut self,
        environment: &E,
        actor: &mut impl Actor,
        (running, action): (Running, Action),
        mut step: Step,
        rng: &mut dyn Rng,
    ) -> Result<(Option<Running>, Option<Record>), Error> {
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
        let goes_on = step.status == Status::Continuing;
        let next = goes_on.then_some(Running {
            state: step.observation,
            action: next_action,
            steps,
            sum,
        });
        if !goes_on {
            self.episodes = self.episodes.saturating_add(1);
            let success = environment.succeeded(&step);
            self.tally.add_episode(steps, sum, success);
        }
        let due = self.tally.actions >= self.record_every.get();
        let record =
            due.then(|| std::mem::take(&mut self.tally).record(self.actions, self.episodes));
        Ok((next, record))
    }

    /// Returns `true` once a total is reached.
    #[inline(always)]
    pub(super) fn has_reached(&self, until: Until) -> bool {
        match until {
            Until::Actions(actions) => self.actions >= actions,
            Until::Episodes(episodes) => self.episodes >= episodes,
        }
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
