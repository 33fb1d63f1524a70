//! The simulated cell as pure geometry: arm, camera, hand, ball and table.

pub(crate) mod ball;
pub(crate) mod camera;
pub(crate) mod distortion;
pub(crate) mod ellipse;
pub(crate) mod errors;
pub(crate) mod geometry;
pub(crate) mod grasp;
pub(crate) mod hand;
pub(crate) mod noise;
pub(crate) mod optimum;
pub(crate) mod sight;
pub(crate) mod workspace;
