//! Shared parts of the example programs: trials, learning, result files, pictures and diagrams, CPU
//! time by stage, Wilson's interval.

pub mod ball_tally;
pub mod comparison;
pub mod cpu;
pub mod files;
pub mod learning;
pub mod overlay;
pub mod plane;
pub mod plot;
pub mod program;
pub mod stages;
pub mod trial;
pub mod wilson;
