//! An environment that draws from a known model.

use rand::{Rng, RngExt};

use crate::error::Error;
use crate::model::dynamics::Model;
use crate::problem::Environment;
use crate::step::{Action, State, Status, Step};
use crate::validated::validated;

validated! {
    /// An [`Environment`] that draws from a [`Model`]: a problem whose optimum is known.
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
    #[must_use]
    pub fn with_success_by_reward(self) -> Self {
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
        if self.state.0 < self.model.states() {
            Ok(self)
        } else {
            Err(Error::StateOutOfRange {
                state: self.state,
                states: self.model.states(),
            })
        }
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
        let outcomes = self.model.outcomes(self.state, action);
        let step = match draw(
            outcomes
                .iter()
                .map(|outcome| (outcome, outcome.probability)),
            rng,
        ) {
            Some(outcome) => outcome.step(),
            None => Step {
                observation: self.state,
                reward: 0.0,
                status: Status::Continuing,
            },
        };
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
