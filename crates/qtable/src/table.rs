//! The table: values, visits and the actions that each state offers.

mod best;
mod csv;
mod greedy;
mod keys;
mod mask;
mod qtable;

pub use keys::Keys;
pub use qtable::QTable;
pub(crate) use qtable::checked_entries;
