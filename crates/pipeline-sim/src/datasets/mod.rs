//! Recipes of scenes and snapshots by kind of difficulty, drawn from a seed.

pub(crate) mod benchmark_kind;
pub(crate) mod scene_kind;
