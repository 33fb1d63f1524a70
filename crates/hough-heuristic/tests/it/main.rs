//! Integration tests, one module a theme.

#![allow(
    clippy::unwrap_used,
    reason = "a test may fail that way, also in a function that several tests share"
)]

mod a_contrario;
mod a_contrario_score;
mod any_frame;
mod choice;
mod colours;
mod curves;
mod detectors;
mod ellipses;
mod heuristic;
#[cfg(feature = "cli")]
mod program;
mod refusals;
mod regression;
#[cfg(feature = "serde")]
mod serde;
#[cfg(feature = "files")]
mod stages;
