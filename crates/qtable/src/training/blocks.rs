//! Training with Q-learning and Boltzmann exploration, fast: in blocks of constant temperature on
//! cached weights.

use rand::Rng;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::{Error, check_count};
use crate::index::{Action, State};
use crate::problem::{Environment, Step};
use crate::schedule::Schedule;
use crate::table::{QTable, Value};
use crate::training::cached::CachedBoltzmann;
use crate::training::course::{Actor, Course, fit};
use crate::training::curve::Record;
use crate::training::plain::{Progress, Reporter, TrainConfig, TrainReport};
use crate::validated::validated;

/// Learns a table as [`train`](crate::train) does, several times faster: α and the temperature
/// stand still within each of `blocks` equal parts of the run, at what their schedules say of its
/// first action, and the actions are drawn from a [`CachedBoltzmann`].
///
/// With 256 to 1024 blocks nothing of the course of the schedules is lost. (An α by visits changes
/// at every visit all the same.) Values are kept in `f32` while it runs and written back at the
/// end, also after an error. It is generic over environment and generator, so that a compiler that
/// optimises across crates (`lto = "fat"`) can put the whole loop together. The result is another
/// one than that of [`train`](crate::train) from the same seed, drawn from the same distribution
/// but for the steps of the schedules.
///
/// [`TrainingInBlocks`] is the same run in pieces that can be saved between.
///
/// # Errors
/// As [`train`](crate::train); also for `blocks` of 0, and for values that do not fit into an
/// `f32`.
pub fn train_in_blocks<V: Value, E: Environment + ?Sized, R: Rng>(
    environment: &mut E,
    table: &mut QTable<V>,
    config: &TrainConfig,
    blocks: u64,
    rng: &mut R,
    on_progress: &mut dyn FnMut(&Progress),
) -> Result<TrainReport, Error> {
    let mut training = TrainingInBlocks::new(environment, table.clone(), config.clone(), blocks)?;
    let outcome = training.run(environment, config.actions, rng, on_progress);
    *table = training.table;
    outcome.map(|()| TrainReport {
        actions: training.course.actions,
        episodes: training.course.episodes,
        curve: training.curve,
    })
}

/// A run of [`train_in_blocks`] that can stop between two blocks, be saved, and go on.
///
/// Environment and generator are the caller's and are handed to every call. A run that is stopped,
/// saved together with these two, loaded and continued, ends in the same bits as one that was never
/// stopped. The cached weights are not saved: each block begins by making them from the table.
///
#[cfg_attr(feature = "serde", doc = "```")]
#[cfg_attr(not(feature = "serde"), doc = "```ignore")]
/// use qtable::{QTable, TrainConfig, TrainingInBlocks, decode, encode, toys};
/// use rand::{SeedableRng, rngs::Xoshiro256PlusPlus};
///
/// let mut chain = toys::chain(6)?; let mut rng = Xoshiro256PlusPlus::seed_from_u64(1); let mut
/// training = TrainingInBlocks::new(&chain, QTable::new(6, 2)?, TrainConfig::paper(20_000), 400)?;
/// training.run(&mut chain, 7_001, &mut rng, &mut |_| {})?; assert_eq!(training.actions(), 7_050);
/// // the end of a block
///
/// let saved = encode("chain-training/1", &(&training, &chain, &rng))?; let (mut resumed, mut
/// same_chain, mut same_rng) = (training.clone(), chain.clone(), rng.clone()); (resumed,
/// same_chain, same_rng) = decode("chain-training/1", &saved)?;
///
/// training.run(&mut chain, u64::MAX, &mut rng, &mut |_| {})?;
/// resumed.run(&mut same_chain, u64::MAX, &mut same_rng, &mut |_| {})?;
/// assert_eq!(training.actions(), 20_000);
/// assert_eq!(training, resumed);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(Serialize, Deserialize),
    serde(
        remote = "Self",
        bound(serialize = "V: Serialize", deserialize = "V: Deserialize<'de>")
    )
)]
pub struct TrainingInBlocks<V: Value = f64> {
    table: QTable<V>,
    config: TrainConfig,
    blocks: u64,
    course: Course,
    curve: Vec<Record>,
}

impl<V: Value> TrainingInBlocks<V> {
    /// With a table, which may hold knowledge from before. If the environment restricts its
    /// actions, the table takes over the mask.
    ///
    /// # Errors
    /// A setting out of range, `blocks` of 0, or a table of the wrong shape.
    pub fn new<E: Environment + ?Sized>(
        environment: &E,
        mut table: QTable<V>,
        config: TrainConfig,
        blocks: u64,
    ) -> Result<Self, Error> {
        fit(environment, &mut table)?;
        Self {
            table,
            course: config.check()?,
            config,
            blocks,
            curve: Vec::new(),
        }
        .restore()
    }

    /// Trains to the end of the block in which a total of `actions` is reached, or to the end of
    /// the run; not at all if it is there already. `on_progress` is called at every record.
    ///
    /// # Errors
    /// An environment of another shape or with a fault (state out of range, reward not finite), or
    /// values that do not fit into an `f32`. What was learned before stays; the episode is given
    /// up.
    pub fn run<E: Environment + ?Sized, R: Rng>(
        &mut self,
        environment: &mut E,
        actions: u64,
        rng: &mut R,
        on_progress: &mut dyn FnMut(&Progress),
    ) -> Result<(), Error> {
        let Self {
            table,
            config,
            blocks,
            course,
            curve,
        } = self;
        table.check_shape(
            "the environment",
            environment.states(),
            environment.actions(),
        )?;
        let until = actions.min(config.actions);
        if course.actions >= until {
            return Ok(());
        }
        let by_visits =
            matches!(config.alpha, Schedule::InverseVisits { .. }).then_some(&config.alpha);
        let mut actor = Blocked {
            cached: CachedBoltzmann::new(table, config.temperature.at(course.actions))?,
            gamma: config.gamma,
            alpha: 0.0,
            by_visits,
        };
        let mut reporter = Reporter {
            of: config.actions,
            curve,
            on_progress,
        };
        let mut run = || {
            while course.actions < until {
                let (from, to) = block_around(course.actions, config.actions, *blocks);
                actor.alpha = config.alpha.at(from);
                // Makes all weights from the values alone: nothing of the blocks before is left in
                // them.
                actor.cached.set_temperature(config.temperature.at(from))?;
                while course.actions < to {
                    let due = course.step(environment, &mut actor, rng)?;
                    reporter.after_action(course, due);
                }
            }
            Ok(())
        };
        let outcome = run();
        actor.cached.write_to(table)?;
        outcome
    }

    /// The table.
    pub fn table(&self) -> &QTable<V> {
        &self.table
    }

    /// The settings.
    pub fn config(&self) -> &TrainConfig {
        &self.config
    }

    /// The learning curve so far, oldest record first.
    pub fn curve(&self) -> &[Record] {
        &self.curve
    }

    /// Actions taken so far.
    pub fn actions(&self) -> u64 {
        self.course.actions
    }

    /// Episodes ended so far.
    pub fn episodes(&self) -> u64 {
        self.course.episodes
    }

    /// Whether an episode is going on, so that the environment's own state belongs to the state of
    /// the run.
    pub fn is_in_episode(&self) -> bool {
        self.course.is_in_episode()
    }

    /// The table alone.
    pub fn into_table(self) -> QTable<V> {
        self.table
    }

    fn restore(self) -> Result<Self, Error> {
        self.config.check()?;
        check_count("blocks", self.blocks)?;
        Ok(self)
    }
}

validated!(TrainingInBlocks<V: Value>);

/// The first action of the block that an action, below `actions`, belongs to, and the one after its
/// last. More blocks than actions would be empty ones, and are not made.
fn block_around(action: u64, actions: u64, blocks: u64) -> (u64, u64) {
    let blocks = blocks.min(actions);
    let [action, actions, blocks] = [action, actions, blocks].map(u128::from);
    let edge = |block| (actions * block / blocks) as u64;
    // The last one whose first action is not beyond it.
    let block = ((action + 1) * blocks).div_ceil(actions) - 1;
    (edge(block), edge(block + 1))
}

/// Q-learning on cached weights.
struct Blocked<'a> {
    cached: CachedBoltzmann,
    gamma: f64,
    /// α of the block.
    alpha: f64,
    /// The schedule of α, if it goes by visits.
    by_visits: Option<&'a Schedule>,
}

impl Actor for Blocked<'_> {
    /// Draws anew: nothing is ever chosen before.
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
            None => self.alpha,
            Some(schedule) => schedule.at_visit(0, u64::from(self.cached.visits(state, action))),
        };
        Ok((
            self.cached
                .update(state, action, &step, alpha, self.gamma)?,
            None,
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::block_around;

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
                let (from, to) = block_around(at, actions, blocks);
                assert_eq!(from, at);
                for inside in from..to {
                    assert_eq!(block_around(inside, actions, blocks), (from, to));
                }
                (at, made) = (to, made + 1);
            }
            assert_eq!((at, made), (actions, blocks.min(actions)));
        }
        assert_eq!(
            block_around(u64::MAX - 1, u64::MAX, u64::MAX),
            (u64::MAX - 1, u64::MAX)
        );
    }
}
