//! Known dynamics: the outcomes of every action and their probabilities.

#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::{Error, check_reward, positive};
use crate::step::{Action, State, Status, Step};
use crate::table::{ActionMask, checked_entries};
use crate::validated::validated;

/// One possible outcome of an action.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct Outcome {
    /// Probability, `0..=1`.
    pub probability: f64,
    /// State it leads to.
    pub next: State,
    /// Reward, finite.
    pub reward: f64,
    /// `true` if it ends the episode.
    pub terminated: bool,
}

impl Outcome {
    /// Creates an outcome of probability 1.
    pub fn certain(next: State, reward: f64, terminated: bool) -> Self {
        Self {
            probability: 1.0,
            next,
            reward,
            terminated,
        }
    }

    /// Returns the outcome as an environment would report it.
    pub fn step(&self) -> Step {
        let status = if self.terminated {
            Status::Terminated
        } else {
            Status::Continuing
        };
        Step {
            observation: self.next,
            reward: self.reward,
            status,
        }
    }
}

validated! {
    /// A finite Markov decision process whose probabilities are known.
    ///
    /// A state without any action is a terminal one: its value is 0, and an outcome that leads to
    /// it ends the episode.
    ///
    /// ```
    /// use qtable::{Action, Model, Outcome, State};
    ///
    /// fn main() -> Result<(), qtable::Error> {
    ///     // Two cells; action 1 goes right and ends with reward 1, action 0 stays.
    ///     let model = Model::new(2, 2, |state, action| match (state, action) {
    ///         (State(0), Action(0)) => vec![Outcome::certain(state, 0.0, false)],
    ///         (State(0), _) => vec![Outcome::certain(State(1), 1.0, true)],
    ///         _ => vec![],
    ///     })?;
    ///     let plan = model.value_iteration(0.9, 1e-12)?;
    ///     assert_eq!(plan.table.best(State(0)), Action(1));
    ///     assert!((plan.table.value(State(0), Action(0)) - 0.9).abs() < 1e-9);
    ///     Ok(())
    /// }
    /// ```
    #[derive(Clone, Debug, PartialEq)]
    pub struct Model {
        pub(super) states: usize,
        pub(super) actions: usize,
        /// Start of the outcomes of each pair, and one more for the end.
        starts: Vec<usize>,
        outcomes: Vec<Outcome>,
        pub(super) most_sweeps: u64,
        #[cfg_attr(feature = "serde", serde(skip))]
        pub(super) mask: Option<ActionMask>,
    }
}

impl Model {
    /// Creates a model by asking `outcomes` for every pair, state by state. A pair without outcomes
    /// is not offered.
    ///
    /// # Errors
    /// An empty shape or one that does not fit into memory, a next state out of range, a reward
    /// that is not finite, or probabilities that do not sum to 1 to within 1e-6.
    pub fn new(
        states: usize,
        actions: usize,
        mut outcomes: impl FnMut(State, Action) -> Vec<Outcome>,
    ) -> Result<Self, Error> {
        let entries = checked_entries(states, actions)?;
        let mut starts = Vec::new();
        starts
            .try_reserve_exact(entries + 1)
            .map_err(|_| Error::TooLarge { states, actions })?;
        starts.push(0);
        let mut all = Vec::new();
        for pair in 0..entries {
            all.extend(outcomes(State(pair / actions), Action(pair % actions)));
            starts.push(all.len());
        }
        Self {
            states,
            actions,
            starts,
            outcomes: all,
            most_sweeps: 1_000_000,
            mask: None,
        }
        .restore()
    }

    /// Sets the number of sweeps after which planning gives up, at least 1 (default 1 000 000).
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn with_most_sweeps(self, sweeps: u64) -> Result<Self, Error> {
        let most_sweeps = positive("most_sweeps", sweeps)?.get();
        Ok(Self {
            most_sweeps,
            ..self
        })
    }

    /// Returns the number of states.
    pub fn states(&self) -> usize {
        self.states
    }

    /// Returns the number of actions.
    pub fn actions(&self) -> usize {
        self.actions
    }

    /// Returns the outcomes of an action, none if the state does not offer it.
    ///
    /// # Panics
    /// If the pair is out of range.
    pub fn outcomes(&self, state: State, action: Action) -> &[Outcome] {
        let row = &self.starts[state.0.saturating_mul(self.actions)..][..=self.actions];
        &self.outcomes[row[action.0]..row[action.0 + 1]]
    }

    /// Returns `true` for a state without actions.
    pub(super) fn is_terminal(&self, state: State) -> bool {
        let first = state.0 * self.actions;
        self.starts[first] == self.starts[first + self.actions]
    }

    /// Returns the expected `r + γ value(s')` of a pair, without the second term where the episode
    /// ends.
    pub(super) fn backup(
        &self,
        state: State,
        action: Action,
        gamma: f64,
        value: impl Fn(State) -> f64,
    ) -> f64 {
        self.outcomes(state, action)
            .iter()
            .map(|outcome| {
                let next = if outcome.terminated {
                    0.0
                } else {
                    gamma * value(outcome.next)
                };
                outcome.probability * (outcome.reward + next)
            })
            .sum()
    }

    fn restore(mut self) -> Result<Self, Error> {
        let (states, actions) = (self.states, self.actions);
        let needed = checked_entries(states, actions)? + 1;
        let found = self.starts.len();
        if found != needed {
            return Err(Error::WrongLength {
                what: "the model",
                needed,
                found,
            });
        }
        let in_order = self.starts[0] == 0 && self.starts.is_sorted();
        if !in_order || self.starts[needed - 1] != self.outcomes.len() {
            return Err(Error::WrongLength {
                what: "the list of the model's outcomes",
                needed: self.starts[needed - 1],
                found: self.outcomes.len(),
            });
        }
        for pair in 0..needed - 1 {
            self.check_pair(State(pair / actions), Action(pair % actions))?;
        }
        let terminal: Vec<bool> = (0..states).map(|s| self.is_terminal(State(s))).collect();
        for outcome in &mut self.outcomes {
            outcome.terminated |= terminal[outcome.next.0];
        }
        let mask = ActionMask::new(states, actions, |state, action| {
            !self.outcomes(state, action).is_empty()
        })?;
        self.mask = mask.restricts().then_some(mask);
        positive("most_sweeps", self.most_sweeps)?;
        Ok(self)
    }

    fn check_pair(&self, state: State, action: Action) -> Result<(), Error> {
        let outcomes = self.outcomes(state, action);
        for outcome in outcomes {
            let (next, states) = (outcome.next, self.states);
            if next.0 >= states {
                let state = next;
                return Err(Error::StateOutOfRange { state, states });
            }
            check_reward(state, action, outcome.reward)?;
        }
        let sum: f64 = outcomes.iter().map(|outcome| outcome.probability).sum();
        let each_valid = outcomes
            .iter()
            .all(|outcome| (0.0..=1.0).contains(&outcome.probability));
        if outcomes.is_empty() || (each_valid && (sum - 1.0).abs() <= 1e-6) {
            Ok(())
        } else {
            Err(Error::NotADistribution { state, action, sum })
        }
    }
}
