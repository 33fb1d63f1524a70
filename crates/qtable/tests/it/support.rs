//! An environment that answers as a test wants, and runs with settings of one's own.

use qtable::*;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{Rng, SeedableRng};

/// Asserts that a result is an error of a kind.
macro_rules! assert_refused {
    ($result:expr, $($kind:tt)+) => {
        match $result {
            Err($($kind)+) => {}
            other => panic!("{other:?} is not {}", stringify!($($kind)+)),
        }
    };
}

/// Asserts that two numbers differ by less than a bound.
macro_rules! assert_near {
    ($found:expr, $wanted:expr, $bound:expr $(, $label:expr)?) => {
        let (found, wanted): (f64, f64) = ($found, $wanted);
        let near = (found - wanted).abs() < $bound;
        assert!(near, "{found} is not {wanted} {:?}", ($($label)?));
    };
}

pub(crate) fn rng(seed: u64) -> Xoshiro256PlusPlus {
    Xoshiro256PlusPlus::seed_from_u64(seed)
}

pub(crate) fn constant(value: f64) -> Schedule {
    Schedule::constant(value).unwrap()
}

pub(crate) fn epsilon(value: f64) -> EpsilonGreedy {
    EpsilonGreedy::new(constant(value)).unwrap()
}

pub(crate) fn q_learning(alpha: f64, gamma: f64) -> QLearning {
    QLearning::new(constant(alpha), gamma).unwrap()
}

/// A table of zeros.
pub(crate) fn zeros(states: usize, actions: usize) -> QTable {
    QTable::new(states, actions).unwrap()
}

/// A table of zeros with the shape of an environment.
pub(crate) fn zeros_of(environment: &dyn Environment) -> QTable {
    zeros(environment.states(), environment.actions())
}

pub(crate) fn step(observation: usize, reward: f64, status: Status) -> Step {
    Step {
        observation: State(observation),
        reward,
        status,
    }
}

/// The experience of an action without a next one.
pub(crate) fn experience(state: usize, action: usize, step: Step) -> Experience {
    Experience {
        state: State(state),
        action: Action(action),
        step,
        next_action: None,
    }
}

/// A run after a number of actions.
pub(crate) fn trained<L: Learner, P: Policy>(
    environment: &mut dyn Environment,
    table: QTable,
    learner: L,
    policy: P,
    (limit, actions, seed): (u64, u64, u64),
) -> Training<L, P> {
    let training = Training::new(environment, table, learner, policy).unwrap();
    let mut training = training.with_episode_limit(limit).unwrap();
    let until = Until::Actions(actions);
    training.run(environment, until, &mut rng(seed)).unwrap();
    training
}

/// An environment whose n-th answer is given.
pub(crate) struct Odd<F> {
    shape: (usize, usize),
    /// An action that state 0 does not offer.
    forbidden: Option<Action>,
    steps: u64,
    answer: F,
}

impl<F: FnMut(u64, Action) -> Result<Step, Error>> Environment for Odd<F> {
    fn states(&self) -> usize {
        self.shape.0
    }
    fn actions(&self) -> usize {
        self.shape.1
    }
    fn reset(&mut self, _rng: &mut dyn Rng) -> Result<State, Error> {
        Ok(State(0))
    }
    fn step(&mut self, action: Action, _rng: &mut dyn Rng) -> Result<Step, Error> {
        self.steps += 1;
        (self.answer)(self.steps, action)
    }
    fn allows(&self, state: State, action: Action) -> bool {
        state.0 > 0 || Some(action) != self.forbidden
    }
    fn succeeded(&self, last: &Step) -> Option<bool> {
        Some(last.status == Status::Terminated)
    }
}

/// An environment of a shape that may refuse an action in state 0, and may fail.
pub(crate) fn odd_of<F: FnMut(u64, Action) -> Result<Step, Error>>(
    shape: (usize, usize),
    forbidden: Option<Action>,
    answer: F,
) -> Odd<F> {
    Odd {
        shape,
        forbidden,
        steps: 0,
        answer,
    }
}

/// An environment of three states and two actions that answers by the number of the step.
pub(crate) fn odd(mut answer: impl FnMut(u64) -> Step) -> impl Environment {
    odd_of((3, 2), None, move |n, _| Ok(answer(n)))
}

/// 16 cells in a row and 8 actions that go 3 cells back to 4 ahead, or now and then nowhere; the
/// last cell ends the episode.
pub(crate) fn corridor() -> ModelEnvironment {
    let model = Model::new(16, 8, |State(cell), Action(action)| {
        let next = (cell + action).saturating_sub(3).min(15);
        let outcome = |next: usize, probability| Outcome {
            probability,
            ..Outcome::certain(State(next), f64::from(u8::from(next == 15)), next == 15)
        };
        match cell {
            15 => vec![],
            _ => vec![outcome(next, 0.8), outcome(cell, 0.2)],
        }
    });
    ModelEnvironment::new(model.unwrap(), &[(State(0), 1.0)]).unwrap()
}

/// Settings of Q-learning with a Boltzmann policy.
#[derive(Clone)]
pub(crate) struct Settings {
    pub(crate) gamma: f64,
    pub(crate) alpha: Schedule,
    pub(crate) temperature: Schedule,
    pub(crate) actions: u64,
    pub(crate) episode_limit: u64,
    pub(crate) record_every: u64,
}

impl Settings {
    pub(crate) fn new(actions: u64) -> Self {
        Self {
            gamma: 0.9,
            alpha: Schedule::exponential(0.6, 0.02, actions).unwrap(),
            temperature: Schedule::exponential(1000.0, 0.1, actions).unwrap(),
            actions,
            episode_limit: 60,
            record_every: actions.div_ceil(100),
        }
    }

    pub(crate) fn begin<E: Environment + ?Sized>(
        &self,
        environment: &E,
        table: QTable,
    ) -> Result<Training<QLearning, Boltzmann>, Error> {
        let learner = QLearning::new(self.alpha.clone(), self.gamma)?;
        let policy = Boltzmann::new(self.temperature.clone())?;
        Training::new(environment, table, learner, policy)?
            .with_episode_limit(self.episode_limit)?
            .with_record_every(self.record_every)
    }

    /// The run after all its actions, from a table of zeros.
    pub(crate) fn run(
        &self,
        environment: &mut dyn Environment,
    ) -> Result<Training<QLearning, Boltzmann>, Error> {
        let mut training = self.begin(environment, zeros_of(environment))?;
        training.run(environment, Until::Actions(self.actions), &mut rng(0))?;
        Ok(training)
    }
}

/// The envelope of any payload, checksum included.
#[cfg(feature = "files")]
pub(crate) fn sealed(format: u32, kind: &str, types: &str, payload: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x89QTBL\r\n\x1a".to_vec();
    bytes.extend(format.to_le_bytes());
    for name in [kind, types] {
        bytes.extend((name.len() as u32).to_le_bytes());
        bytes.extend(name.as_bytes());
    }
    bytes.extend(payload);
    let checksum = crc32fast::hash(&bytes);
    bytes.extend(checksum.to_le_bytes());
    bytes
}

/// A value read from the bytes of other values of the same layout.
#[cfg(feature = "files")]
pub(crate) fn forged<T: serde::de::DeserializeOwned>(
    types: &str,
    parts: impl serde::Serialize,
) -> Result<T, FileError> {
    let payload = bincode::serde::encode_to_vec(parts, bincode::config::standard()).unwrap();
    decode("forged", &sealed(3, "forged", types, &payload))
}
