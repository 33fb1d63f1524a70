//! Behaviours: specification, reward, learning, learned table.

pub(crate) mod learning;
pub(crate) mod policy;
pub(crate) mod preset;
pub(crate) mod reward;
pub(crate) mod space;
pub(crate) mod spec;
pub(crate) mod task;
