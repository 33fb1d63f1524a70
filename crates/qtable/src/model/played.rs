//! An environment that draws from a known model.

use rand::{Rng, RngExt};

use crate::error::{Error, check_index};
use crate::model::dynamics::{Model, Outcome};
use crate::problem::Environment;
use crate::step::{Action, State, Status, Step};
use crate::validated::validated;

validated! {
    /// An [`Environment`] that draws from a [`Model`]: a problem whose optimum is known.
    ///
    /// Its presets have the rules and the numbering of
    /// [Gymnasium](https://gymnasium.farama.org/environments/toy_text/). A time limit is not part
    /// of the dynamics; Gymnasium sets 100 steps for the 4x4 lake, 200 for the 8x8 lake and the
    /// taxi, and none for the cliff and blackjack. [`TimeLimit`](crate::TimeLimit) and the episode
    /// limit of training set one.
    ///
    /// ```
    /// use qtable::{ModelEnvironment, State};
    ///
    /// fn main() -> Result<(), qtable::Error> {
    ///     let lake = ModelEnvironment::frozen_lake("4x4", true)?;
    ///     let plan = lake.model().value_iteration(0.99, 1e-12)?;
    ///     assert!((plan.table.max(State(0)) - 0.5420).abs() < 1e-4);
    ///     Ok(())
    /// }
    /// ```
    ///
    /// Before the first `reset` it stands in the first of its first states. An action that the
    /// present state does not offer changes nothing and pays nothing.
    #[derive(Clone, Debug, PartialEq)]
    pub struct ModelEnvironment {
        model: Model,
        start: Vec<(State, f64)>,
        only_reward_succeeds: bool,
        state: State,
    }
}

impl ModelEnvironment {
    /// Creates the environment with the probability of each first state.
    ///
    /// # Errors
    /// A first state out of range, or probabilities that do not sum to 1.
    pub fn new(model: Model, start: &[(State, f64)]) -> Result<Self, Error> {
        let state = start.first().map_or(State(0), |&(state, _)| state);
        Self {
            model,
            start: start.to_vec(),
            only_reward_succeeds: false,
            state,
        }
        .restore()
    }

    /// Counts a termination as a success only if its reward is positive. By default every
    /// termination is one.
    pub(crate) fn with_success_by_reward(self) -> Self {
        Self {
            only_reward_succeeds: true,
            ..self
        }
    }

    /// Returns the model.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Returns the probability of each first state.
    pub fn start(&self) -> &[(State, f64)] {
        &self.start
    }

    fn restore(self) -> Result<Self, Error> {
        self.model.spread_start(&self.start)?;
        check_index("state", self.state.0, self.model.states())?;
        Ok(self)
    }
}

impl Environment for ModelEnvironment {
    fn states(&self) -> usize {
        self.model.states()
    }

    fn actions(&self) -> usize {
        self.model.actions()
    }

    fn reset(&mut self, rng: &mut dyn Rng) -> Result<State, Error> {
        self.state = draw(self.start.iter().copied(), rng).unwrap_or_default();
        Ok(self.state)
    }

    /// # Panics
    /// If the action is out of range.
    fn step(&mut self, action: Action, rng: &mut dyn Rng) -> Result<Step, Error> {
        let outcomes = self.model.outcomes(self.state, action).iter();
        let drawn = draw(outcomes.map(|outcome| (outcome, outcome.probability)), rng);
        let stay = Step::new(self.state, 0.0, Status::Continuing);
        let step = drawn.map_or(stay, Outcome::step);
        self.state = step.observation;
        Ok(step)
    }

    /// Returns `false` outside the model.
    fn allows(&self, state: State, action: Action) -> bool {
        let inside = state.0 < self.model.states() && action.0 < self.model.actions();
        inside && !self.model.outcomes(state, action).is_empty()
    }

    fn succeeded(&self, last: &Step) -> Option<bool> {
        let paid = last.reward > 0.0 || !self.only_reward_succeeds;
        Some(last.status == Status::Terminated && paid)
    }
}

/// Draws one of several choices by their probabilities, which sum to 1; the last one if rounding
/// leaves a crumb. A single choice takes nothing from the generator.
fn draw<T: Copy>(choices: impl ExactSizeIterator<Item = (T, f64)>, rng: &mut dyn Rng) -> Option<T> {
    let mut rest = if choices.len() > 1 { rng.random() } else { 0.0 };
    let mut drawn = None;
    for (choice, probability) in choices {
        drawn = Some(choice);
        rest -= probability;
        if rest < 0.0 {
            break;
        }
    }
    drawn
}
