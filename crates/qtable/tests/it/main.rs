//! Tests of the crate from outside.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on should fail"
)]

#[macro_use]
mod support;

mod cached;
#[cfg(feature = "csv")]
mod csv;
mod dynamic;
mod environments;
mod experiments;
mod learners;
mod optimum;
#[cfg(feature = "files")]
mod persistence;
mod regression;
#[cfg(feature = "files")]
mod resume;
mod tables;
mod toys;
mod training;
