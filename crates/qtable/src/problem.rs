//! Problems: the environment's trait, time limits, and states made from measured quantities.

mod discretise;
mod environment;
mod time_limit;

pub use discretise::{Intervals, Product};
pub use environment::Environment;
pub use time_limit::TimeLimit;
