//! How good a policy is, by trying it.

use rand::Rng;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::{Error, check_count};
use crate::policy::Policy;
use crate::problem::{Environment, Status};
use crate::table::{QTable, Value};

/// What a policy achieved in a number of episodes.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct Evaluation {
    /// Episodes played.
    pub episodes: u64,
    /// Share of them that ended in success ([`Environment::succeeded`]), `0..=1`.
    pub success_share: f64,
    /// Mean number of steps of an episode.
    pub mean_steps: f64,
    /// Mean number of steps of an episode that succeeded; `None` if none did.
    pub mean_steps_to_success: Option<f64>,
    /// Mean sum of rewards of an episode, undiscounted.
    pub mean_return: f64,
}

/// Plays episodes of at most `limit` steps with a policy, without learning. A mask is the table's
/// own affair here: it is not taken over from the environment.
///
/// # Errors
/// A table of the wrong shape, no episode or no step to play, an action that the table does not
/// offer, or an environment that reports a state out of range or a reward that is not finite.
pub fn evaluate<V: Value, E: Environment + ?Sized, P: Policy<V> + ?Sized>(
    environment: &mut E,
    table: &QTable<V>,
    policy: &mut P,
    episodes: u64,
    limit: u64,
    rng: &mut dyn Rng,
) -> Result<Evaluation, Error> {
    check_count("episodes", episodes)?;
    check_count("limit", limit)?;
    table.check_shape(
        "the environment",
        environment.states(),
        environment.actions(),
    )?;
    let (mut successes, mut steps_of_successes, mut all_steps, mut sum) = (0, 0, 0, 0.0);
    for _ in 0..episodes {
        let mut state = environment.reset(rng);
        for taken in 1..=limit {
            table.check_state(state)?;
            let action = policy.choose(table, state, rng);
            table.check(state, action)?;
            let step = environment.step(action, rng);
            if !step.reward.is_finite() {
                return Err(Error::RewardNotFinite {
                    state,
                    action,
                    reward: step.reward,
                });
            }
            all_steps += 1;
            sum += step.reward;
            state = step.observation;
            if step.status != Status::Continuing {
                if environment.succeeded(&step) {
                    successes += 1;
                    steps_of_successes += taken;
                }
                break;
            }
        }
    }
    Ok(Evaluation {
        episodes,
        success_share: successes as f64 / episodes as f64,
        mean_steps: all_steps as f64 / episodes as f64,
        mean_steps_to_success: (successes > 0)
            .then(|| steps_of_successes as f64 / successes as f64),
        mean_return: sum / episodes as f64,
    })
}
