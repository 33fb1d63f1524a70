//! Tests of the simulated cell through its public interface.

use pipeline_sim::{Ball, Cell};
use puma_val2::Joints;
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

mod cell;
mod detection;
mod devices;
mod errors;
mod frames;
mod optimum;
mod plant;
mod projection;
mod recipes;
mod regression;
mod stored_models;
mod truth;

/// Returns a cell and the pose that shows its ball at the goal.
fn at_goal() -> (Cell, Joints) {
    let cell = Cell::paper(Ball::at(0.62, 0.20, -0.10));
    let goal = cell.goal_pose(45.0).expect("within reach");
    (cell, goal)
}

fn rng(seed: u64) -> Xoshiro256PlusPlus {
    Xoshiro256PlusPlus::seed_from_u64(seed)
}
