//! Training: the loop, cached exploration, evaluation, and experiments over seeds.

mod against;
mod blocks;
mod cached;
mod check_env;
mod course;
mod curve;
mod driver;
mod episode;
mod evaluate;
mod seeds;

pub use cached::CachedBoltzmann;
pub use check_env::{EnvironmentReport, check_env};
pub use course::Until;
pub use curve::Record;
pub use driver::Training;
pub use evaluate::{Evaluation, evaluate};
pub use seeds::{Estimate, over_seeds};
