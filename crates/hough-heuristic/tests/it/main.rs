//! Integration tests, one module a theme.

#[path = "../../scenes/scenes.rs"]
mod scenes;

mod heuristic;
