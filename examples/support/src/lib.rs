//! Shared parts of the example programs: start and end, trials, learning, result files, pictures,
//! diagrams and tables.

pub mod compare_controllers;
pub mod comparison;
pub mod files;
pub mod learning;
pub mod live;
pub mod overlay;
pub mod plane;
pub mod plot;
pub mod prelude;
pub mod program;
pub mod real;
pub mod stages;
pub mod tally;
pub mod trial;
