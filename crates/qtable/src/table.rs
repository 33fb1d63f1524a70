//! Tables of action values, their masks, and their text form.

mod csv;
mod mask;
mod qtable;

pub use mask::ActionMask;
pub(crate) use mask::checked_entries;
pub use qtable::QTable;
pub(crate) use qtable::check_value;
