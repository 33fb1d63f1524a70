//! A check of an environment.

use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

use crate::error::{Error, check_reward, positive};
use crate::problem::Environment;
use crate::step::{Action, Status, Step};
use crate::table::{ActionMask, QTable};
use crate::training::driver::check_choice;

/// The steps, endings and states that [`check_env`] has met.
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

/// Plays `steps` random steps and checks the contract of [`Environment`]: a shape and a mask that
/// are possible and stay the same, observations in range, finite rewards, and episodes that repeat
/// exactly when the seed and the actions do.
///
/// ```
/// use qtable::{check_env, toys};
///
/// fn main() -> Result<(), qtable::Error> {
///     let report = check_env(&mut toys::taxi()?, 10_000, 1)?;
///     assert!(report.states_met > 100);
///     Ok(())
/// }
/// ```
///
/// # Errors
/// The first fault, for example [`Error::NotReproducible`] or [`Error::Endless`].
pub fn check_env<E: Environment + ?Sized>(
    environment: &mut E,
    steps: u64,
    seed: u64,
) -> Result<EnvironmentReport, Error> {
    positive("steps", steps)?;
    let (states, actions) = (environment.states(), environment.actions());
    let mut table = QTable::new(states, actions)?;
    let mask = ActionMask::of(environment)?;
    table.set_mask(mask.clone())?;

    let mut seeds = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut report = EnvironmentReport::default();
    let mut met = vec![false; states];
    let mut episode = 0;
    while report.steps < steps {
        let limit = (steps - report.steps).min(1000);
        let episode_seed = seeds.random();
        let first = play(environment, &table, limit, episode_seed, &[])?;
        if episode < 10 {
            // The actions are repeated, not drawn again, in case the environment counts on the
            // generator's state.
            let taken: Vec<Action> = first.iter().skip(1).map(|(action, _)| *action).collect();
            let second = play(environment, &table, limit, episode_seed, &taken)?;
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
            return Err(Error::EnvironmentChanged {
                steps: report.steps,
                what: "the shape",
            });
        }
        episode += 1;
    }
    if ActionMask::of(environment)? != mask {
        return Err(Error::EnvironmentChanged {
            steps: report.steps,
            what: "the mask",
        });
    }
    if report.terminated + report.truncated == 0 {
        return Err(Error::Endless {
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
    table: &QTable,
    limit: u64,
    seed: u64,
    given: &[Action],
) -> Result<Vec<(Action, Step)>, Error> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    // Another generator, so that the environment's draws do not depend on where the actions come
    // from.
    let mut chooser = Xoshiro256PlusPlus::seed_from_u64(!seed);
    let mut state = environment.reset(&mut rng)?;
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
        check_choice(table, state)?;
        let offered: Vec<Action> = table.offered(state).collect();
        let action = given
            .get(taken)
            .copied()
            .unwrap_or_else(|| offered[chooser.random_range(0..offered.len())]);
        let step = environment.step(action, &mut rng)?;
        table.check_state(step.observation)?;
        check_reward(state, action, step.reward)?;
        episode.push((action, step));
        state = step.observation;
        if step.status != Status::Continuing {
            break;
        }
    }
    Ok(episode)
}

fn compare(first: &[(Action, Step)], second: &[(Action, Step)]) -> Result<(), Error> {
    for (step, (&(_, first), &(_, second))) in first.iter().zip(second).enumerate() {
        if first != second {
            return Err(Error::NotReproducible {
                step: step as u64,
                first,
                second,
            });
        }
    }
    Ok(())
}
