//! Regression simulators: samples of moves, and the models fitted to them.

pub(crate) mod form;
mod least_squares;
pub(crate) mod model;
pub(crate) mod quality;
pub(crate) mod samples;
