//! The quality of a policy, measured by trying it.

use rand::Rng;

use crate::error::{Error, positive};
use crate::policy::Policy;
use crate::problem::Environment;
use crate::step::Status;
use crate::table::QTable;
use crate::training::episode::{check_fit, play};

/// The results of a policy in a number of episodes.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Evaluation {
    /// Episodes played.
    pub episodes: u64,
    /// Fraction of them that ended in success, `0..=1`; `None` if the environment does not tell
    /// ([`Environment::succeeded`]).
    pub success_share: Option<f64>,
    /// Mean number of steps of an episode.
    pub mean_steps: f64,
    /// Mean number of steps of an episode that succeeded; `None` if none did.
    pub mean_steps_to_success: Option<f64>,
    /// Mean sum of rewards of an episode, undiscounted.
    pub mean_return: f64,
    /// Standard deviation of the sums of rewards of the episodes; `None` for a single episode.
    pub return_deviation: Option<f64>,
}

/// Plays episodes of at most `limit` steps with a policy, without learning. If the environment
/// restricts its actions, the policy sees the table under this mask.
///
/// ```
/// use qtable::rand::{SeedableRng, rngs::Xoshiro256PlusPlus};
/// use qtable::{Greedy, ModelEnvironment, evaluate};
///
/// fn main() -> Result<(), qtable::Error> {
///     let mut lake = ModelEnvironment::frozen_lake("4x4", true)?;
///     let optimum = lake.model().value_iteration(0.99, 1e-9)?.table;
///     let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
///     let found = evaluate(&mut lake, &optimum, &mut Greedy, 2_000, 100, &mut rng)?;
///     assert!((found.success_share.unwrap_or(0.0) - 0.74).abs() < 0.05);
///     Ok(())
/// }
/// ```
///
/// # Errors
/// A table of the wrong shape, no episode or no step to play, an action that the table does not
/// offer, or an environment that reports a state out of range or a reward that is not finite.
pub fn evaluate<E: Environment + ?Sized, P: Policy + ?Sized>(
    environment: &mut E,
    table: &QTable,
    policy: &mut P,
    episodes: u64,
    limit: u64,
    rng: &mut dyn Rng,
) -> Result<Evaluation, Error> {
    positive("episodes", episodes)?;
    positive("limit", limit)?;
    check_fit(environment, table)?;
    let mut own = table.clone();
    own.restrict_as(environment);
    let (mut successes, mut steps_of_successes, mut all_steps, mut told) = (0, 0, 0, false);
    // Mean and sum of squares about it, after Welford.
    let (mut mean, mut squares, mut total) = (0.0, 0.0, 0.0);
    for episode in 1..=episodes {
        policy.begin_episode();
        let (mut sum, mut taken, mut success) = (0.0, 0_u64, None);
        let choose = |table: &QTable, state, rng: &mut dyn Rng| policy.choose(table, state, rng);
        play(
            environment,
            &mut own,
            limit,
            rng,
            choose,
            |world, _, step| {
                sum += step.reward;
                taken += 1;
                if step.status != Status::Continuing {
                    success = world.succeeded(step);
                }
            },
        )?;
        told |= success.is_some();
        if success == Some(true) {
            successes += 1;
            steps_of_successes += taken;
        }
        all_steps += taken;
        total += sum;
        let off = sum - mean;
        mean += off / episode as f64;
        squares += off * (sum - mean);
    }
    let count = episodes as f64;
    Ok(Evaluation {
        episodes,
        success_share: told.then(|| successes as f64 / count),
        mean_steps: all_steps as f64 / count,
        mean_steps_to_success: (successes > 0)
            .then(|| steps_of_successes as f64 / successes as f64),
        mean_return: total / count,
        return_deviation: (episodes > 1).then(|| f64::sqrt(squares / (count - 1.0))),
    })
}
