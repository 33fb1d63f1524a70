//! Training on cached weights, in blocks of constant temperature.

use std::ops::ControlFlow;

use rand::Rng;

use crate::error::{Error, positive};
use crate::learner::{Learner, QLearning};
use crate::policy::{Boltzmann, Policy};
use crate::problem::Environment;
use crate::step::{Action, State, Step};
use crate::training::cached::CachedBoltzmann;
use crate::training::course::{Actor, Until};
use crate::training::curve::Record;
use crate::training::driver::Training;
use crate::training::episode::check_fit;

/// Actions below which the plain policy is faster than cached weights.
const FEW: usize = 8;

impl Training<QLearning, Boltzmann> {
    /// Trains like [`run_with`](Training::run_with), several times faster: α and the temperature
    /// stand still within each of `blocks` equal parts from one record to the next, and the actions
    /// are drawn from a [`CachedBoltzmann`].
    ///
    /// With fewer than 8 actions, where the plain policy is faster, and with a dynamic environment
    /// it calls [`run_with`](Training::run_with). 256 to 1024 blocks in a run follow the schedules
    /// closely enough. (An α by visits still changes at every visit.) Values are kept as `f32`
    /// while it runs. They are written back before `on_record` is called and at the end, also after
    /// an error. The result differs from that of [`run`](Training::run) with the same seed: it is
    /// drawn from the same distribution, apart from the steps of the schedules.
    ///
    /// The run ends with the block in which a total is reached. The weights are not saved: a run
    /// that is resumed makes them anew from the table, which changes no bit at the end of a block.
    ///
    /// # Errors
    /// `blocks` of 0, what [`run`](Training::run) lists, and values that do not fit into an `f32`.
    pub fn run_in_blocks<E: Environment + ?Sized, R: Rng + ?Sized>(
        &mut self,
        environment: &mut E,
        until: Until,
        blocks: u64,
        mut rng: &mut R,
        mut on_record: impl FnMut(&Record, &mut Self) -> ControlFlow<()>,
    ) -> Result<bool, Error> {
        positive("blocks", blocks)?;
        if self.table.actions() < FEW || environment.is_dynamic() {
            return self.run_with(environment, until, rng, on_record);
        }
        check_fit(environment, &self.table)?;
        if self.course.has_reached(until) {
            return Ok(false);
        }
        let mut cached = CachedBoltzmann::new(&self.table, self.policy.temperature())?;
        while !self.course.has_reached(until) {
            let recorded = self.run_block(environment, blocks, &mut cached, &mut rng);
            if !matches!(recorded, Ok(None)) {
                cached.write_to(&mut self.table)?;
            }
            if let Some(record) = recorded? {
                self.curve.push(record);
                if on_record(&record, self).is_break() {
                    return Ok(true);
                }
            }
        }
        cached.write_to(&mut self.table)?;
        Ok(false)
    }

    /// Trains to the end of the present block. Returns a record if one is due.
    fn run_block<E: Environment + ?Sized>(
        &mut self,
        environment: &mut E,
        blocks: u64,
        cached: &mut CachedBoltzmann,
        rng: &mut dyn Rng,
    ) -> Result<Option<Record>, Error> {
        // Makes all weights from the values alone: nothing of the blocks before is left in them.
        cached.set_temperature(self.policy.temperature())?;
        let (place, every) = (self.course.tally.actions, self.course.record_every.get());
        let mut actor = Blocked {
            cached,
            alpha: self.learner.alpha(0),
            by_visits: self.learner.is_by_visits(),
            gamma: self.learner.gamma(),
            learner: &mut self.learner,
            policy: &mut self.policy,
        };
        let most = block_end(place, every, blocks) - place;
        let whole = Until::Episodes(u64::MAX);
        self.course.run(environment, &mut actor, whole, most, rng)
    }
}

/// Returns the end of the block that an action, below `actions`, belongs to. More blocks than
/// actions would be empty ones, and are not made.
fn block_end(action: u64, actions: u64, blocks: u64) -> u64 {
    let blocks = blocks.min(actions);
    let [action, actions, blocks] = [action, actions, blocks].map(u128::from);
    // The last block whose first action is not beyond this one.
    let block = ((action + 1) * blocks).div_ceil(actions) - 1;
    (actions * (block + 1) / blocks) as u64
}

/// Q-learning on cached weights.
struct Blocked<'a> {
    cached: &'a mut CachedBoltzmann,
    learner: &'a mut QLearning,
    policy: &'a mut Boltzmann,
    gamma: f64,
    /// α of the block.
    alpha: f64,
    by_visits: bool,
}

impl Actor for Blocked<'_> {
    fn begin_episode(&mut self) {
        self.learner.begin_episode();
        self.policy.begin_episode();
    }

    fn meet<E: Environment + ?Sized>(&mut self, _: &E, state: State) -> Result<(), Error> {
        self.cached.check_state(state)
    }

    #[inline]
    fn choose(
        &mut self,
        state: State,
        _before: Option<Action>,
        rng: &mut dyn Rng,
    ) -> Result<Action, Error> {
        self.cached.check_state(state)?;
        Ok(self.cached.choose(state, rng))
    }

    #[inline]
    fn learn(
        &mut self,
        state: State,
        action: Action,
        step: Step,
        _rng: &mut dyn Rng,
    ) -> Result<(f64, Option<Action>), Error> {
        let alpha = match self.by_visits {
            false => self.alpha,
            true => self.learner.alpha(self.cached.visits(state, action)),
        };
        let error = self
            .cached
            .update(state, action, &step, alpha, self.gamma)?;
        self.learner.tick();
        self.policy.tick();
        Ok((error, None))
    }
}

#[cfg(test)]
mod tests {
    use super::block_end;

    #[test]
    fn blocks_follow_each_other_without_a_gap() {
        for (actions, blocks) in [
            (1, 1),
            (1, 9),
            (10, 3),
            (10, 10),
            (7, 100),
            (1000, 17),
            (17, 16),
        ] {
            let (mut at, mut made) = (0, 0);
            while at < actions {
                let to = block_end(at, actions, blocks);
                for inside in at..to {
                    assert_eq!(block_end(inside, actions, blocks), to);
                }
                (at, made) = (to, made + 1);
            }
            assert_eq!((at, made), (actions, blocks.min(actions)));
        }
        assert_eq!(block_end(u64::MAX - 1, u64::MAX, u64::MAX), u64::MAX);
    }
}
