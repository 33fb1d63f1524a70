//! Regression simulators: samples of moves, and the models fitted to them.

pub(crate) mod centre_model;
pub(crate) mod least_squares;
pub(crate) mod quality;
pub(crate) mod reach_form;
pub(crate) mod reach_model;
pub(crate) mod samples;
