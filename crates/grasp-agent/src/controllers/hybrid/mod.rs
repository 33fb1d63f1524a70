//! The hybrid: prewired geometry, and learning what is wrong with it.
//!
//! The paper's outlook names "hybrid controllers that embed prewired knowledge to speed-up the
//! learning process". Here the prewired knowledge is a [`CameraModel`](crate::CameraModel) with the
//! arm's kinematics; what is learned is how far the real camera, ball and gears are from it, by
//! least squares on everything that was seen in the runs so far.

pub(crate) mod belief;
pub(crate) mod controller;
pub(crate) mod evidence;
pub(crate) mod fit;
pub(crate) mod numbers;
