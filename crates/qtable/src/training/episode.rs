//! Episodes without learning, and the checks of all loops.

use rand::Rng;

use crate::error::{Error, check_finite};
use crate::problem::Environment;
use crate::step::{Action, State, Status, Step};
use crate::table::QTable;

/// Checks that a table has the shape of an environment. With a dynamic one it may be smaller.
pub(super) fn check_fit<E: Environment + ?Sized>(
    environment: &E,
    table: &QTable,
) -> Result<(), Error> {
    let (mut states, actions) = (environment.states(), environment.actions());
    if environment.is_dynamic() {
        states = table.states();
    }
    table.check_shape("the environment", (states, actions))
}

/// Plays one episode of at most `limit` steps, from its first state to the last step.
pub(super) fn play<E: Environment + ?Sized>(
    environment: &mut E,
    table: &mut QTable,
    limit: u64,
    rng: &mut dyn Rng,
    mut choose: impl FnMut(&QTable, State, &mut dyn Rng) -> Action,
    mut on_step: impl FnMut(&E, Action, &Step),
) -> Result<(), Error> {
    let mut step = Step::new(environment.reset(rng)?, 0.0, Status::Continuing);
    for taken in 0..=limit {
        let state = step.observation;
        if environment.is_dynamic() {
            table.meet(environment, state)?;
        }
        if step.status != Status::Continuing || taken == limit {
            return table.check_state(state);
        }
        table.prepare(state)?;
        let action = choose(table, state, rng);
        table.check_choice(state, action)?;
        step = environment.step(action, rng)?;
        check_finite("reward", state, action, step.reward)?;
        on_step(environment, action, &step);
    }
    Ok(())
}
