//! Policies: how an action is chosen from a table.

mod boltzmann;
mod epsilon_greedy;
mod rule;
mod ucb;

pub use boltzmann::Boltzmann;
pub use epsilon_greedy::EpsilonGreedy;
pub use rule::{Greedy, Policy, Ties};
pub use ucb::Ucb;
