//! The learning curve.

/// One point of a learning curve. Counts are totals since the start; fractions and means are over
/// the actions and the ended episodes since the record before, and `None` where there were none.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Record {
    /// Actions taken so far.
    pub actions: u64,
    /// Episodes ended so far.
    pub episodes: u64,
    /// Fraction of the episodes that ended in success, `0..=1`; `None` if the environment does not
    /// tell ([`Environment::succeeded`](crate::Environment::succeeded)).
    pub success_share: Option<f64>,
    /// Mean reward of an action.
    pub mean_reward: Option<f64>,
    /// Mean sum of rewards, undiscounted, of an episode.
    pub mean_return: Option<f64>,
    /// Mean number of actions of an episode.
    pub mean_steps: Option<f64>,
    /// Mean size of the temporal-difference error of an action, before its update.
    pub mean_td_error: Option<f64>,
}

/// Sums between two records.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Tally {
    pub(super) actions: u64,
    reward: f64,
    td_error: f64,
    episodes: u64,
    successes: u64,
    /// Episodes of which the environment told whether they succeeded.
    judged: u64,
    episode_steps: u64,
    episode_returns: f64,
}

impl Tally {
    /// Adds what an action brought; the caller counts the actions.
    #[inline(always)]
    pub(super) fn add(&mut self, reward: f64, td_error: f64) {
        self.reward += reward;
        self.td_error += td_error.abs();
    }

    pub(super) fn add_episode(&mut self, steps: u64, sum: f64, success: Option<bool>) {
        self.episodes = self.episodes.saturating_add(1);
        self.episode_steps = self.episode_steps.saturating_add(steps);
        self.episode_returns += sum;
        self.successes = self
            .successes
            .saturating_add(u64::from(success == Some(true)));
        self.judged = self.judged.saturating_add(u64::from(success.is_some()));
    }

    /// Returns the record of what was added, at the totals given.
    pub(super) fn record(&self, actions: u64, episodes: u64) -> Record {
        let mean = |sum: f64, count: u64| (count > 0).then(|| sum / count as f64);
        Record {
            actions,
            episodes,
            success_share: mean(self.successes as f64, self.judged),
            mean_reward: mean(self.reward, self.actions),
            mean_return: mean(self.episode_returns, self.episodes),
            mean_steps: mean(self.episode_steps as f64, self.episodes),
            mean_td_error: mean(self.td_error, self.actions),
        }
    }
}
