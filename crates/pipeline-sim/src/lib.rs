#![doc = include_str!("../README.md")]
//!
//! # How the parts meet
//!
//! A [`Cell`] is pure geometry: from the joint angles it tells what the camera would see
//! ([`Cell::features`]), where the fingers are ([`Cell::grip_miss`]) and whether they are about to
//! touch something ([`Cell::proximity`]). A [`Renderer`] draws the frame that belongs to it.
//! [`CellCamera`] and [`SimulatedArm`] put a [`SharedCell`] behind the doors of `hough-heuristic`
//! and `puma-val2` ([`FrameSource`](hough_heuristic::FrameSource),
//! [`Manipulator`](puma_val2::Manipulator), [`ProximitySensor`](puma_val2::ProximitySensor)).
//! [`sample_moves`] draws samples of moves, and [`ReachModel`] and [`CentreModel`] fit the paper's
//! regression simulator, and better ones, to them.
//!
//! # Conventions
//!
//! Metres and radians, VAL's world frame (origin at the shoulder, z up); names ending in `degrees`,
//! and the moves `d1`, `d2`, `d3` of samples and models, are degrees of VAL's joints. Pixels have
//! (0, 0) at the centre of the top-left pixel; *units* are the paper's 192x144
//! ([`hough_heuristic::Features`]). Whatever is random takes the caller's generator or a seed.

mod ball;
mod benchmark_kind;
mod camera;
mod cell;
mod centre_model;
mod distortion;
mod ellipse;
mod error;
mod errors;
mod grasp;
mod hand;
mod least_squares;
mod motion;
mod mount;
mod open_loop;
mod optimum;
mod overview;
mod reach_form;
mod reach_model;
mod reach_noise;
mod reach_refit;
mod render;
mod samples;
mod scene;
mod scene_check;
mod scene_kind;
mod source;
mod stored;
mod workspace;
mod y4m;

pub use ball::{Ball, Holder};
pub use benchmark_kind::BenchmarkKind;
pub use camera::Camera;
pub use cell::{Cell, SightRule, WorkingLimits};
pub use centre_model::CentreModel;
pub use distortion::Distortion;
pub use ellipse::Ellipse;
pub use error::{CameraError, ProjectionError, QuantityError, ReachError, SightError};
pub use errors::{ErrorLevel, Errors, UnknownName};
pub use grasp::{Contact, Grasp};
pub use hand::{Capsule, Hand};
pub use least_squares::{FitError, Quality};
pub use motion::{BallPath, Motion};
pub use mount::Mount;
pub use open_loop::OpenLoopError;
pub use optimum::GoalBox;
pub use reach_form::ReachForm;
pub use reach_model::ReachModel;
pub use render::{Renderer, Round, Shot, Sighting};
pub use samples::{
    CentreSample, MOST_SAMPLES, MoveLists, ReachSample, exploring_start, sample_moves,
    try_sample_moves, with_noise,
};
pub use scene::{Light, Look, Occluder, Scene, Sensor, Shape, Thing};
pub use scene_kind::{SceneKind, Snapshot};
pub use source::{CellCamera, FeatureCamera, SharedCell, SimulatedArm};
pub use stored::StoredModelError;
pub use workspace::{Coverage, Workspace};
pub use y4m::Y4mWriter;

pub use hough_heuristic::image;
pub use nalgebra;
pub use rand;
