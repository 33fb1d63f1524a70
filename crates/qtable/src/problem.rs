//! Problems: environments, time limits, and states made from measured quantities.

mod discretise;
mod environment;
mod time_limit;

pub use discretise::{DiscretiseError, Intervals, Product};
pub use environment::{Environment, Status, Step};
pub use time_limit::TimeLimit;
