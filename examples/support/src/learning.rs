//! Both behaviours of the paper, learned in one simulator.

use grasp_agent::{BehaviourError, BehaviourPair, Learned, Percept};
use puma_grasp::Simulator;
use rand::Rng;

use crate::plane::search_percepts;

/// Actions to learn from, centering and approaching.
pub const ACTIONS: (u64, u64) = (60_000, 500_000);
/// Actions to learn approaching on 540 states from.
pub const ACTIONS_FINE: u64 = 4_000_000;
/// Trials in the simulator by which the best table is chosen.
pub const TRIALS: usize = 500;

/// Learns both behaviours with [`ACTIONS`] and [`TRIALS`]. `seed` is that of the balls from which
/// approaching is tried.
///
/// # Errors
/// Those of [`Simulator::learn`].
pub fn learn_both(
    simulator: &Simulator,
    pair: BehaviourPair,
    seed: u64,
    rng: &mut dyn Rng,
) -> Result<Learned, BehaviourError> {
    let anywhere: Vec<Percept> = (0..TRIALS).map(|_| simulator.start(rng)).collect();
    let found = search_percepts(TRIALS, seed);
    let quiet = &mut |_: &qtable::Record| ();
    let centering = simulator.learn(pair.centering, &anywhere, ACTIONS.0, rng, quiet)?;
    let approaching = simulator.learn(pair.approaching, &found, ACTIONS.1, rng, quiet)?;
    Ok(Learned::new(centering.behaviour, approaching.behaviour))
}
