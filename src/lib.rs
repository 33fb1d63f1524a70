//! See a ball, learn to reach it, and move a real arm to it, after *the paper*: C. Distante,
//! A. Anglani and F. Taurisano, "Target Reaching by Using Visual Information and Q-learning
//! Controllers", Autonomous Robots 9 (2000), 41-50.
//!
//! Five libraries, each usable on its own, and this package over them:
//!
//! | crate | turns |
//! |---|---|
//! | [`hough_heuristic`] | a gray frame into circles |
//! | [`qtable`] | experience into a policy |
//! | [`puma_val2`] | joint angles into VAL II text and back, for a real PUMA 560 or the emulated controller |
//! | [`pipeline_sim`] | an arm pose into a frame or features, samples of moves into a model |
//! | [`grasp_agent`] | circles into joint moves: learned behaviours, search, recovery, grip |
//!
//! They are re-exported here under their own names. This package joins the simulated cell to the
//! controller, which do not know each other: a [`Simulator`] is fitted to samples of the cell and
//! teaches a behaviour, and a [`Rig`] is an arm behind a VAL II controller with the cell around it,
//! in which an agent goes for a ball.
//!
//! ```
//! use std::ops::ControlFlow;
//!
//! use puma_grasp::Simulator;
//! use puma_grasp::grasp_agent::BehaviourSpec;
//! use puma_grasp::pipeline_sim::{Ball, Cell, MoveForm};
//! use puma_grasp::qtable::rand::{SeedableRng, rngs::Xoshiro256PlusPlus};
//!
//! fn main() -> Result<(), Box<dyn std::error::Error>> {
//!     let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
//!     let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
//!     // 500 moves of each behaviour, features with noise of 0.5 units of 192x144.
//!     let (centering, approaching) = cell.sample_moves(500, 0.5, &mut rng)?;
//!     let simulator = Simulator::fit(&centering, &approaching, MoveForm::Rigid22)?;
//!     let spec = BehaviourSpec::centering();
//!     let go_on = &mut |_: &_| ControlFlow::Continue(());
//!     let lesson = simulator.learn(spec, &[], 20_000, &mut rng, go_on)?;
//!     let last = lesson.curve.last();
//!     assert!(last.and_then(|record| record.success_share) > Some(0.8));
//!     Ok(())
//! }
//! ```
//!
//! The whole job, with rendered frames and a controller on a pseudo-terminal, is the example
//! `grasp`: `cargo run --release --example grasp`.

mod camera;
mod detector;
mod rig;
mod sampling;
#[cfg(target_family = "wasm")]
mod shared_line;
mod simulator;

pub use grasp_agent;
pub use hough_heuristic;
pub use pipeline_sim;
pub use puma_val2;
pub use qtable;

pub use camera::LiveCamera;
pub use detector::BallDetector;
pub use rig::{Rig, RigError, RigParts};
pub use simulator::Simulator;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
