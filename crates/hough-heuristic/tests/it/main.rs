//! Integration tests, one module a theme.

#[path = "../../scenes/scenes.rs"]
mod scenes;

mod curves;
mod detectors;
mod heuristic;
#[cfg(feature = "files")]
mod stages;
