//! Training with Q-learning and Boltzmann exploration, as the paper does it: plainly, and fast.

use rand::Rng;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::course::{Actor, Course, Pair, check_count, fit};
use crate::{
    Action, Boltzmann, CachedBoltzmann, Environment, Error, QLearning, QTable, Record, Schedule, State, Step,
    Value,
};

/// Settings of [`train`].
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct TrainConfig {
    /// Discount factor γ \[0.9\], in `0..=1`. Near 0 only the next reward counts; at 1 an episode without end has
    /// no finite value.
    pub gamma: f64,
    /// Learning rate α over the actions taken \[[`Schedule::paper_alpha`]\], within `0..=1`.
    pub alpha: Schedule,
    /// Temperature T of the Boltzmann policy over the actions taken, in units of the values
    /// \[[`Schedule::paper_temperature`]\], within `1e-6..=1e6`. High: every action alike; low: the best one.
    pub temperature: Schedule,
    /// Actions to take in all, at least 1.
    pub actions: u64,
    /// Actions after which an episode is truncated \[60\], at least 1.
    pub episode_limit: u64,
    /// Actions from one record of the learning curve to the next \[a hundredth of all\], at least 1. The last
    /// record is made at the end, whenever that is.
    pub record_every: u64,
}

impl TrainConfig {
    /// The paper's settings (section 4) for a number of actions: γ = 0.9, α from 0.6, T from 1000; 60 actions to an
    /// episode; 100 records.
    pub fn paper(actions: u64) -> Self {
        Self {
            gamma: 0.9,
            alpha: Schedule::paper_alpha(actions),
            temperature: Schedule::paper_temperature(actions),
            actions,
            episode_limit: 60,
            record_every: actions.div_ceil(100).max(1),
        }
    }

    /// Refuses settings out of range.
    fn check(&self) -> Result<Course, Error> {
        check_count("actions", self.actions)?;
        QLearning::new(self.alpha.clone(), self.gamma)?;
        Boltzmann::check_temperature(&self.temperature)?;
        Course::new(self.episode_limit, self.record_every)
    }
}

/// How far a training run is, handed to its callback at every record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Actions taken so far.
    pub actions: u64,
    /// Actions to take in all.
    pub of: u64,
    /// The record just made.
    pub latest: Record,
}

/// What a training run did.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct TrainReport {
    /// Actions taken.
    pub actions: u64,
    /// Episodes ended.
    pub episodes: u64,
    /// The learning curve, oldest record first.
    pub curve: Vec<Record>,
}

/// Learns a table on an environment with one-step Q-learning and a Boltzmann policy.
///
/// The table may hold knowledge from before. It must have the environment's shape; if the environment restricts
/// its actions, the table takes over the mask. `on_progress` is called at every record.
///
/// # Errors
/// A setting out of range, a table of the wrong shape, or a fault of the environment (state out of range, reward
/// not finite). After the last, the table keeps what was learned before.
///
/// [`Training`](crate::Training) does the same with any learner and policy, in pieces that can be saved between.
pub fn train<V: Value>(
    environment: &mut dyn Environment,
    table: &mut QTable<V>,
    config: &TrainConfig,
    rng: &mut dyn Rng,
    on_progress: &mut dyn FnMut(&Progress),
) -> Result<TrainReport, Error> {
    let mut course = config.check()?;
    let learner = &mut QLearning::new(config.alpha.clone(), config.gamma)?;
    let policy = &mut Boltzmann::new(config.temperature.clone())?;
    fit(environment, table)?;
    let mut report = Reporter {
        of: config.actions,
        curve: Vec::new(),
        on_progress,
    };
    while course.actions < config.actions {
        let due = course.step(
            environment,
            &mut Pair {
                table,
                learner,
                policy,
            },
            rng,
        )?;
        report.after_action(&mut course, due);
    }
    Ok(report.finish(&course))
}

/// Learns a table as [`train`] does, several times faster: α and the temperature stand still within each of `blocks`
/// equal parts of the run, at what their schedules say of its first action, and the actions are drawn from a
/// [`CachedBoltzmann`].
///
/// With 256 to 1024 blocks nothing of the course of the schedules is lost. (An α by visits changes at every visit all
/// the same.) Values are kept in `f32` while it runs and written back at the end, also after an error. It is
/// generic over environment and generator, so that a compiler that optimises across crates (`lto = "fat"`) can put
/// the whole loop together. The result is another one than that of [`train`] from the same seed, drawn from the same
/// distribution but for the steps of the schedules.
///
/// # Errors
/// As [`train`]; also for `blocks` of 0, and for values that do not fit into an `f32`.
pub fn train_in_blocks<V: Value, E: Environment + ?Sized, R: Rng>(
    environment: &mut E,
    table: &mut QTable<V>,
    config: &TrainConfig,
    blocks: u64,
    rng: &mut R,
    on_progress: &mut dyn FnMut(&Progress),
) -> Result<TrainReport, Error> {
    let mut course = config.check()?;
    check_count("blocks", blocks)?;
    fit(environment, table)?;
    let cached = CachedBoltzmann::new(table, config.temperature.at(0))?;
    let by_visits = matches!(config.alpha, Schedule::InverseVisits { .. }).then_some(&config.alpha);
    let mut actor = Blocked {
        cached,
        gamma: config.gamma,
        alpha: 0.0,
        by_visits,
    };
    let mut report = Reporter {
        of: config.actions,
        curve: Vec::new(),
        on_progress,
    };
    // More blocks than actions would be empty ones.
    let blocks = blocks.min(config.actions);
    let mut run = || {
        for block in 0..blocks {
            let edge =
                |block: u64| (u128::from(config.actions) * u128::from(block) / u128::from(blocks)) as u64;
            let (from, to) = (edge(block), edge(block + 1));
            actor.alpha = config.alpha.at(from);
            actor.cached.set_temperature(config.temperature.at(from))?;
            while course.actions < to {
                let due = course.step(environment, &mut actor, rng)?;
                report.after_action(&mut course, due);
            }
        }
        Ok(())
    };
    let outcome = run();
    actor.cached.write_to(table)?;
    outcome.map(|()| report.finish(&course))
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
    fn choose(&mut self, state: State, _before: Option<Action>, rng: &mut dyn Rng) -> Result<Action, Error> {
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
        Ok((self.cached.update(state, action, &step, alpha, self.gamma)?, None))
    }
}

/// Collects the learning curve and tells of it.
struct Reporter<'a> {
    of: u64,
    curve: Vec<Record>,
    on_progress: &'a mut dyn FnMut(&Progress),
}

impl Reporter<'_> {
    #[inline]
    fn after_action(&mut self, course: &mut Course, due: Option<Record>) {
        if due.is_some() || course.actions == self.of {
            let latest = due.unwrap_or_else(|| course.record());
            self.curve.push(latest);
            (self.on_progress)(&Progress {
                actions: course.actions,
                of: self.of,
                latest,
            });
        }
    }

    fn finish(self, course: &Course) -> TrainReport {
        TrainReport {
            actions: course.actions,
            episodes: course.episodes,
            curve: self.curve,
        }
    }
}
