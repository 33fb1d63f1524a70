//! The actions that a state offers.

use crate::error::Error;
use crate::problem::Environment;
use crate::step::{Action, State};
use crate::validated::validated;

validated! {
    /// The actions that each state offers, `A(s)` in the literature: a dense table of `states` by
    /// `actions` truth values. A state without any action is a terminal one.
    ///
    /// A [`QTable`](crate::QTable) with a mask never reports a forbidden action as its best, and no
    /// policy chooses one.
    #[derive(Clone, Debug, PartialEq, Eq)]
    pub struct ActionMask {
        actions: usize,
        allowed: Vec<bool>,
    }
}

impl ActionMask {
    /// Creates a mask by asking `allows` for every pair.
    ///
    /// # Errors
    /// An empty shape, or one that does not fit into memory.
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

    /// Returns the mask of an environment, or `None` if it offers every action in every state.
    ///
    /// # Errors
    /// [`ActionMask::new`] lists them.
    pub fn of<E: Environment + ?Sized>(environment: &E) -> Result<Option<Self>, Error> {
        let (states, actions) = (environment.states(), environment.actions());
        let mask = Self::new(states, actions, |s, a| environment.allows(s, a))?;
        Ok(mask.restricts().then_some(mask))
    }

    /// Returns `true` if an action of any state is forbidden.
    pub(crate) fn restricts(&self) -> bool {
        self.allowed.contains(&false)
    }

    /// Returns the number of states.
    pub(crate) fn states(&self) -> usize {
        self.allowed.len() / self.actions
    }

    /// Returns the number of actions.
    pub(crate) fn actions(&self) -> usize {
        self.actions
    }

    /// Returns one truth value for each action of a state.
    ///
    /// # Panics
    /// If the state is outside the mask.
    #[inline]
    pub fn row(&self, state: State) -> &[bool] {
        // A product that wraps would lead to another row.
        &self.allowed[state.0.saturating_mul(self.actions)..][..self.actions]
    }

    fn restore(self) -> Result<Self, Error> {
        let states = self.allowed.len() / self.actions.max(1);
        let needed = checked_entries(states, self.actions)?;
        if needed == self.allowed.len() {
            return Ok(self);
        }
        Err(Error::WrongLength {
            what: "the mask",
            needed,
            found: self.allowed.len(),
        })
    }
}

/// Returns `states * actions` where both are positive, the action index fits into 32 bits and the
/// product into memory.
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
