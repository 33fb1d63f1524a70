//! A model learned from experience.

use rand::{Rng, RngExt};
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::{Error, check_reward};
use crate::model::dynamics::{Model, Outcome};
use crate::step::{Action, State, Status, Step};
use crate::table::{QTable, checked_entries};
use crate::validated::validated;

validated! {
    /// The maximum-likelihood model of an environment: how often each action led to which outcome.
    #[derive(Clone, Debug, PartialEq)]
    pub struct ModelEstimate {
        actions: usize,
        /// Outcomes seen of each pair.
        seen: Vec<Vec<Seen>>,
        /// Pairs with an outcome, in the order of their first trial.
        tried: Vec<usize>,
        /// Pairs that led to each state without ending the episode, ascending.
        #[cfg_attr(feature = "serde", serde(skip))]
        sources: Vec<Vec<usize>>,
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
struct Seen {
    next: State,
    terminated: bool,
    count: u32,
    mean_reward: f64,
}

impl ModelEstimate {
    /// Creates a model that has seen nothing.
    ///
    /// # Errors
    /// An empty shape, or one that does not fit into memory.
    pub fn new(states: usize, actions: usize) -> Result<Self, Error> {
        let entries = checked_entries(states, actions)?;
        let too_large = |_| Error::TooLarge { states, actions };
        let (mut seen, mut sources) = (Vec::new(), Vec::new());
        seen.try_reserve_exact(entries).map_err(too_large)?;
        sources.try_reserve_exact(states).map_err(too_large)?;
        seen.resize_with(entries, Vec::new);
        sources.resize_with(states, Vec::new);
        Ok(Self {
            actions,
            seen,
            tried: Vec::new(),
            sources,
        })
    }

    /// Counts a step, also a truncated one: it tells where the action leads.
    ///
    /// # Errors
    /// A state or action out of range, or a reward that is not finite.
    pub fn observe(&mut self, state: State, action: Action, step: &Step) -> Result<(), Error> {
        let states = self.states();
        if let Some(state) = [state, step.observation]
            .into_iter()
            .find(|state| state.0 >= states)
        {
            return Err(Error::StateOutOfRange { state, states });
        }
        let actions = self.actions;
        if action.0 >= actions {
            return Err(Error::ActionOutOfRange { action, actions });
        }
        check_reward(state, action, step.reward)?;
        let pair = state.0 * self.actions + action.0;
        let terminated = step.status == Status::Terminated;
        let outcomes = &mut self.seen[pair];
        if outcomes.is_empty() {
            self.tried.push(pair);
        }
        let same =
            |seen: &&mut Seen| seen.next == step.observation && seen.terminated == terminated;
        if let Some(seen) = outcomes.iter_mut().find(same) {
            seen.count = seen.count.saturating_add(1);
            // Halved, so that no difference of finite rewards overflows.
            let half = step.reward / 2.0 - seen.mean_reward / 2.0;
            seen.mean_reward += half / f64::from(seen.count) * 2.0;
        } else {
            outcomes.push(Seen {
                next: step.observation,
                terminated,
                count: 1,
                mean_reward: step.reward,
            });
            if !terminated {
                note_source(&mut self.sources[step.observation.0], pair);
            }
        }
        Ok(())
    }

    /// Keeps a step as the only outcome of its pair, for worlds that change.
    pub(crate) fn replace(
        &mut self,
        state: State,
        action: Action,
        step: &Step,
    ) -> Result<(), Error> {
        check_reward(state, action, step.reward)?;
        let trials = self.trials(state, action).saturating_add(1);
        let pair = state.0 * self.actions + action.0;
        for seen in std::mem::take(&mut self.seen[pair]) {
            self.sources[seen.next.0].retain(|&source| source != pair);
        }
        let next = step.observation;
        let terminated = step.status == Status::Terminated;
        if trials == 1 {
            self.tried.push(pair);
        }
        self.seen[pair].push(Seen {
            next,
            terminated,
            count: u32::try_from(trials).unwrap_or(u32::MAX),
            mean_reward: step.reward,
        });
        if !terminated {
            note_source(&mut self.sources[next.0], pair);
        }
        Ok(())
    }

    /// Returns the number of states.
    pub fn states(&self) -> usize {
        self.sources.len()
    }

    /// Returns the number of actions.
    pub fn actions(&self) -> usize {
        self.actions
    }

    /// Returns how often a pair was tried; 0 also for a pair out of range.
    pub(crate) fn trials(&self, state: State, action: Action) -> u64 {
        self.outcomes(state, action)
            .iter()
            .map(|seen| u64::from(seen.count))
            .sum()
    }

    /// Returns the model as far as it is known. A pair never tried is taken to end the episode with
    /// the reward `untried`: a high one makes a planner curious (the R-max of Brafman and
    /// Tennenholtz 2002), a low one careful.
    ///
    /// # Errors
    /// [`Error::RewardNotFinite`] for an `untried` that is not finite.
    pub fn to_model(&self, untried: f64) -> Result<Model, Error> {
        Model::new(self.states(), self.actions, |state, action| {
            let trials = self.trials(state, action) as f64;
            if self.outcomes(state, action).is_empty() {
                return vec![Outcome::certain(state, untried, true)];
            }
            let outcome = |seen: &Seen| Outcome {
                probability: f64::from(seen.count) / trials,
                next: seen.next,
                reward: seen.mean_reward,
                terminated: seen.terminated,
            };
            self.outcomes(state, action).iter().map(outcome).collect()
        })
    }

    fn outcomes(&self, state: State, action: Action) -> &[Seen] {
        if state.0 >= self.states() || action.0 >= self.actions {
            return &[];
        }
        &self.seen[state.0 * self.actions + action.0]
    }

    pub(crate) fn pair(&self, index: usize) -> (State, Action) {
        (State(index / self.actions), Action(index % self.actions))
    }

    /// Draws a pair tried before, each with the same probability, and one of its outcomes by the
    /// counts.
    pub(crate) fn draw(&self, rng: &mut dyn Rng) -> Option<(State, Action, Step)> {
        if self.tried.is_empty() {
            return None;
        }
        let (state, action) = self.pair(self.tried[rng.random_range(0..self.tried.len())]);
        let step = self.draw_outcome(state, action, rng)?;
        Some((state, action, step))
    }

    /// Draws one of the outcomes of a pair by their counts; `None` for a pair never tried.
    pub(crate) fn draw_outcome(
        &self,
        state: State,
        action: Action,
        rng: &mut dyn Rng,
    ) -> Option<Step> {
        let outcomes = self.outcomes(state, action);
        let mut rest = match outcomes.len() {
            0 | 1 => 0,
            _ => rng.random_range(0..self.trials(state, action)),
        };
        let drawn = outcomes.iter().find(|seen| {
            let here = rest < u64::from(seen.count);
            rest = rest.saturating_sub(u64::from(seen.count));
            here
        })?;
        let status = if drawn.terminated {
            Status::Terminated
        } else {
            Status::Continuing
        };
        Some(Step {
            observation: drawn.next,
            reward: drawn.mean_reward,
            status,
        })
    }

    /// Returns the expected `r + γ value(s')` of a pair, or `None` if it was never tried.
    pub(crate) fn backup(
        &self,
        state: State,
        action: Action,
        gamma: f64,
        value: impl Fn(State) -> f64,
    ) -> Option<f64> {
        let outcomes = self.outcomes(state, action);
        let trials = self.trials(state, action) as f64;
        let outcome = |seen: &Seen| {
            let next = if seen.terminated {
                0.0
            } else {
                gamma * value(seen.next)
            };
            f64::from(seen.count) / trials * (seen.mean_reward + next)
        };
        (!outcomes.is_empty()).then(|| outcomes.iter().map(outcome).sum())
    }

    /// Returns the indices of the pairs that have led to a state without ending the episode.
    pub(crate) fn predecessors(&self, state: State) -> &[usize] {
        &self.sources[state.0]
    }

    /// Refuses a table of another shape, or one that has fewer visits of the pair tried first than
    /// this model: knowledge of one table must not leak into another.
    pub(crate) fn check_table(&self, table: &QTable) -> Result<(), Error> {
        table.check_shape("the learner's model", self.states(), self.actions)?;
        let Some(&first) = self.tried.first() else {
            return Ok(());
        };
        let (state, action) = self.pair(first);
        if u64::from(table.visits(state, action)) >= self.trials(state, action) {
            return Ok(());
        }
        Err(Error::OtherTable { state, action })
    }

    #[cfg(feature = "serde")]
    fn restore(mut self) -> Result<Self, Error> {
        let actions = self.actions;
        let states = self.seen.len() / actions.max(1);
        let needed = checked_entries(states, actions)?;
        if needed != self.seen.len() {
            return Err(Error::WrongLength {
                what: "the model estimate",
                needed,
                found: self.seen.len(),
            });
        }
        let mut listed = self.tried.clone();
        listed.sort_unstable();
        let tried: Vec<usize> = (0..needed)
            .filter(|&pair| !self.seen[pair].is_empty())
            .collect();
        if listed != tried {
            let (what, needed, found) = ("the list of tried pairs", tried.len(), listed.len());
            return Err(Error::WrongLength {
                what,
                needed,
                found,
            });
        }
        self.sources = vec![Vec::new(); states];
        for &index in &tried {
            let (state, action) = self.pair(index);
            for seen in &self.seen[index] {
                if seen.next.0 >= states {
                    return Err(Error::StateOutOfRange {
                        state: seen.next,
                        states,
                    });
                }
                check_reward(state, action, seen.mean_reward)?;
                if seen.count == 0 {
                    return Err(Error::NotADistribution {
                        state,
                        action,
                        sum: 0.0,
                    });
                }
                if !seen.terminated {
                    note_source(&mut self.sources[seen.next.0], index);
                }
            }
        }
        Ok(self)
    }
}

/// Keeps the list sorted, so that it does not depend on the order in which pairs were met.
fn note_source(sources: &mut Vec<usize>, pair: usize) {
    if let Err(place) = sources.binary_search(&pair) {
        sources.insert(place, pair);
    }
}
