//! Learners: how a table improves from experience.

mod double;
mod dyna;
mod n_step;
mod one_step;
mod rule;
mod sweeping;
mod traces;

pub use double::DoubleQLearning;
pub use dyna::DynaQ;
pub use n_step::NStepQ;
pub use one_step::{ExpectedSarsa, QLearning, Sarsa};
pub use rule::{Experience, Learner};
pub use sweeping::PrioritizedSweeping;
pub use traces::{QLambda, SarsaLambda};
