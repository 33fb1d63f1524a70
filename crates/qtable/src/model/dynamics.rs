//! Known dynamics: the outcomes of every action and their probabilities.

use crate::error::{Error, check_finite, check_index, check_length, positive};
use crate::step::{Action, State, Status, Step};
use crate::table::checked_entries;
use crate::validated::validated;

/// One possible outcome of an action.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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
        let status = match self.terminated {
            true => Status::Terminated,
            false => Status::Continuing,
        };
        Step::new(self.next, self.reward, status)
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
        /// Index of the first outcome of each pair, and at the end the number of all outcomes.
        starts: Vec<usize>,
        outcomes: Vec<Outcome>,
        pub(super) most_sweeps: u64,
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
        let reserved = starts.try_reserve_exact(entries + 1);
        reserved.map_err(|_| Error::too_large(states, actions))?;
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
        expected(self.outcomes(state, action), 1.0, gamma, value)
    }

    fn restore(mut self) -> Result<Self, Error> {
        let (states, actions) = (self.states, self.actions);
        let pairs = checked_entries(states, actions)?;
        check_length("the model", pairs + 1, self.starts.len())?;
        let in_order = self.starts[0] == 0 && self.starts.is_sorted();
        let needed = if in_order {
            self.starts[pairs]
        } else {
            usize::MAX
        };
        check_length(
            "the list of the model's outcomes",
            needed,
            self.outcomes.len(),
        )?;
        for pair in 0..pairs {
            self.check_pair(State(pair / actions), Action(pair % actions))?;
        }
        let terminal: Vec<bool> = (0..states).map(|s| self.is_terminal(State(s))).collect();
        for outcome in &mut self.outcomes {
            outcome.terminated |= terminal[outcome.next.0];
        }
        positive("most_sweeps", self.most_sweeps)?;
        Ok(self)
    }

    fn check_pair(&self, state: State, action: Action) -> Result<(), Error> {
        let outcomes = self.outcomes(state, action);
        let mut valid = true;
        for outcome in outcomes {
            check_index("state", outcome.next.0, self.states)?;
            check_finite("reward", state, action, outcome.reward)?;
            valid &= outcome.probability >= 0.0;
        }
        let sum: f64 = outcomes.iter().map(|outcome| outcome.probability).sum();
        if outcomes.is_empty() || (valid && (sum - 1.0).abs() <= 1e-6) {
            return Ok(());
        }
        Err(Error::NotADistribution(state, action, sum))
    }
}

/// Returns the expected `r + γ value(s')` over outcomes whose probabilities sum to `whole`.
#[inline(always)]
pub(super) fn expected(
    outcomes: &[Outcome],
    whole: f64,
    gamma: f64,
    value: impl Fn(State) -> f64,
) -> f64 {
    let outcomes = outcomes.iter().map(|outcome| {
        let next = match outcome.terminated {
            true => 0.0,
            false => gamma * value(outcome.next),
        };
        outcome.probability / whole * (outcome.reward + next)
    });
    outcomes.sum()
}
