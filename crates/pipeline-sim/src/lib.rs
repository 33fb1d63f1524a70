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

mod cell;
mod datasets;
mod devices;
mod error;
mod regression;
mod render;

pub use cell::ball::{Ball, Holder};
pub use cell::camera::Camera;
pub use cell::distortion::Distortion;
pub use cell::ellipse::Ellipse;
pub use cell::errors::{ErrorLevel, Errors, UnknownName};
pub use cell::geometry::{Cell, SightRule, WorkingLimits};
pub use cell::grasp::{Contact, Grasp};
pub use cell::hand::{Capsule, Hand};
pub use cell::motion::{BallPath, Motion};
pub use cell::mount::Mount;
pub use cell::moves::MoveLists;
pub use cell::optimum::GoalBox;
pub use cell::workspace::{Coverage, Workspace};
pub use datasets::benchmark_kind::BenchmarkKind;
pub use datasets::scene_kind::{SceneKind, Snapshot};
pub use devices::source::{CellCamera, FeatureCamera, SharedCell, SimulatedArm};
pub use devices::y4m::Y4mWriter;
pub use error::{CameraError, ProjectionError, QuantityError, ReachError, SightError};
pub use regression::centre_model::CentreModel;
pub use regression::least_squares::{FitError, Quality};
pub use regression::open_loop::OpenLoopError;
pub use regression::reach_form::ReachForm;
pub use regression::reach_model::ReachModel;
pub use regression::samples::{
    CentreSample, MOST_SAMPLES, ReachSample, exploring_start, sample_moves, try_sample_moves,
    with_noise,
};
pub use regression::stored::StoredModelError;
pub use render::renderer::Renderer;
pub use render::scene::{Light, Look, Occluder, Scene, Sensor, Shape, Thing};
pub use render::shot::Shot;
pub use render::truth::{Round, Sighting};

pub use hough_heuristic::image;
pub use nalgebra;
pub use rand;
