//! States, actions, and the answer of an environment to an action.

/// Index of a state, `0..states`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct State(pub usize);

/// Index of an action, `0..actions`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Action(pub usize);

/// State of an episode after a step.
///
/// Learners treat the two endings differently: no value follows a termination, while a truncation
/// only stops the clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Status {
    /// The episode goes on.
    Continuing,
    /// The task ended, in success or failure. The value of what follows is 0.
    Terminated,
    /// The episode was cut short from outside, for example by a time limit. A learner still counts
    /// the value of the observed state.
    Truncated,
}

/// Answer of an environment to an action.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// State that the action led to, also when the episode ended there.
    pub observation: State,
    /// Immediate reward, finite.
    pub reward: f64,
    /// State of the episode.
    pub status: Status,
}

impl Step {
    /// Creates a step from its parts.
    pub fn new(observation: State, reward: f64, status: Status) -> Self {
        Self {
            observation,
            reward,
            status,
        }
    }
}
