//! Small problems with known dynamics, for tests, examples and comparisons: FrozenLake,
//! CliffWalking and Taxi with the rules and the numbering of
//! [Gymnasium](https://gymnasium.farama.org/environments/toy_text/), and a chain whose optimum has
//! a closed form.
//!
//! Each is a [`ModelEnvironment`](crate::ModelEnvironment), so that a learned table can be compared
//! with the optimum:
//!
//! ```
//! use qtable::toys;
//!
//! fn main() -> Result<(), qtable::Error> {
//!     let lake = toys::frozen_lake(&toys::FROZEN_LAKE_4X4, true)?;
//!     let plan = lake.model().value_iteration(0.99, 1e-12)?;
//!     assert!((plan.table.max(qtable::State(0)) - 0.5420).abs() < 1e-4);
//!     Ok(())
//! }
//! ```
//!
//! A time limit is not part of the dynamics; Gymnasium sets 100 steps for the 4x4 lake, 200 for the
//! 8x8 lake and the taxi, and none for the cliff. [`TimeLimit`](crate::TimeLimit) and the driver's
//! episode limit set one.

mod grids;
mod taxi;

pub use grids::{FROZEN_LAKE_4X4, FROZEN_LAKE_8X8, chain, cliff_walking, frozen_lake};
pub use taxi::taxi;
