//! Training: the loop, its records, and what is made of several runs.

mod blocks;
mod cached;
mod check_env;
mod course;
mod curve;
mod evaluate;
mod plain;
mod resumable;
mod seeds;

pub use blocks::{TrainingInBlocks, train_in_blocks};
pub use cached::CachedBoltzmann;
pub use check_env::{EnvironmentFault, EnvironmentReport, check_env};
pub use curve::Record;
pub use evaluate::{Evaluation, evaluate};
pub use plain::{Progress, TrainConfig, TrainReport, train};
pub use resumable::{Training, Until};
pub use seeds::{Estimate, over_seeds};
