//! Recipes of labelled frames by kind of difficulty, drawn from a seed.

mod draw;
pub(crate) mod recipe;
pub(crate) mod snapshot;
mod stage;
mod things;
