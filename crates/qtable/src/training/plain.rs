//! Training with Q-learning and Boltzmann exploration, as the paper does it, in its plain form.

use rand::Rng;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::{Error, check_count};
use crate::learner::QLearning;
use crate::policy::Boltzmann;
use crate::problem::Environment;
use crate::schedule::Schedule;
use crate::table::{QTable, Value};
use crate::training::course::{Course, Pair, fit};
use crate::training::curve::Record;

/// Settings of [`train`] and [`train_in_blocks`](crate::train_in_blocks).
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct TrainConfig {
    /// Discount factor γ \[0.9\], in `0..=1`. Near 0 only the next reward counts; at 1 an episode
    /// without end has no finite value.
    pub gamma: f64,
    /// Learning rate α over the actions taken \[[`Schedule::paper_alpha`]\], within `0..=1`.
    pub alpha: Schedule,
    /// Temperature T of the Boltzmann policy over the actions taken, in units of the values
    /// \[[`Schedule::paper_temperature`]\], within `1e-6..=1e6`. High: every action alike; low: the
    /// best one.
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
    /// The paper's settings (section 4) for a number of actions: γ = 0.9, α from 0.6, T from 1000;
    /// 60 actions to an episode; 100 records.
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

    /// A course with these settings, or the one that is out of range.
    pub(crate) fn check(&self) -> Result<Course, Error> {
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
/// The table may hold knowledge from before. It must have the environment's shape; if the
/// environment restricts its actions, the table takes over the mask. `on_progress` is called at
/// every record.
///
/// # Errors
/// A setting out of range, a table of the wrong shape, or a fault of the environment (state out of
/// range, reward not finite). After the last, the table keeps what was learned before.
///
/// [`Training`](crate::Training) does the same with any learner and policy, in pieces that can be
/// saved between.
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
    let mut curve = Vec::new();
    let mut reporter = Reporter {
        of: config.actions,
        curve: &mut curve,
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
        reporter.after_action(&mut course, due);
    }
    Ok(TrainReport {
        actions: course.actions,
        episodes: course.episodes,
        curve,
    })
}

/// Adds to the learning curve and tells of it.
pub(crate) struct Reporter<'a> {
    /// Actions to take in all.
    pub(crate) of: u64,
    pub(crate) curve: &'a mut Vec<Record>,
    pub(crate) on_progress: &'a mut dyn FnMut(&Progress),
}

impl Reporter<'_> {
    #[inline]
    pub(crate) fn after_action(&mut self, course: &mut Course, due: Option<Record>) {
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
}
