//! The rivals that the paper names, as controllers: visual servoing in its classical forms, a fuzzy
//! controller, and a one-step look-ahead.
//!
//! All of them believe in a [`CameraModel`](crate::CameraModel) and do not learn. They share what
//! is not theirs to decide: the goal, the longest step of a cycle, the working limits.

pub(crate) mod fuzzy;
pub(crate) mod image_based;
pub(crate) mod look_ahead;
pub(crate) mod position_based;
pub(crate) mod settings;
