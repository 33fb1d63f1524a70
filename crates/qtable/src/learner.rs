//! Learners: how a table improves from experience.

mod double;
mod dyna;
mod n_step;
mod q_learning;
mod rule;
mod sweeping;
mod target;
mod traces;

pub use double::DoubleQLearning;
pub use dyna::DynaQ;
pub use n_step::NStep;
pub use q_learning::QLearning;
pub use rule::{Experience, Learner};
pub use sweeping::PrioritizedSweeping;
pub use target::Target;
pub use traces::Traces;
