//! Training with Q-learning and Boltzmann exploration, as the paper does it.

use rand::Rng;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::curve::{Record, Tally};
use crate::error::check_setting;
use crate::{
    ActionMask, Boltzmann, Environment, Error, Policy, QLearning, QTable, Schedule, State, Status, Value,
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
pub fn train<V: Value>(
    environment: &mut dyn Environment,
    table: &mut QTable<V>,
    config: &TrainConfig,
    rng: &mut dyn Rng,
    on_progress: &mut dyn FnMut(&Progress),
) -> Result<TrainReport, Error> {
    let positive = |name, value: u64| check_setting(name, value as f64, value > 0, "at least 1");
    positive("actions", config.actions)?;
    positive("episode_limit", config.episode_limit)?;
    positive("record_every", config.record_every)?;
    let mut learner = QLearning::new(config.alpha.clone(), config.gamma)?;
    let mut policy = Boltzmann::new(config.temperature.clone())?;
    table.check_shape("the environment", environment.states(), environment.actions())?;
    if let Some(mask) = ActionMask::of(environment)? {
        table.set_mask(Some(mask))?;
    }

    let mut report = TrainReport::default();
    let mut tally = Tally::default();
    let mut episode: Option<(State, u64, f64)> = None;
    while report.actions < config.actions {
        let (state, steps, sum) = match episode.take() {
            Some(running) => running,
            None => (environment.reset(rng), 0, 0.0),
        };
        table.check_state(state)?;
        let action = policy.choose(table, state, rng);
        let mut step = environment.step(action, rng);
        let (steps, sum) = (steps + 1, sum + step.reward);
        if step.status == Status::Continuing && steps >= config.episode_limit {
            step.status = Status::Truncated;
        }
        let td_error = learner.update(table, state, action, &step)?;
        report.actions += 1;
        tally.add_action(step.reward, td_error);
        if step.status == Status::Continuing {
            episode = Some((step.observation, steps, sum));
        } else {
            report.episodes += 1;
            tally.add_episode(steps, sum, environment.succeeded(&step));
        }
        if report.actions.is_multiple_of(config.record_every) || report.actions == config.actions {
            let latest = std::mem::take(&mut tally).record(report.actions, report.episodes);
            report.curve.push(latest);
            on_progress(&Progress {
                actions: report.actions,
                of: config.actions,
                latest,
            });
        }
    }
    Ok(report)
}
