//! An environment that answers as a test wants, and a table trained on one.

use qtable::{Action, Environment, Error, QTable, State, Status, Step, TrainConfig, train};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{Rng, SeedableRng};

pub(crate) fn rng(seed: u64) -> Xoshiro256PlusPlus {
    Xoshiro256PlusPlus::seed_from_u64(seed)
}

/// An environment with one state less a fault of one's choice.
pub(crate) struct Odd<F: FnMut(u64) -> Step> {
    steps: u64,
    answer: F,
}

impl<F: FnMut(u64) -> Step> Environment for Odd<F> {
    fn states(&self) -> usize {
        3
    }
    fn actions(&self) -> usize {
        2
    }
    fn reset(&mut self, _rng: &mut dyn Rng) -> State {
        State(0)
    }
    fn step(&mut self, _action: Action, _rng: &mut dyn Rng) -> Step {
        self.steps += 1;
        (self.answer)(self.steps)
    }
}

pub(crate) fn odd(answer: impl FnMut(u64) -> Step) -> Odd<impl FnMut(u64) -> Step> {
    Odd { steps: 0, answer }
}

pub(crate) fn step(observation: usize, reward: f64, status: Status) -> Step {
    Step {
        observation: State(observation),
        reward,
        status,
    }
}

pub(crate) fn trained(
    environment: &mut dyn Environment,
    config: &TrainConfig,
) -> Result<QTable, Error> {
    let mut table = QTable::new(environment.states(), environment.actions())?;
    train(environment, &mut table, config, &mut rng(0), &mut |_| {})?;
    Ok(table)
}
