//! Tests of the simulated cell through its public interface.

#![allow(
    clippy::print_stdout,
    reason = "measured errors, shown with --nocapture"
)]

mod cell;
mod detection;
mod devices;
mod frames;
mod optimum;
mod plant;
mod projection;
mod recipes;
mod regression;
mod stored_models;
mod truth;
