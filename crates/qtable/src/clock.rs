//! The time that schedules go by.

/// Actions taken and episodes begun so far.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Clock {
    pub(crate) actions: u64,
    episodes: u64,
    #[cfg_attr(feature = "serde", serde(skip))]
    pub(crate) block: Block,
}

/// Steps whose values a clock keeps.
pub(crate) const BLOCK: u64 = 64;

/// The values of a schedule at a first step and those after it. They follow from the schedule, so
/// two are always equal.
#[derive(Clone, Debug, Default)]
pub(crate) struct Block {
    pub(crate) first: u64,
    pub(crate) values: Vec<f64>,
}

impl PartialEq for Block {
    fn eq(&self, _other: &Self) -> bool {
        true
    }
}

impl Clock {
    /// Returns the step of a schedule by actions or by episodes.
    #[inline(always)]
    pub(crate) fn time(&self, by_episode: bool) -> u64 {
        match by_episode {
            true => self.episodes.saturating_sub(1),
            false => self.actions,
        }
    }

    /// Counts an action. Only a count from a file could wrap.
    #[inline(always)]
    pub(crate) fn tick(&mut self) {
        self.actions = self.actions.wrapping_add(1);
    }

    /// Counts an episode that begins.
    #[inline(always)]
    pub(crate) fn begin_episode(&mut self) {
        self.episodes = self.episodes.saturating_add(1);
    }
}
