//! Tests of the crate from outside.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on should fail"
)]

mod cached;
#[cfg(feature = "csv")]
mod csv;
mod environments;
mod experiments;
mod learners;
mod optimum;
#[cfg(feature = "files")]
mod persistence;
mod regression;
#[cfg(feature = "files")]
mod resume;
mod support;
mod tables;
mod toys;
mod training;
