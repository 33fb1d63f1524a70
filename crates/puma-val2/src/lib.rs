//! puma-val2
