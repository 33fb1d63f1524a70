//! Tabular reinforcement learning for problems with finitely many states and actions.
//!
//! An [`Environment`] is the problem, in Gymnasium's words. A [`QTable`] holds a value for each
//! [`State`] and [`Action`]. A [`Policy`] chooses actions from the table, and a [`Learner`]
//! improves the table from each [`Step`]. [`Training`] runs them against each other; it can be
//! stopped, saved, adjusted and continued.
//!
//! [`over_seeds`] repeats an experiment, and [`Estimate`] is the mean with its 95 % interval.
//! [`Intervals`] and their [`Product`] make states from measured quantities. Where the dynamics are
//! known, a [`Model`] gives the optimum to compare with ([`ModelEnvironment::compare`]); a
//! [`ModelEstimate`] is learned from experience. `save` and `load` (feature `files`) put all of
//! this on disk.
//!
//! # Rules that hold everywhere
//!
//! * All randomness comes from the generator handed in. The same seed gives the same result, bit
//!   for bit, on every platform: the crate has exponential and logarithm of its own.
//! * Learners bootstrap through a step that *truncated* an episode, never through one that
//!   *terminated* it.
//! * A table never holds a value that is not finite. A reward of NaN or a state out of range is
//!   refused with an [`Error`] that says what and where. Methods that return no `Result` panic
//!   outside a table, like an index into a slice.
//! * Of equally good actions a policy that explores draws one ([`Ties`]); [`QTable::best`] and
//!   [`Greedy`] take the one with the lowest index.
//!
//! # An environment of your own
//!
//! ```
//! use qtable::rand::rngs::Xoshiro256PlusPlus;
//! use qtable::rand::{Rng, SeedableRng};
//! use qtable::{
//!     Action, Environment, EpsilonGreedy, Error, QLearning, QTable, Schedule, State, Status, Step,
//!     Training, Until,
//! };
//!
//! /// Five cells in a row; reach the right end.
//! struct Row(usize);
//!
//! impl Environment for Row {
//!     fn states(&self) -> usize {
//!         5
//!     }
//!     fn actions(&self) -> usize {
//!         2
//!     }
//!     fn reset(&mut self, _rng: &mut dyn Rng) -> Result<State, Error> {
//!         self.0 = 0;
//!         Ok(State(self.0))
//!     }
//!     fn step(&mut self, action: Action, _rng: &mut dyn Rng) -> Result<Step, Error> {
//!         self.0 = if action == Action(1) { self.0 + 1 } else { self.0.saturating_sub(1) };
//!         let done = self.0 == 4;
//!         let status = if done { Status::Terminated } else { Status::Continuing };
//!         Ok(Step::new(State(self.0), if done { 1.0 } else { 0.0 }, status))
//!     }
//! }
//!
//! fn main() -> Result<(), Error> {
//!     let learner = QLearning::new(Schedule::constant(0.5)?, 0.9)?;
//!     let policy = EpsilonGreedy::new(Schedule::linear(1.0, 0.1, 4_000)?)?;
//!     let mut training = Training::new(&Row(0), QTable::new(5, 2)?, learner, policy)?;
//!     let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
//!     training.run(&mut Row(0), Until::Actions(5_000), &mut rng)?;
//!     assert_eq!(training.table().greedy()[..4], [Action(1); 4]);
//!     assert!((training.table().max(State(0)) - 0.9f64.powi(3)).abs() < 1e-3);
//!     Ok(())
//! }
//! ```

#![forbid(unsafe_code)]

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod clock;
mod elementary;
mod error;
#[cfg(feature = "files")]
mod files;
mod learner;
mod model;
mod policy;
mod problem;
mod schedule;
mod scratch;
mod step;
mod table;
mod toys;
mod training;
mod validated;

pub use rand;

pub use error::Error;
#[cfg(feature = "files")]
pub use files::{FileError, decode, encode, load, save};
pub use learner::{
    DoubleQLearning, DynaQ, Experience, Learner, NStep, PrioritizedSweeping, QLearning, Target,
    Traces,
};
pub use model::{Assessment, Model, ModelEnvironment, ModelEstimate, Outcome, Plan};
pub use policy::{Boltzmann, EpsilonGreedy, Greedy, Policy, Ties, Ucb};
pub use problem::{Environment, Intervals, Product, TimeLimit};
pub use schedule::Schedule;
pub use step::{Action, State, Status, Step};
pub use table::{Keys, QTable};
pub use training::{
    CachedBoltzmann, EnvironmentReport, Estimate, Evaluation, Record, Training, Until, check_env,
    evaluate, over_seeds,
};
