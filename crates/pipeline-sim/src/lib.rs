#![doc = include_str!("../README.md")]
//!
//! # How the types meet
//!
//! A [`Cell`] is pure geometry: from the joint angles it computes the ball's image features
//! ([`Cell::features`]), the distance of the fingers from the ball ([`Cell::grip_miss`]) and the
//! proximity sensors ([`Cell::proximity`]). A [`Renderer`] draws the frame that belongs to it.
//! [`CellCamera`] and [`SimulatedArm`] work on a [`SharedCell`] and implement the traits of
//! `hough-heuristic` ([`FrameSource`](hough_heuristic::FrameSource)) and `puma-val2`
//! ([`Manipulator`](puma_val2::Manipulator), [`ProximitySensor`](puma_val2::ProximitySensor)).
//! [`Cell::sample_moves`] draws the samples to which a [`MoveModel`] is fitted.
//!
//! # Conventions
//!
//! Metres and radians, VAL's world frame (origin at the shoulder, z up). Names ending in `degrees`,
//! and the moves `d1`, `d2`, `d3` of samples and models, are degrees of VAL's joints. Pixel (0, 0)
//! is the centre of the top-left pixel; *units* are the paper's 192x144
//! ([`Features`](hough_heuristic::Features)). Everything random takes the caller's generator or a
//! seed.

mod cell;
#[cfg(feature = "datasets")]
mod datasets;
mod devices;
mod error;
mod regression;
mod render;

pub use cell::ball::{Ball, Holder};
pub use cell::camera::Camera;
pub use cell::distortion::Distortion;
pub use cell::ellipse::ProjectedEllipse;
pub use cell::errors::{ErrorLevel, Errors};
pub use cell::geometry::Cell;
pub use cell::grasp::Grasp;
pub use cell::hand::HandShape;
pub use cell::sight::SightRule;
pub use cell::workspace::Workspace;
#[cfg(feature = "datasets")]
pub use datasets::{recipe::Recipe, snapshot::Snapshot};
pub use devices::arm::SimulatedArm;
pub use devices::camera::{CellCamera, FeatureCamera};
pub use devices::shared_cell::{Contacts, SharedCell};
pub use error::{QuantityError, SightError};
pub use regression::form::MoveForm;
pub use regression::model::MoveModel;
pub use regression::quality::Quality;
pub use regression::samples::MoveSample;
pub use render::renderer::Renderer;
pub use render::scene::{Appearance, Light, Occluder, Scene, Sensor, Shape, Thing};
pub use render::shot::Shot;
pub use render::truth::{Round, RoundOutline};

pub use hough_heuristic;
pub use hough_heuristic::image;
pub use nalgebra;
pub use puma_val2;
pub use rand;
