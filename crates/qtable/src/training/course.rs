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
    /// Acts and learns, at least once, until a record is due, which is returned, or a total is
    /// reached, or `most` actions, at least 1, are done.
    ///
    /// After an error the episode is given up; the next action begins another.
    #[inline(always)]
    pub(super) fn run<E: Environment + ?Sized>(
        &mut self,
        environment: &mut E,
        actor: &mut impl Actor,
        until: Until,
        mut most: u64,
        rng: &mut dyn Rng,
    ) -> Result<Option<Record>, Error> {
        loop {
            let mut running = match self.running.take() {
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
            // Nothing but the end of the episode needs to be looked for within a stretch.
            let limit = self
                .episode_limit
                .get()
                .saturating_sub(running.steps)
                .max(1);
            let record = self
                .record_every
                .get()
                .saturating_sub(self.tally.actions)
                .max(1);
            let left = match until {
                Until::Actions(actions) => actions.saturating_sub(self.actions).max(1),
                Until::Episodes(_) => u64::MAX,
            };
            let stretch = limit.min(record).min(left).min(most);
            let mut taken = 0;
            let mut act = || -> Result<Step, Error> {
                let mut action = actor.choose(running.state, running.action.take(), rng)?;
                loop {
                    let mut step = environment.step(action, rng)?;
                    if environment.is_dynamic() {
                        actor.meet(environment, step.observation)?;
                    }
                    if step.status == Status::Continuing && taken + 1 == limit {
                        step.status = Status::Truncated;
                    }
                    let (td_error, next) = actor.learn(running.state, action, step, rng)?;
                    self.tally.add(step.reward, td_error);
                    running.state = step.observation;
                    running.sum += step.reward;
                    taken += 1;
                    if taken == stretch || step.status != Status::Continuing {
                        running.action = next;
                        return Ok(step);
                    }
                    action = match next {
                        Some(next) => next,
                        None => actor.choose(running.state, None, rng)?,
                    };
                }
            };
            let last = act();
            most -= taken;
            running.steps = running.steps.saturating_add(taken);
            self.actions = self.actions.saturating_add(taken);
            self.tally.actions = self.tally.actions.saturating_add(taken);
            if let Some(record) = self.end_stretch(environment, running, &last?) {
                return Ok(Some(record));
            }
            if most == 0 || self.has_reached(until) {
                return Ok(None);
            }
        }
    }

    /// Learns from the answer to an action of an episode. Returns a record if one is due.
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
        if step.status == Status::Continuing && steps >= self.episode_limit.get() {
            step.status = Status::Truncated;
        }
        let (td_error, action) = actor.learn(running.state, action, step, rng)?;
        self.tally.add(step.reward, td_error);
        self.actions = self.actions.saturating_add(1);
        self.tally.actions = self.tally.actions.saturating_add(1);
        let running = Running {
            state: step.observation,
            action,
            steps,
            sum: running.sum + step.reward,
        };
        Ok(self.end_stretch(environment, running, &step))
    }

    /// Keeps an episode if it goes on after its last step, and counts it otherwise. Returns a
    /// record if one is due.
    fn end_stretch<E: Environment + ?Sized>(
        &mut self,
        environment: &E,
        running: Running,
        last: &Step,
    ) -> Option<Record> {
        if last.status == Status::Continuing {
            self.running = Some(running);
        } else {
            self.episodes = self.episodes.saturating_add(1);
            let success = environment.succeeded(last);
            self.tally.add_episode(running.steps, running.sum, success);
        }
        let due = self.tally.actions >= self.record_every.get();
        due.then(|| std::mem::take(&mut self.tally).record(self.actions, self.episodes))
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
