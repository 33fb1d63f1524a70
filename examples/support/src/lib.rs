//! What the example programs share: result files, pictures with circles drawn in, exit codes, CPU
//! time by stage, and Wilson's interval.

pub mod cpu;
pub mod files;
pub mod overlay;
pub mod program;
pub mod stages;
pub mod wilson;
