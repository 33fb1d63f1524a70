//! Behaviours as data, what they learn, and how they learn it.

pub(crate) mod learning;
pub(crate) mod policy;
pub(crate) mod preset;
pub(crate) mod reward;
pub(crate) mod spec;
pub(crate) mod task;
