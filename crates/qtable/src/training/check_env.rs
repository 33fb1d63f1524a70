//! A check that an environment keeps the contract.

use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

use crate::error::{Error, check_count};
use crate::index::Action;
use crate::problem::{Environment, Status, Step};
use crate::table::{ActionMask, QTable};

/// What is wrong with an environment.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EnvironmentFault {
    /// Shape, mask, state or reward is impossible.
    #[error("after {steps} steps: {error}")]
    Invalid {
        /// Steps taken before.
        steps: u64,
        /// What is impossible.
        error: Error,
    },
    /// The shape or the mask is not the same when asked again.
    #[error("after {steps} steps {what} is not what it was at first")]
    Changed {
        /// Steps taken before.
        steps: u64,
        /// What has changed.
        what: &'static str,
    },
    /// The same seed and the same actions gave another episode. Typical causes: `reset` leaves
    /// something of the episode before, or randomness that does not come from the generator handed
    /// in.
    #[error("step {step} of an episode differs when repeated: {first:?}, then {second:?}")]
    NotReproducible {
        /// Number of the step within the episode; 0 is the reset.
        step: u64,
        /// The first time.
        first: Step,
        /// The second time.
        second: Step,
    },
    /// No episode ended, neither by termination nor by truncation: training needs an episode limit.
    /// Not a fault of a task that has no end.
    #[error("no episode ended within {steps} steps")]
    Endless {
        /// Steps taken.
        steps: u64,
    },
}

/// What [`check_env`] has seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EnvironmentReport {
    /// Steps taken.
    pub steps: u64,
    /// Episodes that terminated.
    pub terminated: u64,
    /// Episodes that were truncated.
    pub truncated: u64,
    /// Different states met.
    pub states_met: usize,
}

/// Plays `steps` random steps and checks what the contract of [`Environment`] asks for: a shape and
/// a mask that are possible and stay the same, observations in range, finite rewards, and episodes
/// that repeat exactly when the seed and the actions do.
///
/// ```
/// use qtable::{check_env, toys};
///
/// let report = check_env(&mut toys::taxi()?, 10_000, 1)?;
/// assert!(report.states_met > 100);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// The first [`EnvironmentFault`].
pub fn check_env<E: Environment + ?Sized>(
    environment: &mut E,
    steps: u64,
    seed: u64,
) -> Result<EnvironmentReport, EnvironmentFault> {
    let invalid = |steps| move |error| EnvironmentFault::Invalid { steps, error };
    check_count("steps", steps).map_err(invalid(0))?;
    let (states, actions) = (environment.states(), environment.actions());
    let mut table = QTable::<f32>::filled(states, actions, 0.0).map_err(invalid(0))?;
    let mask = ActionMask::of(environment).map_err(invalid(0))?;
    table.set_mask(mask.clone()).map_err(invalid(0))?;

    let mut seeds = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut report = EnvironmentReport::default();
    let mut met = vec![false; states];
    let mut episode = 0;
    while report.steps < steps {
        let limit = (steps - report.steps).min(1000);
        let episode_seed = seeds.random();
        let first =
            play(environment, &table, limit, episode_seed, &[]).map_err(invalid(report.steps))?;
        if episode < 10 {
            // The actions are repeated, not drawn again, in case the environment counts on the
            // generator's state.
            let taken: Vec<Action> = first.iter().skip(1).map(|(action, _)| *action).collect();
            let second = play(environment, &table, limit, episode_seed, &taken)
                .map_err(invalid(report.steps))?;
            compare(&first, &second)?;
        }
        for (_, step) in &first {
            met[step.observation.0] = true;
        }
        report.steps += first.len() as u64 - 1;
        match first.last().map(|(_, step)| step.status) {
            Some(Status::Terminated) => report.terminated += 1,
            Some(Status::Truncated) => report.truncated += 1,
            _ => {}
        }
        if (environment.states(), environment.actions()) != (states, actions) {
            return Err(EnvironmentFault::Changed {
                steps: report.steps,
                what: "the shape",
            });
        }
        episode += 1;
    }
    if ActionMask::of(environment).map_err(invalid(report.steps))? != mask {
        return Err(EnvironmentFault::Changed {
            steps: report.steps,
            what: "the mask",
        });
    }
    if report.terminated + report.truncated == 0 {
        return Err(EnvironmentFault::Endless {
            steps: report.steps,
        });
    }
    report.states_met = met.into_iter().filter(|&met| met).count();
    Ok(report)
}

/// One episode of at most `limit` steps: the reset, then each action and its answer. Actions are
/// random unless given.
fn play<E: Environment + ?Sized>(
    environment: &mut E,
    table: &QTable<f32>,
    limit: u64,
    seed: u64,
    given: &[Action],
) -> Result<Vec<(Action, Step)>, Error> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    // Another generator, so that the environment's draws do not depend on where the actions come
    // from.
    let mut chooser = Xoshiro256PlusPlus::seed_from_u64(!seed);
    let mut state = environment.reset(&mut rng);
    table.check_state(state)?;
    let mut episode = vec![(
        Action(0),
        Step {
            observation: state,
            reward: 0.0,
            status: Status::Continuing,
        },
    )];
    for taken in 0..limit as usize {
        let offered: Vec<Action> = table.offered(state).collect();
        let action = given
            .get(taken)
            .copied()
            .unwrap_or_else(|| offered[chooser.random_range(0..offered.len())]);
        let step = environment.step(action, &mut rng);
        table.check_state(step.observation)?;
        if !step.reward.is_finite() {
            return Err(Error::RewardNotFinite {
                state,
                action,
                reward: step.reward,
            });
        }
        episode.push((action, step));
        state = step.observation;
        if step.status != Status::Continuing {
            break;
        }
    }
    Ok(episode)
}

fn compare(first: &[(Action, Step)], second: &[(Action, Step)]) -> Result<(), EnvironmentFault> {
    for (step, (&(_, first), &(_, second))) in first.iter().zip(second).enumerate() {
        if first != second {
            return Err(EnvironmentFault::NotReproducible {
                step: step as u64,
                first,
                second,
            });
        }
    }
    Ok(())
}
