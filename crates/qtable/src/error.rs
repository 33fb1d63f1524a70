//! Errors of tables, schedules, policies, learners, models, environments and training.

use std::num::NonZeroU64;

use crate::step::{Action, State, Step};

/// An error of this crate. After it, a table still holds finite values only.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A table, mask or model without a single state or action.
    #[error("{states} states and {actions} actions make an empty table: both must be at least 1")]
    EmptyShape {
        /// States asked for.
        states: usize,
        /// Actions asked for.
        actions: usize,
    },
    /// A table that does not fit into memory, or whose action index does not fit into 32 bits.
    #[error("a table of {states} states and {actions} actions is too large for this machine")]
    TooLarge {
        /// States asked for.
        states: usize,
        /// Actions asked for.
        actions: usize,
    },
    /// Two objects that need the same number of states and actions and differ.
    #[error(
        "{what} has {found_states} states and {found_actions} actions, \
         but {states} and {actions} are needed"
    )]
    ShapeMismatch {
        /// The object with the wrong shape, for example `"the environment"`.
        what: &'static str,
        /// States needed.
        states: usize,
        /// Actions needed.
        actions: usize,
        /// States found.
        found_states: usize,
        /// Actions found.
        found_actions: usize,
    },
    /// A list of the wrong length, as a damaged or hand-made file may hold.
    #[error("{what} holds {found} entries, but {needed} are needed")]
    WrongLength {
        /// The list.
        what: &'static str,
        /// Entries needed.
        needed: usize,
        /// Entries found.
        found: usize,
    },
    /// A state index outside the table. Typical cause: an environment that reports more states than
    /// it counts.
    #[error("state {} is outside 0..{states}", state.0)]
    StateOutOfRange {
        /// The state.
        state: State,
        /// Number of states.
        states: usize,
    },
    /// An action index outside the table. Typical cause: a policy for another environment.
    #[error("action {} is outside 0..{actions}", action.0)]
    ActionOutOfRange {
        /// The action.
        action: Action,
        /// Number of actions.
        actions: usize,
    },
    /// An action that the mask forbids in this state.
    #[error("action {} is not allowed in state {}", action.0, state.0)]
    ActionNotAllowed {
        /// The state.
        state: State,
        /// The action.
        action: Action,
    },
    /// A state without actions in which an episode goes on.
    #[error("state {} offers no action, but the episode goes on there", state.0)]
    NoActionAllowed {
        /// The state.
        state: State,
    },
    /// A reward that is NaN or infinite. Typical cause: a division by a distance that became zero.
    #[error(
        "the reward of action {} in state {} is {reward}: it must be finite",
        action.0,
        state.0
    )]
    RewardNotFinite {
        /// The state the action was taken in.
        state: State,
        /// The action.
        action: Action,
        /// The reward as reported.
        reward: f64,
    },
    /// A value that is NaN or infinite, or that a cached table cannot hold as `f32`.
    #[error(
        "the value of action {} in state {} would be {value}: it must be finite",
        action.0,
        state.0
    )]
    ValueNotFinite {
        /// The state.
        state: State,
        /// The action.
        action: Action,
        /// The value that was refused.
        value: f64,
    },
    /// A setting outside its range.
    #[error("{name} is {value}, but must be {expected}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// The value given.
        value: f64,
        /// The range in words.
        expected: &'static str,
    },
    /// A schedule that leaves the range of its quantity.
    #[error("the schedule of {name} runs from {low} to {high}, but must stay {expected}")]
    ScheduleRange {
        /// The quantity, for example `"alpha"`.
        name: &'static str,
        /// Smallest value of the schedule.
        low: f64,
        /// Largest value of the schedule.
        high: f64,
        /// The range in words.
        expected: &'static str,
    },
    /// Steps of a schedule or edges of intervals that do not ascend.
    #[error("{what} {index} is {value}, which is not above {before} before it")]
    NotAscending {
        /// The kind of list element, for example `"edge"`.
        what: &'static str,
        /// Position in the list.
        index: usize,
        /// The element.
        value: f64,
        /// The element before it.
        before: f64,
    },
    /// A bin outside the intervals.
    #[error("bin {bin} is outside 0..{bins}")]
    BinOutOfRange {
        /// The bin.
        bin: usize,
        /// Number of bins.
        bins: usize,
    },
    /// A quantity that is NaN and so lies in no interval.
    #[error("quantity {quantity} is NaN, which lies in no interval")]
    NotANumber {
        /// Position among the quantities of a product, 0 for plain intervals.
        quantity: usize,
    },
    /// A learner that needs the next action was not given one. The policy must choose it before the
    /// update.
    #[error("the learner needs the action chosen next in state {}, but none was given", state.0)]
    NextActionMissing {
        /// The observed state.
        state: State,
    },
    /// A learner that needs the policy's probabilities met a policy that does not tell them.
    #[error("the learner needs the probabilities of the policy, which this policy does not tell")]
    NoProbabilities,
    /// Probabilities of a model that are not a distribution.
    #[error(
        "the outcomes of action {} in state {} have probabilities that sum to {sum}: \
         each must lie in 0..=1 and the sum be 1",
        action.0,
        state.0
    )]
    NotADistribution {
        /// The state.
        state: State,
        /// The action.
        action: Action,
        /// Sum of the probabilities.
        sum: f64,
    },
    /// A computation that did not settle. Typical cause: γ = 1 with a policy that never reaches an
    /// end.
    #[error("no convergence after {sweeps} sweeps: the last one still changed a value by {change}")]
    NotConverged {
        /// Sweeps done.
        sweeps: u64,
        /// Largest change of the last sweep.
        change: f64,
    },
    /// A letter in the map of a frozen lake that has no meaning.
    #[error("row {row}, column {column} of the map is {letter:?}: it must be S, F, H or G")]
    MapLetter {
        /// The letter.
        letter: char,
        /// Its row, counted from 0.
        row: usize,
        /// Its column, counted from 0.
        column: usize,
    },
    /// A line of a CSV text that is no part of a table.
    #[error("line {line} of the CSV text: {problem}")]
    Csv {
        /// The line, counted from 1.
        line: u64,
        /// The problem and what is expected instead.
        problem: String,
    },
    /// A learner that keeps knowledge of its own met another table than the one it was made for, or
    /// a table that was changed by hand.
    #[error(
        "the learner was made for another table (they differ at action {} of state {}): \
         make a learner for each table",
        action.0,
        state.0
    )]
    OtherTable {
        /// The state.
        state: State,
        /// The action.
        action: Action,
    },
    /// A failure inside an environment, for example a lost connection.
    #[error("the environment failed: {0}")]
    Environment(String),
    /// An environment whose shape or mask is another one than at first.
    #[error("after {steps} steps {what} of the environment is not what it was at first")]
    EnvironmentChanged {
        /// Steps taken before.
        steps: u64,
        /// The changed property.
        what: &'static str,
    },
    /// An episode that differs when repeated with its seed and its actions. Typical causes: `reset`
    /// keeps something of the episode before, or randomness that does not come from the generator
    /// handed in.
    #[error("step {step} of an episode differs when repeated: {first:?}, then {second:?}")]
    NotReproducible {
        /// Number of the step within the episode; 0 is the reset.
        step: u64,
        /// The first time.
        first: Step,
        /// The second time.
        second: Step,
    },
    /// No episode ended, neither by termination nor by truncation. Training then needs an episode
    /// limit; a task without an end is no fault.
    #[error("no episode ended within {steps} steps: training needs an episode limit")]
    Endless {
        /// Steps taken.
        steps: u64,
    },
}

impl Error {
    /// Makes an error of an environment's own failure, to return from
    /// [`Environment::step`](crate::Environment::step).
    pub fn environment(cause: impl std::fmt::Display) -> Self {
        Self::Environment(cause.to_string())
    }
}

/// Checks a setting against a range given in words.
pub(crate) fn check_setting(
    name: &'static str,
    value: f64,
    valid: bool,
    expected: &'static str,
) -> Result<(), Error> {
    if valid {
        Ok(())
    } else {
        Err(Error::Setting {
            name,
            value,
            expected,
        })
    }
}

/// Checks a discount factor γ.
pub(crate) fn check_gamma(gamma: f64) -> Result<(), Error> {
    check_setting("gamma", gamma, (0.0..=1.0).contains(&gamma), "in 0..=1")
}

/// Refuses a reward that is not finite.
#[inline(always)]
pub(crate) fn check_reward(state: State, action: Action, reward: f64) -> Result<(), Error> {
    if reward.is_finite() {
        return Ok(());
    }
    Err(Error::RewardNotFinite {
        state,
        action,
        reward,
    })
}

/// Refuses a count of 0.
pub(crate) fn positive(name: &'static str, count: u64) -> Result<NonZeroU64, Error> {
    let refused = Error::Setting {
        name,
        value: 0.0,
        expected: "at least 1",
    };
    NonZeroU64::new(count).ok_or(refused)
}
