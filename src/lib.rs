//! puma-grasp
