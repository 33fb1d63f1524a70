//! Controllers: learned, servo, hybrid, and one with another goal.

pub(crate) mod hybrid;
pub(crate) mod learned;
pub(crate) mod servo;
pub(crate) mod taught_goal;
