//! The agent on a small simulated cell of its own, made of the camera model and the arm's
//! kinematics.
#![allow(clippy::unwrap_used, clippy::panic)]

mod arms;
mod calibration;
mod cell;
mod conditions;
mod endings;
mod faults;
mod gripping;
mod hybrid;
mod learned;
mod log;
mod modules;
mod odd_cells;
mod phases;
mod plant;
mod queueing;
mod rivals;
mod saved_runs;
mod settings;
mod target;
