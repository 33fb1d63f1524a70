//! Small problems with known dynamics, as presets of [`ModelEnvironment`](crate::ModelEnvironment).

mod grids;
mod taxi;
