//! Eyes, and what they look for: targets in frames, the camera's model, a frozen camera.

pub(crate) mod aiming;
pub(crate) mod arm_plane;
pub(crate) mod camera_model;
pub(crate) mod eye;
pub(crate) mod frozen;
pub(crate) mod target;
