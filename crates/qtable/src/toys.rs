//! Small problems with known dynamics, as presets of [`ModelEnvironment`](crate::ModelEnvironment).

mod blackjack;
mod grids;
mod taxi;
