//! See a ball, learn to reach it, and move a real arm to it.
//!
//! Five libraries, each of use on its own, and this package over them:
//!
//! | crate | turns |
//! |---|---|
//! | [`hough_heuristic`] | a gray frame into circles |
//! | [`qtable`] | experience into a policy |
//! | [`puma_val2`] | joint angles into VAL II text and back, for a real PUMA 560 or the emulated controller |
//! | [`pipeline_sim`] | an arm pose into a camera frame, and samples of it into a regression simulator |
//! | [`grasp_agent`] | circles into joint moves: learned behaviours, search, recovery, grip |
//!
//! They are re-exported here under their own names. What this package adds is the wiring between
//! the two that do not know each other, the simulated cell and the controller: a [`Simulator`] is
//! fitted to samples of the cell, [`learn`] teaches a behaviour in it, and a [`Rig`] is an arm
//! behind a VAL II controller with the cell around it, in which an agent goes for a ball.
//!
//! ```
//! use puma_grasp::grasp_agent::BehaviourSpec;
//! use puma_grasp::pipeline_sim::{Ball, Cell, ReachForm, sample_moves};
//! use puma_grasp::{Simulator, learn};
//! use rand::SeedableRng;
//! use rand::rngs::Xoshiro256PlusPlus;
//!
//! let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
//! let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
//! let (centring, reaching) = sample_moves(&cell, 500, 0.5, &mut rng);
//! let simulator = Simulator::fit(&centring, &reaching, ReachForm::Rigid22)?;
//! let lesson = learn(BehaviourSpec::centering(), &simulator, 20_000, &mut rng, &mut |_| {})?;
//! assert!(lesson.report.curve.last().and_then(|record| record.success_share) > Some(0.8));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The whole job, with rendered frames and a controller on a pseudo-terminal, is the example
//! `grasp`: `cargo run --release --example grasp`.

mod plane;
mod rig;
mod setup;
mod surroundings;
mod training;
mod trial;

pub use grasp_agent;
pub use hough_heuristic;
pub use pipeline_sim;
pub use puma_val2;
pub use qtable;

pub use plane::{
    ExactPlane, PlaneScore, PlaneStart, optimum, score, search_percepts, search_starts,
};
pub use rig::{PlaceError, Rig, RigError, RigParts};
pub use setup::{BallDetector, UnknownDetector, bright_ball_scene};
pub use surroundings::Contacts;
pub use training::{Simulator, learn, learn_best};
pub use trial::{FeatureEye, TrialCell, TrialResult};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
