//! A check of an environment.

use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

use crate::error::{Error, positive};
use crate::problem::Environment;
use crate::step::{Action, State, Status, Step};
use crate::table::QTable;
use crate::training::episode::play;

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
/// are possible and stay the same (unless the environment is dynamic), observations in range,
/// finite rewards, and episodes that repeat exactly when the seed and the actions do.
///
/// ```
/// use qtable::{ModelEnvironment, check_env};
///
/// fn main() -> Result<(), qtable::Error> {
///     let report = check_env(&mut ModelEnvironment::taxi()?, 10_000, 1)?;
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
    let shape = (environment.states(), environment.actions());
    let mut table = QTable::new(shape.0, shape.1)?;
    table.restrict_as(environment);
    let mut seeds = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut report = EnvironmentReport::default();
    let (mut met, mut episode) = (vec![false; shape.0], 0);
    while report.steps < steps {
        let limit = (steps - report.steps).min(1000);
        let episode_seed = seeds.random();
        let first = record(environment, &mut table, limit, episode_seed, &[])?;
        if episode < 10 {
            // The actions are repeated, not drawn again, in case the environment counts on the
            // generator's state.
            let second = record(environment, &mut table, limit, episode_seed, &first)?;
            let mut pairs = first.iter().zip(&second);
            if let Some(step) = pairs.position(|((_, first), (_, second))| first != second) {
                let (first, second) = (first[step].1, second[step].1);
                return Err(Error::NotReproducible(step as u64, first, second));
            }
        }
        met.resize(table.states(), false);
        for (_, step) in &first {
            met[step.observation.0] = true;
        }
        report.steps += first.len() as u64 - 1;
        match first.last().map(|(_, step)| step.status) {
            Some(Status::Terminated) => report.terminated += 1,
            Some(Status::Truncated) => report.truncated += 1,
            _ => {}
        }
        let steps = report.steps;
        let now = (environment.states(), environment.actions());
        if now != shape && !environment.is_dynamic() {
            let what = "the shape";
            return Err(Error::EnvironmentChanged(what, steps));
        }
        episode += 1;
    }
    let steps = report.steps;
    if !environment.is_dynamic() && !has_mask_of(&table, environment) {
        let what = "the mask";
        return Err(Error::EnvironmentChanged(what, steps));
    }
    if report.terminated + report.truncated == 0 {
        return Err(Error::Endless(steps));
    }
    report.states_met = met.into_iter().filter(|&met| met).count();
    Ok(report)
}

/// Returns `true` if a table offers the actions that an environment allows.
fn has_mask_of<E: Environment + ?Sized>(table: &QTable, environment: &E) -> bool {
    let mut states = (0..table.states()).map(State);
    states.all(|state| {
        let mut actions = (0..table.actions()).map(Action);
        actions.all(|action| environment.allows(state, action) == table.allows(state, action))
    })
}

/// Plays one episode of at most `limit` steps and returns the reset, then each action and its
/// answer. Actions are random beyond those of a recorded episode.
fn record<E: Environment + ?Sized>(
    environment: &mut E,
    table: &mut QTable,
    limit: u64,
    seed: u64,
    given: &[(Action, Step)],
) -> Result<Vec<(Action, Step)>, Error> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    // Another generator, so that the environment's draws do not depend on where the actions come
    // from.
    let mut chooser = Xoshiro256PlusPlus::seed_from_u64(!seed);
    let mut begin = None;
    let mut given = given.iter().skip(1).map(|(action, _)| *action);
    let mut episode = Vec::new();
    let choose = |table: &QTable, state, _: &mut dyn rand::Rng| {
        begin.get_or_insert(state);
        given.next().unwrap_or_else(|| {
            let offered: Vec<Action> = table.offered(state).collect();
            offered[chooser.random_range(0..offered.len())]
        })
    };
    play(
        environment,
        table,
        limit,
        &mut rng,
        choose,
        |_, action, step| {
            episode.push((action, *step));
        },
    )?;
    let reset = Step::new(begin.unwrap_or_default(), 0.0, Status::Continuing);
    episode.insert(0, (Action(0), reset));
    Ok(episode)
}
