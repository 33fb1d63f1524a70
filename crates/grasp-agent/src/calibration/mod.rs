//! Calibration of a camera on the hand by looks at a resting ball.

pub(crate) mod cell;
pub(crate) mod fit;
pub(crate) mod hand_eye;
pub(crate) mod poses;
