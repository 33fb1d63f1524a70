//! Simulated devices: a camera that delivers frames, an arm that moves, sensors.

pub(crate) mod arm;
pub(crate) mod camera;
mod followed_arm;
pub(crate) mod shared_cell;
