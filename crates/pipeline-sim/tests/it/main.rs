//! Tests of the simulated cell through its public interface.

mod cell;
mod detection;
mod devices;
mod frames;
mod optimum;
mod plant;
mod projection;
mod recipes;
mod regression;
mod stored_models;
mod truth;
