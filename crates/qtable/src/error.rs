//! What can go wrong between a table, a policy, a learner and an environment.

use crate::index::{Action, State};

/// An error of tables, models, policies, learners and training. Whatever failed: a table never
/// holds a value that is not finite.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A table, mask or model without a single state or action.
    #[error("a table of {states} states and {actions} actions is empty: both must be at least 1")]
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
    /// Two things that must have the same number of states and actions have not.
    #[error(
        "{what} has {found_states} states and {found_actions} actions, but {states} and {actions} are needed"
    )]
    ShapeMismatch {
        /// What has the wrong shape, for example `"the table"`.
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
    /// Stored numbers of the wrong count, as a damaged or hand-made file may hold.
    #[error("{what} holds {found} entries where its shape needs {needed}")]
    WrongLength {
        /// What has the wrong length.
        what: &'static str,
        /// Entries needed.
        needed: usize,
        /// Entries found.
        found: usize,
    },
    /// A state index outside the table, as an environment with a fault may report.
    #[error("state {} is outside 0..{states}", state.0)]
    StateOutOfRange {
        /// The state.
        state: State,
        /// Number of states.
        states: usize,
    },
    /// An action index outside the table, as a policy with a fault may choose.
    #[error("action {} is outside 0..{actions}", action.0)]
    ActionOutOfRange {
        /// The action.
        action: Action,
        /// Number of actions.
        actions: usize,
    },
    /// An action that the mask does not allow in this state.
    #[error("action {} is not allowed in state {}", action.0, state.0)]
    ActionNotAllowed {
        /// The state.
        state: State,
        /// The action.
        action: Action,
    },
    /// A state whose mask allows nothing.
    #[error("state {} allows no action: a mask must leave at least one", state.0)]
    NoActionAllowed {
        /// The state.
        state: State,
    },
    /// A reward that is NaN or infinite. Typical cause: a division by a distance that became zero.
    #[error("the reward for action {} in state {} is {reward}: it must be finite", action.0, state.0)]
    RewardNotFinite {
        /// The state the action was taken in.
        state: State,
        /// The action.
        action: Action,
        /// The reward as reported.
        reward: f64,
    },
    /// A value that would not be finite in the table: NaN, infinite, or too large for a table of
    /// `f32`.
    #[error("the value of action {} in state {} would become {value}: it must stay finite", action.0, state.0)]
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
    /// A schedule that leaves the range of the quantity it is for.
    #[error("the schedule for {name} runs from {low} to {high}, but must stay {expected}")]
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
    /// A learner that learns from the next action was not given one: its policy must choose in the
    /// observed state before the update.
    #[error("the learner needs the action chosen next in state {}, but none was given", state.0)]
    NextActionMissing {
        /// The observed state.
        state: State,
    },
    /// A learner that needs the policy's probabilities met a policy that cannot tell them.
    #[error("the learner needs the probabilities of the policy, which this policy cannot tell")]
    NoProbabilities,
    /// Probabilities of a model that are not a distribution.
    #[error(
        "the outcomes of action {} in state {} have probabilities that sum to {sum}: each must lie in 0..=1 and the \
         sum be 1",
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
        /// Largest change of the last one.
        change: f64,
    },
    /// A letter in the map of a frozen lake that stands for nothing.
    #[error("row {row}, column {column} of the map is {letter:?}: it must be S, F, H or G")]
    MapLetter {
        /// The letter.
        letter: char,
        /// Its row, counted from 0.
        row: usize,
        /// Its column, counted from 0.
        column: usize,
    },
    /// A schedule that is not valid in itself.
    #[error(transparent)]
    Schedule(#[from] ScheduleError),
}

/// A schedule that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ScheduleError {
    /// A value that is NaN or infinite.
    #[error("a schedule value is {value}: it must be finite")]
    NotFinite {
        /// The value.
        value: f64,
    },
    /// An exponential schedule through zero or a negative value.
    #[error("an exponential schedule goes from {start} to {end}: both must be positive")]
    NotPositive {
        /// Value at step 0.
        start: f64,
        /// Last value.
        end: f64,
    },
    /// A change within no steps.
    #[error("a schedule that changes needs at least one step to do so")]
    NoSteps,
    /// A scale that is not a positive number.
    #[error("the scale is {scale} visits: it must be positive and finite")]
    Scale {
        /// The scale.
        scale: f64,
    },
    /// A piecewise schedule without points.
    #[error("a piecewise schedule needs at least one point")]
    NoPoints,
    /// Points that do not ascend.
    #[error("point {index} is at step {step}, not after the one before it")]
    PointsNotAscending {
        /// Position among the points.
        index: usize,
        /// Its step.
        step: u64,
    },
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

/// Refuses a count of 0.
pub(crate) fn check_count(name: &'static str, count: u64) -> Result<(), Error> {
    check_setting(name, count as f64, count > 0, "at least 1")
}
