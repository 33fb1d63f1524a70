//! The paper's simulator, and both behaviours learned in it.

use std::ops::ControlFlow;

use clap::ValueEnum;
use grasp_agent::{BehaviourPair, CameraModel, Learned, Percept};
use hough_heuristic::Features;
use pipeline_sim::{Ball, Cell, MoveForm, Workspace};
use puma_grasp::Simulator;
use qtable::Record;
use rand::Rng;

use crate::plane::search_percepts;
use crate::program::{Outcome, go_on, stopped};

/// Moves sampled in the cell for the regression.
pub const SAMPLES: usize = 2_500;
/// Standard deviation of the features in the samples, feature units.
pub const FEATURE_NOISE: f64 = 0.5;
/// Actions to learn from, centering and approaching.
pub const ACTIONS: (u64, u64) = (60_000, 500_000);
/// Actions to learn approaching on 540 states from.
pub const ACTIONS_FINE: u64 = 4_000_000;
/// Trials in the simulator by which the best table is chosen.
pub const TRIALS: usize = 500;

/// Returns the paper's cell, with the ball in front of the arm.
pub fn paper_cell() -> Cell {
    Cell::paper(Ball::at(0.6, 0.0, -0.1))
}

/// An arm with a cell of its own.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub enum ArmName {
    /// The paper's PUMA 560.
    Puma,
    /// A UR5 with the paper's camera and gripper.
    Ur5,
    /// A desk arm of the size of the SO-101.
    So101,
}

impl ArmName {
    /// Returns the cell as it is meant to be, and where its balls lie.
    pub fn cell(self) -> (Cell, Workspace) {
        match self {
            Self::Puma => (paper_cell(), Workspace::paper()),
            Self::Ur5 => (Cell::ur5(Ball::at(-0.5, 0.0, 0.0)), Workspace::ur5()),
            Self::So101 => (Cell::so101(Ball::at(0.3, 0.0, 0.0)), Workspace::so101()),
        }
    }
}

/// Returns what an arm without errors believes of its cell.
pub fn believed(cell: &Cell) -> CameraModel {
    let units = Features::WIDTH / f64::from(cell.camera.size().0);
    CameraModel {
        arm: cell.arm,
        focal: cell.camera.focal_px() * units,
        mount: cell.mount,
        tool: cell.hand.tool,
        ..CameraModel::paper()
    }
}

/// Samples moves in `cell` and fits a simulator of each form to them.
///
/// # Errors
/// Those of sampling and of [`Simulator::fit`].
pub fn simulators<const N: usize>(
    cell: &Cell,
    forms: [MoveForm; N],
    rng: &mut dyn Rng,
) -> Outcome<[Simulator; N]> {
    let (centering, reaching) = cell.sample_moves(SAMPLES, FEATURE_NOISE, rng)?;
    let fit = |form: &MoveForm| Simulator::fit(&centering, &reaching, *form);
    let fitted: Vec<Simulator> = forms.iter().map(fit).collect::<Result<_, _>>()?;
    fitted
        .try_into()
        .map_err(|_| "one simulator for each form".into())
}

/// Draws percepts to begin trials of a simulator from.
pub fn anywhere(simulator: &Simulator, count: usize, rng: &mut dyn Rng) -> Vec<Percept> {
    (0..count).map(|_| simulator.start(rng)).collect()
}

/// Shows no progress of learning, and ends it when the program is to stop.
pub fn until_stopped(_: &Record) -> ControlFlow<()> {
    if stopped() {
        return ControlFlow::Break(());
    }
    ControlFlow::Continue(())
}

/// Fails if a signal has ended the learning, and says that nothing of it was kept.
///
/// # Errors
/// A signal.
pub fn learned_whole() -> Outcome {
    let lost = |stopped| format!("{stopped}; what was learned by then is not kept").into();
    go_on().map_err(lost)
}

/// Learns both behaviours with [`ACTIONS`] and [`TRIALS`]. `seed` is that of the balls from which
/// approaching is tried.
///
/// # Errors
/// Those of [`Simulator::learn`], and a signal.
pub fn learn_both(
    simulator: &Simulator,
    pair: BehaviourPair,
    seed: u64,
    rng: &mut dyn Rng,
) -> Outcome<Learned> {
    let (starts, found) = (
        anywhere(simulator, TRIALS, rng),
        search_percepts(TRIALS, seed),
    );
    let centering = simulator.learn(pair.centering, &starts, ACTIONS.0, rng, &mut until_stopped)?;
    let approaching =
        simulator.learn(pair.approaching, &found, ACTIONS.1, rng, &mut until_stopped)?;
    learned_whole()?;
    Ok(Learned::new(centering.behaviour, approaching.behaviour))
}
