//! Which actions a state offers.

#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::index::{Action, State};
use crate::problem::Environment;
use crate::validated::validated;

/// The actions that each state offers, `A(s)` in the literature: a dense table of `states` by
/// `actions` truth values with at least one `true` in every row.
///
/// A [`QTable`](crate::QTable) that holds a mask never reports a forbidden action as its best,
/// never lets its value count as the state's maximum, and no policy chooses it.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(Serialize, Deserialize),
    serde(remote = "Self")
)]
pub struct ActionMask {
    actions: usize,
    allowed: Vec<bool>,
}

impl ActionMask {
    /// Asks `allows` for every pair.
    ///
    /// # Errors
    /// An empty shape, one that does not fit into memory, or a state without any action.
    pub fn new(
        states: usize,
        actions: usize,
        mut allows: impl FnMut(State, Action) -> bool,
    ) -> Result<Self, Error> {
        let entries = checked_entries(states, actions)?;
        let mut allowed = Vec::new();
        allowed
            .try_reserve_exact(entries)
            .map_err(|_| Error::TooLarge { states, actions })?;
        for state in 0..states {
            allowed.extend((0..actions).map(|action| allows(State(state), Action(action))));
        }
        Self { actions, allowed }.restore()
    }

    /// The mask of an environment, or `None` if it offers every action in every state.
    ///
    /// # Errors
    /// As [`ActionMask::new`].
    pub fn of<E: Environment + ?Sized>(environment: &E) -> Result<Option<Self>, Error> {
        let mask = Self::new(
            environment.states(),
            environment.actions(),
            |state, action| environment.allows(state, action),
        )?;
        Ok(mask.restricts().then_some(mask))
    }

    /// Whether any action of any state is forbidden.
    pub fn restricts(&self) -> bool {
        self.allowed.contains(&false)
    }

    /// Number of states.
    pub fn states(&self) -> usize {
        self.allowed.len() / self.actions
    }

    /// Number of actions.
    pub fn actions(&self) -> usize {
        self.actions
    }

    /// One truth value for each action of a state.
    ///
    /// # Panics
    /// As a slice does if the state is outside the mask.
    pub fn row(&self, state: State) -> &[bool] {
        &self.allowed[state.0 * self.actions..][..self.actions]
    }

    fn restore(self) -> Result<Self, Error> {
        let states = self.allowed.len() / self.actions.max(1);
        let needed = checked_entries(states, self.actions)?;
        if needed != self.allowed.len() {
            return Err(Error::WrongLength {
                what: "the mask",
                needed,
                found: self.allowed.len(),
            });
        }
        match (0..states).find(|&state| !self.row(State(state)).contains(&true)) {
            Some(state) => Err(Error::NoActionAllowed {
                state: State(state),
            }),
            None => Ok(self),
        }
    }
}

validated!(ActionMask);

/// `states * actions` where both are positive, the action index fits into 32 bits and the product
/// into memory.
pub(crate) fn checked_entries(states: usize, actions: usize) -> Result<usize, Error> {
    if states == 0 || actions == 0 {
        return Err(Error::EmptyShape { states, actions });
    }
    match states.checked_mul(actions) {
        Some(entries) if entries <= isize::MAX as usize / 8 && u32::try_from(actions).is_ok() => {
            Ok(entries)
        }
        _ => Err(Error::TooLarge { states, actions }),
    }
}
