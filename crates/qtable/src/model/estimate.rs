//! A model learned from experience.

use rand::{Rng, RngExt};

use crate::error::{Error, check_finite, check_index};
use crate::model::dynamics::{Model, Outcome, expected};
use crate::step::{Action, State, Status, Step};
use crate::table::{QTable, checked_entries};
use crate::validated::validated;

validated! {
    /// The maximum-likelihood model of an environment: how often each action led to which outcome.
    ///
    /// ```
    /// use qtable::{Action, ModelEstimate, State, Status, Step};
    ///
    /// fn main() -> Result<(), qtable::Error> {
    ///     let mut estimate = ModelEstimate::new(2, 1)?;
    ///     for reward in [1.0, 3.0] {
    ///         let step = Step { observation: State(1), reward, status: Status::Terminated };
    ///         estimate.observe(State(0), Action(0), &step)?;
    ///     }
    ///     let plan = estimate.to_model(0.0)?.value_iteration(0.9, 1e-9)?;
    ///     assert_eq!(plan.table.max(State(0)), 2.0);
    ///     Ok(())
    /// }
    /// ```
    #[derive(Clone, Debug, PartialEq)]
    pub struct ModelEstimate {
        actions: usize,
        /// Outcomes seen of each pair, with their counts in the place of probabilities and their
        /// mean rewards.
        seen: Vec<Vec<Outcome>>,
        /// Pairs with an outcome, in the order of their first trial.
        tried: Vec<usize>,
        /// Pairs that led to each state without ending the episode, ascending.
        #[cfg_attr(feature = "serde", serde(skip))]
        sources: Vec<Vec<usize>>,
    }
}

impl ModelEstimate {
    /// Creates a model that has seen nothing.
    ///
    /// # Errors
    /// An empty shape, or one that does not fit into memory.
    pub fn new(states: usize, actions: usize) -> Result<Self, Error> {
        let mut model = Self {
            actions,
            seen: Vec::new(),
            tried: Vec::new(),
            sources: Vec::new(),
        };
        model.grow(states)?;
        Ok(model)
    }

    /// Adds states until there are `states`.
    fn grow(&mut self, states: usize) -> Result<(), Error> {
        let entries = checked_entries(states, self.actions)?;
        let too_large = |_| Error::too_large(states, self.actions);
        let new = entries.saturating_sub(self.seen.len());
        self.seen.try_reserve(new).map_err(too_large)?;
        self.sources
            .try_reserve(new / self.actions)
            .map_err(too_large)?;
        self.seen.resize_with(entries, Vec::new);
        self.sources.resize_with(states, Vec::new);
        Ok(())
    }

    /// Counts a step, also a truncated one: it tells where the action leads.
    ///
    /// # Errors
    /// A state or action out of range, or a reward that is not finite.
    pub fn observe(&mut self, state: State, action: Action, step: &Step) -> Result<(), Error> {
        self.note(state, action, step, false)
    }

    /// Counts a step; with `last_only` it replaces all outcomes of its pair.
    pub(crate) fn note(
        &mut self,
        state: State,
        action: Action,
        step: &Step,
        last_only: bool,
    ) -> Result<(), Error> {
        check_index("state", state.0, self.states())?;
        check_index("state", step.observation.0, self.states())?;
        check_index("action", action.0, self.actions)?;
        check_finite("reward", state, action, step.reward)?;
        let trials = self.trials(state, action);
        let pair = state.0 * self.actions + action.0;
        if self.seen[pair].is_empty() {
            self.tried.push(pair);
        }
        if last_only {
            for old in std::mem::take(&mut self.seen[pair]) {
                self.sources[old.next.0].retain(|&source| source != pair);
            }
        }
        let (next, terminated) = (step.observation, step.status == Status::Terminated);
        let same = |seen: &&mut Outcome| seen.next == next && seen.terminated == terminated;
        if let Some(seen) = self.seen[pair].iter_mut().find(same) {
            seen.probability += 1.0;
            // Halved, so that no difference of finite rewards overflows.
            let half = step.reward / 2.0 - seen.reward / 2.0;
            seen.reward += half / seen.probability * 2.0;
            return Ok(());
        }
        self.seen[pair].push(Outcome {
            probability: if last_only { trials + 1.0 } else { 1.0 },
            next,
            reward: step.reward,
            terminated,
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

    /// Returns the model as far as it is known. A pair never tried is taken to end the episode with
    /// the reward `untried`: a high one makes a planner curious (the R-max of Brafman and
    /// Tennenholtz 2002), a low one careful.
    ///
    /// # Errors
    /// [`Error::NotFinite`] for an `untried` that is not finite.
    pub fn to_model(&self, untried: f64) -> Result<Model, Error> {
        Model::new(self.states(), self.actions, |state, action| {
            let trials = self.trials(state, action);
            let known = self.outcomes(state, action).iter().map(|seen| Outcome {
                probability: seen.probability / trials,
                ..*seen
            });
            let mut outcomes: Vec<Outcome> = known.collect();
            if outcomes.is_empty() {
                outcomes.push(Outcome::certain(state, untried, true));
            }
            outcomes
        })
    }

    /// Returns how often a pair was tried.
    fn trials(&self, state: State, action: Action) -> f64 {
        let outcomes = self.outcomes(state, action).iter();
        outcomes.map(|seen| seen.probability).sum()
    }

    fn outcomes(&self, state: State, action: Action) -> &[Outcome] {
        &self.seen[state.0 * self.actions + action.0]
    }

    /// Returns the pair of an index.
    pub(crate) fn pair(&self, index: usize) -> (State, Action) {
        (State(index / self.actions), Action(index % self.actions))
    }

    /// Draws a pair tried before, each with the same probability, and one of its outcomes.
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
            _ => rng.random_range(0..self.trials(state, action) as u64),
        };
        let drawn = outcomes.iter().find(|seen| {
            let count = seen.probability as u64;
            let here = rest < count;
            rest = rest.saturating_sub(count);
            here
        });
        drawn.map(Outcome::step)
    }

    /// Returns the expected `r + γ value(s')` of a pair, or `None` if it was never tried.
    pub(crate) fn backup(
        &self,
        state: State,
        action: Action,
        gamma: f64,
        value: impl Fn(State) -> f64,
    ) -> Option<f64> {
        let (outcomes, trials) = (self.outcomes(state, action), self.trials(state, action));
        (!outcomes.is_empty()).then(|| expected(outcomes, trials, gamma, value))
    }

    /// Returns the indices of the pairs that have led to a state without ending the episode.
    pub(crate) fn predecessors(&self, state: State) -> &[usize] {
        &self.sources[state.0]
    }

    /// Grows with its table. Refuses a table of another shape, or one that has fewer visits of the
    /// pair tried first than this model: knowledge of one table must not leak into another.
    pub(crate) fn follow(&mut self, table: &QTable) -> Result<(), Error> {
        if table.states() > self.states() {
            self.grow(table.states())?;
        }
        table.check_shape("the learner's model", (self.states(), self.actions))?;
        let Some(&first) = self.tried.first() else {
            return Ok(());
        };
        let (state, action) = self.pair(first);
        if f64::from(table.visits(state, action)) >= self.trials(state, action) {
            return Ok(());
        }
        Err(Error::OtherTable(state, action))
    }

    #[cfg(feature = "serde")]
    fn restore(mut self) -> Result<Self, Error> {
        use crate::error::check_length;
        let states = self.seen.len() / self.actions.max(1);
        let needed = checked_entries(states, self.actions)?;
        check_length("the model estimate", needed, self.seen.len())?;
        let mut listed = self.tried.clone();
        listed.sort_unstable();
        let is_tried = |pair: &usize| !self.seen[*pair].is_empty();
        let tried: Vec<usize> = (0..needed).filter(is_tried).collect();
        if listed != tried {
            // Of equal lengths, a pair is there twice and another one missing.
            let found = listed.len() - usize::from(listed.len() == tried.len());
            check_length("the list of tried pairs", tried.len(), found)?;
        }
        self.sources = vec![Vec::new(); states];
        for &index in &tried {
            let (state, action) = self.pair(index);
            for seen in &self.seen[index] {
                check_index("state", seen.next.0, states)?;
                check_finite("reward", state, action, seen.reward)?;
                let count = seen.probability;
                if !(count >= 1.0 && count <= u64::MAX as f64 && count.fract() == 0.0) {
                    let sum = count;
                    return Err(Error::NotADistribution(state, action, sum));
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
