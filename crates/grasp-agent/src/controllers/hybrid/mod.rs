//! The hybrid controller: known geometry, and learned corrections of it.
//!
//! The paper's outlook names "hybrid controllers that embed prewired knowledge to speed-up the
//! learning process". The prewired knowledge is a [`CameraModel`](crate::CameraModel) with the
//! arm's kinematics. Least squares on the sightings of all runs learn the errors of camera, ball
//! and gears.

pub(crate) mod belief;
pub(crate) mod controller;
pub(crate) mod evidence;
pub(crate) mod fit;
pub(crate) mod misfit;
pub(crate) mod parameters;
pub(crate) mod settings;
