//! Simulated devices: a camera that delivers frames, an arm that moves, sensors, a video file.

pub(crate) mod source;
pub(crate) mod y4m;
