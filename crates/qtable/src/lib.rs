//! Tabular reinforcement learning for problems with finitely many states and actions.
//!
//! An [`Environment`] is the problem, in Gymnasium's words. A [`QTable`] holds what is known of it,
//! one number for each [`State`] and [`Action`]. A [`Policy`] chooses actions from the table, and a
//! [`Learner`] improves the table from each [`Step`]. Three drivers run them against each other:
//!
//! * [`Training`] takes any learner and any policy, and can be stopped, saved and continued;
//! * [`train`] is one-step [`QLearning`] with a [`Boltzmann`] policy, in one call;
//! * [`train_in_blocks`] is the same several times faster, on a [`CachedBoltzmann`];
//!   [`TrainingInBlocks`] is that run in pieces, saved and continued between blocks.
//!
//! [`over_seeds`] repeats an experiment, and [`Estimate`] is the mean with its 95 % interval.
//! States come from measured quantities by way of [`Intervals`] and their [`Product`]. Where the
//! dynamics are known, a [`Model`] gives the optimum to compare with
//! ([`ModelEnvironment::compare`]); a [`ModelEstimate`] is one learned from experience. [`save`]
//! and [`load`] put anything of this on disk.
//!
//! # Rules that hold everywhere
//!
//! * All randomness comes from the generator handed in. The same seed gives the same result, bit
//!   for bit, on every platform: where a function of the standard library may differ between
//!   platforms, the crate has its own.
//! * Nothing is bootstrapped through a step that *terminated* an episode; through one that was
//!   *truncated* it is.
//! * A table never holds a value that is not finite. What comes from outside and cannot be, a
//!   reward of NaN or a state out of range, is refused with an error that says what and where.
//!   Methods that return no `Result` panic outside a table, as a slice does; each says so.
//! * Of equally good actions the one with the lowest index is taken, unless a policy was told to
//!   draw ([`Ties`]).
//!
//! # A problem of one's own
//!
//! ```
//! use qtable::{Action, Environment, QTable, State, Status, Step, TrainConfig, train};
//! use rand::rngs::Xoshiro256PlusPlus;
//! use rand::{Rng, SeedableRng};
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
//!     fn reset(&mut self, _rng: &mut dyn Rng) -> State {
//!         self.0 = 0;
//!         State(self.0)
//!     }
//!     fn step(&mut self, action: Action, _rng: &mut dyn Rng) -> Step {
//!         self.0 = if action == Action(1) { self.0 + 1 } else { self.0.saturating_sub(1) };
//!         let done = self.0 == 4;
//!         Step {
//!             observation: State(self.0),
//!             reward: if done { 1.0 } else { 0.0 },
//!             status: if done { Status::Terminated } else { Status::Continuing },
//!         }
//!     }
//! }
//!
//! let mut table = QTable::new(5, 2)?;
//! let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
//! let report = train(&mut Row(0), &mut table, &TrainConfig::paper(5_000), &mut rng, &mut |_| {})?;
//! assert_eq!(report.actions, 5_000);
//! assert_eq!(table.greedy()[..4], [Action(1); 4]);
//! assert!((table.max(State(0)) - 0.9f64.powi(3)).abs() < 1e-3);
//! # Ok::<(), qtable::Error>(())
//! ```

#![forbid(unsafe_code)]

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod elementary;
mod error;
#[cfg(feature = "serde")]
mod files;
mod index;
mod learner;
mod model;
mod policy;
mod problem;
mod schedule;
mod scratch;
mod table;
pub mod toys;
mod training;
mod validated;

pub use rand;

pub use error::{Error, ScheduleError};
#[cfg(feature = "serde")]
pub use files::{PersistError, Problem, decode, encode, load, save};
pub use index::{Action, State};
pub use learner::{
    DoubleQLearning, DynaQ, ExpectedSarsa, Experience, Learner, NStepQ, PrioritizedSweeping,
    QLambda, QLearning, Sarsa, SarsaLambda,
};
pub use model::{Assessment, Comparison, Model, ModelEnvironment, ModelEstimate, Outcome, Plan};
pub use policy::{Boltzmann, EpsilonGreedy, Greedy, Policy, Ties, Ucb};
pub use problem::{DiscretiseError, Environment, Intervals, Product, Status, Step, TimeLimit};
pub use schedule::Schedule;
pub use table::{ActionMask, CsvError, QTable, Value};
pub use training::{
    CachedBoltzmann, EnvironmentFault, EnvironmentReport, Estimate, Evaluation, Progress, Record,
    TrainConfig, TrainReport, Training, TrainingInBlocks, Until, check_env, evaluate, over_seeds,
    train, train_in_blocks,
};
