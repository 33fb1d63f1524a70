//! Errors of tables, schedules, policies, learners, models, environments and training.

use std::num::NonZeroU64;

use crate::step::{Action, State, Step};

/// An error of this crate. After it, a table still holds finite values only.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A table or model without a state or action, or one that does not fit into memory or whose
    /// action index does not fit into 32 bits.
    #[error("{states} states and {actions} actions make {problem}")]
    Shape {
        /// Requested number of states.
        states: usize,
        /// Requested number of actions.
        actions: usize,
        /// The problem.
        problem: &'static str,
    },
    /// An object whose numbers of states and actions differ from those needed: its name, for
    /// example `"the environment"`, the numbers needed, and those found.
    #[error(
        "{what} has {} states and {} actions, but {} and {} are needed",
        .2.0, .2.1, .1.0, .1.1, what = .0
    )]
    ShapeMismatch(&'static str, (usize, usize), (usize, usize)),
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
    /// An index outside its range. Typical cause: an environment that reports more states than it
    /// counts, or a policy for another environment.
    #[error("{what} {index} is outside 0..{count}")]
    OutOfRange {
        /// The kind of index: `"state"`, `"action"` or `"bin"`.
        what: &'static str,
        /// The index.
        index: usize,
        /// Number of states, actions or bins.
        count: usize,
    },
    /// An action that the state does not offer.
    #[error("action {} is not allowed in state {}", .1.0, .0.0)]
    ActionNotAllowed(State, Action),
    /// The episode continues in a state that offers no action.
    #[error("state {} offers no action, but the episode goes on there", .0.0)]
    NoActionAllowed(State),
    /// A reward or a value that is NaN or infinite, or that a cached table cannot hold as `f32`.
    /// Typical causes: a division by a distance that became zero; rewards without bound at γ = 1.
    #[error(
        "the {what} of action {} in state {} is {value}: it must be finite",
        action.0,
        state.0
    )]
    NotFinite {
        /// `"reward"` or `"value"`.
        what: &'static str,
        /// The state the action was taken in.
        state: State,
        /// The action.
        action: Action,
        /// The number.
        value: f64,
    },
    /// A setting, or a value of a schedule, outside its range.
    #[error("{name} is {value}, but must be {expected}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// The value given.
        value: f64,
        /// The range in words.
        expected: &'static str,
    },
    /// Steps of a schedule or edges of intervals that do not ascend: their kind, for example
    /// `"edge"`, the position in the list, the element there and the one before it.
    #[error("{0} {1} is {2}, which is not above {3} before it")]
    NotAscending(&'static str, usize, f64, f64),
    /// A quantity that is NaN and so lies in no interval: its position among the quantities of a
    /// product, 0 for plain intervals.
    #[error("quantity {0} is NaN, which lies in no interval")]
    NotANumber(usize),
    /// A learner that needs the next action was not given that of the observed state. The policy
    /// must choose it before the update.
    #[error("the learner needs the action chosen next in state {}, but none was given", .0.0)]
    NextActionMissing(State),
    /// A learner that needs the policy's probabilities met a policy that does not tell them.
    #[error("the learner needs the probabilities of the policy, which this policy does not tell")]
    NoProbabilities,
    /// Outcomes of a model that are not a distribution, and the sum of their probabilities.
    #[error(
        "the outcomes of action {} in state {} have probabilities that sum to {sum}: \
         each must lie in 0..=1 and the sum be 1", .1.0, .0.0, sum = .2
    )]
    NotADistribution(State, Action, f64),
    /// A computation that did not settle: the sweeps done and the largest change of the last one.
    /// Typical cause: γ = 1 with a policy that never reaches an end.
    #[error("no convergence after {0} sweeps: the last one still changed a value by {1}")]
    NotConverged(u64, f64),
    /// A letter without meaning in the map of a frozen lake, its row and its column, from 0.
    #[error("row {1}, column {2} of the map is {0:?}: give 4x4, 8x8, or rows of S, F, H and G")]
    MapLetter(char, usize, usize),
    /// A line of a CSV text that is no part of a table: its number, counted from 1, the problem,
    /// and what is expected instead.
    #[error("line {0} of the CSV text: {1}")]
    Csv(u64, String),
    /// A learner that keeps knowledge of its own met another table than the one it was made for, or
    /// a table that was changed by hand.
    #[error(
        "the learner was made for another table (they differ at action {} of state {}): \
         make a learner for each table", .1.0, .0.0
    )]
    OtherTable(State, Action),
    /// A new key beyond the bound of its [`Keys`](crate::Keys).
    #[error("there are more than the {0} keys allowed: raise the bound, or merge states")]
    TooManyKeys(usize),
    /// A failure inside an environment, for example a lost connection.
    #[error("the environment failed: {0}")]
    Environment(String),
    /// An environment whose shape or mask changed after a number of steps, although it is not
    /// [dynamic](crate::Environment::is_dynamic).
    #[error("after {1} steps {0} of the environment is not what it was at first")]
    EnvironmentChanged(&'static str, u64),
    /// An episode that differs when repeated with its seed and its actions, from the numbered step
    /// on (0 is the reset). Typical causes: `reset` keeps something of the episode before, or
    /// randomness that does not come from the generator handed in.
    #[error("step {0} of an episode differs when repeated: {1:?}, then {2:?}")]
    NotReproducible(u64, Step, Step),
    /// No episode ended within a number of steps, neither by termination nor by truncation.
    /// Training then needs an episode limit; a task without an end is no fault.
    #[error("no episode ended within {0} steps: training needs an episode limit")]
    Endless(u64),
}

impl Error {
    /// Makes an error of an environment's own failure, to return from
    /// [`Environment::step`](crate::Environment::step).
    pub fn environment(cause: impl std::fmt::Display) -> Self {
        Self::Environment(cause.to_string())
    }

    /// Returns the error of a table too large for memory.
    pub(crate) fn too_large(states: usize, actions: usize) -> Self {
        let problem = "a table that is too large for this machine";
        Self::Shape {
            states,
            actions,
            problem,
        }
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
        return Ok(());
    }
    Err(Error::Setting {
        name,
        value,
        expected,
    })
}

/// Checks a setting that must be a fraction, such as a discount factor γ.
pub(crate) fn check_fraction(name: &'static str, value: f64) -> Result<(), Error> {
    check_setting(name, value, (0.0..=1.0).contains(&value), "in 0..=1")
}

/// Checks a setting that must be finite and not negative.
pub(crate) fn check_not_negative(name: &'static str, value: f64) -> Result<(), Error> {
    let valid = value.is_finite() && value >= 0.0;
    check_setting(name, value, valid, "finite and not negative")
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

/// Checks the length of a list.
pub(crate) fn check_length(what: &'static str, needed: usize, found: usize) -> Result<(), Error> {
    if found == needed {
        return Ok(());
    }
    Err(Error::WrongLength {
        what,
        needed,
        found,
    })
}

/// Checks an index.
#[inline(always)]
pub(crate) fn check_index(what: &'static str, index: usize, count: usize) -> Result<(), Error> {
    if index < count {
        return Ok(());
    }
    Err(Error::OutOfRange { what, index, count })
}

/// Refuses a `"reward"` or `"value"` that is not finite.
#[inline(always)]
pub(crate) fn check_finite(
    what: &'static str,
    state: State,
    action: Action,
    value: f64,
) -> Result<(), Error> {
    // Less work than `is_finite`: the product is NaN for infinities and NaN.
    if value * 0.0 == 0.0 {
        return Ok(());
    }
    Err(Error::NotFinite {
        what,
        state,
        action,
        value,
    })
}

/// Checks that the elements of a list ascend.
pub(crate) fn check_ascending(
    what: &'static str,
    list: impl IntoIterator<Item = f64>,
) -> Result<(), Error> {
    let mut last = f64::NEG_INFINITY;
    for (index, value) in list.into_iter().enumerate() {
        let before = std::mem::replace(&mut last, value);
        if value <= before {
            return Err(Error::NotAscending(what, index, value, before));
        }
    }
    Ok(())
}
