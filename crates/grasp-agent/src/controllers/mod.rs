//! The controllers: learned, servoing, hybrid, and wrappers about them.

pub(crate) mod hybrid;
pub(crate) mod learned;
pub(crate) mod servo;
pub(crate) mod taught_goal;
