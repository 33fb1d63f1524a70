//! Indices of states and actions: newtypes, so that a row is never mistaken for a column.

#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

/// The index of a state, `0..states`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct State(pub usize);

/// The index of an action, `0..actions`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct Action(pub usize);
