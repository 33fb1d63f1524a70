//! puma-grasp
mod training;
pub use training::*;
