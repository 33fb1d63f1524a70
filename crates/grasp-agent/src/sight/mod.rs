//! Sight: eyes, targets in frames, the camera model, the frozen-camera check.

pub(crate) mod aiming;
pub(crate) mod arm_plane;
pub(crate) mod camera_model;
pub(crate) mod eye;
pub(crate) mod frozen;
pub(crate) mod target;
