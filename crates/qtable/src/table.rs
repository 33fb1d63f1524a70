//! The Q-table: one number for every state and action.

#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::mask::checked_entries;
use crate::validated::validated;
use crate::{Action, ActionMask, Error, State};

/// A number that a table can hold: `f32` or `f64`. Arithmetic is done in `f64` and rounded on storing.
pub trait Value: Copy + PartialOrd + std::fmt::Debug + Send + Sync + sealed::Sealed + 'static {
    /// The number as `f64`, exactly.
    fn to_f64(self) -> f64;
    /// The nearest number of this type, infinite if there is none.
    fn from_f64(value: f64) -> Self;
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

impl Value for f32 {
    #[inline]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
    #[inline]
    fn from_f64(value: f64) -> Self {
        value as f32
    }
}

impl Value for f64 {
    #[inline]
    fn to_f64(self) -> f64 {
        self
    }
    #[inline]
    fn from_f64(value: f64) -> Self {
        value
    }
}

/// A dense table of action values with visit counts, `states` rows of `actions` values, and the best action of
/// every row kept up to date.
///
/// It never holds a value that is not finite. The best action is the one with the highest value among those the
/// state offers; of equal values the lowest index wins. Keeping it costs one comparison on a write; the row is
/// searched again only after the best value itself was lowered.
///
/// `QTable` without parameter holds `f64`. Methods that take a [`State`] or an [`Action`] and return no `Result`
/// panic outside the table, as a slice does; [`get`](QTable::get) and [`check`](QTable::check) do not.
///
/// ```
/// use qtable::{Action, QTable, State};
///
/// let mut table = QTable::new(3, 2)?;
/// table.set(State(1), Action(1), 0.5)?;
/// assert_eq!(table.best(State(1)), Action(1));
/// assert_eq!(table.best(State(0)), Action(0));
/// assert!(table.set(State(1), Action(1), f64::NAN).is_err());
/// assert_eq!(table.row(State(1)), [0.0, 0.5]);
/// # Ok::<(), qtable::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize), serde(remote = "Self"))]
pub struct QTable<V: Value = f64> {
    actions: usize,
    values: Vec<V>,
    visits: Vec<u32>,
    mask: Option<ActionMask>,
    /// Index of the best action of each state.
    #[cfg_attr(feature = "serde", serde(skip))]
    best: Vec<u32>,
}

impl QTable {
    /// A table of `f64` zeros.
    ///
    /// # Errors
    /// An empty shape, or one that does not fit into memory.
    pub fn new(states: usize, actions: usize) -> Result<Self, Error> {
        Self::filled(states, actions, 0.0)
    }
}

impl<V: Value> QTable<V> {
    /// A table that holds `value` everywhere. A value above all possible returns is the *optimistic start*:
    /// every action looks good until it has been tried.
    ///
    /// ```
    /// # use qtable::QTable;
    /// let single = QTable::<f32>::filled(90, 81, 100.0)?;
    /// # Ok::<(), qtable::Error>(())
    /// ```
    ///
    /// # Errors
    /// An empty shape, one that does not fit into memory, or a value that is not finite.
    pub fn filled(states: usize, actions: usize, value: V) -> Result<Self, Error> {
        let entries = checked_entries(states, actions)?;
        if !value.to_f64().is_finite() {
            let value = value.to_f64();
            return Err(Error::ValueNotFinite {
                state: State(0),
                action: Action(0),
                value,
            });
        }
        let too_large = |_| Error::TooLarge { states, actions };
        let (mut values, mut visits, mut best) = (Vec::new(), Vec::new(), Vec::new());
        values.try_reserve_exact(entries).map_err(too_large)?;
        visits.try_reserve_exact(entries).map_err(too_large)?;
        best.try_reserve_exact(states).map_err(too_large)?;
        values.resize(entries, value);
        visits.resize(entries, 0);
        best.resize(states, 0);
        Ok(Self {
            actions,
            values,
            visits,
            mask: None,
            best,
        })
    }

    /// Restricts every state to the actions of a mask (`None` lifts the restriction). Values stay as they are.
    ///
    /// # Errors
    /// [`Error::ShapeMismatch`].
    pub fn set_mask(&mut self, mask: Option<ActionMask>) -> Result<(), Error> {
        if let Some(mask) = &mask {
            self.check_shape("the mask", mask.states(), mask.actions())?;
        }
        self.mask = mask;
        self.find_all_best();
        Ok(())
    }

    /// Sets a value; the visit count stays.
    ///
    /// # Errors
    /// A state or action out of range, or a value that is not finite. The table is unchanged then.
    #[inline]
    pub fn set(&mut self, state: State, action: Action, value: V) -> Result<(), Error> {
        self.check(state, action)?;
        self.store(state, action, value.to_f64())
    }

    /// Counts a visit of a pair. The count stops at 4 294 967 295.
    ///
    /// # Errors
    /// A state or action out of range.
    pub fn visit(&mut self, state: State, action: Action) -> Result<(), Error> {
        self.check(state, action)?;
        self.count(state, action);
        Ok(())
    }

    /// Number of states.
    pub fn states(&self) -> usize {
        self.best.len()
    }

    /// Number of actions.
    pub fn actions(&self) -> usize {
        self.actions
    }

    /// The value of an action in a state.
    #[inline]
    pub fn value(&self, state: State, action: Action) -> V {
        self.row(state)[action.0]
    }

    /// The value of an action in a state, or `None` outside the table.
    pub fn get(&self, state: State, action: Action) -> Option<V> {
        self.check(state, action).ok().map(|()| self.value(state, action))
    }

    /// The values of all actions of a state, forbidden ones included.
    #[inline]
    pub fn row(&self, state: State) -> &[V] {
        &self.values[state.0 * self.actions..][..self.actions]
    }

    /// The highest value among the actions that a state offers.
    #[inline]
    pub fn max(&self, state: State) -> V {
        self.value(state, self.best(state))
    }

    /// The action of the highest value among those that a state offers; of equals the lowest index.
    #[inline]
    pub fn best(&self, state: State) -> Action {
        Action(self.best[state.0] as usize)
    }

    /// How often a pair was visited.
    #[inline]
    pub fn visits(&self, state: State, action: Action) -> u32 {
        self.visit_row(state)[action.0]
    }

    /// How often each action of a state was visited.
    #[inline]
    pub fn visit_row(&self, state: State) -> &[u32] {
        &self.visits[state.0 * self.actions..][..self.actions]
    }

    /// The mask, if one restricts the table.
    pub fn mask(&self) -> Option<&ActionMask> {
        self.mask.as_ref()
    }

    /// Whether a state offers an action.
    #[inline]
    pub fn allows(&self, state: State, action: Action) -> bool {
        self.mask.as_ref().is_none_or(|mask| mask.row(state)[action.0])
    }

    /// The actions that a state offers, by ascending index.
    pub fn offered(&self, state: State) -> impl Iterator<Item = Action> + '_ {
        let row = self.mask.as_ref().map(|mask| mask.row(state));
        (0..self.actions)
            .filter(move |&action| row.is_none_or(|row| row[action]))
            .map(Action)
    }

    /// The best action of every state.
    pub fn greedy(&self) -> Vec<Action> {
        self.best.iter().map(|&action| Action(action as usize)).collect()
    }

    /// Checks that a pair lies in the table and is offered.
    ///
    /// # Errors
    /// Out of range, or forbidden by the mask.
    #[inline]
    pub fn check(&self, state: State, action: Action) -> Result<(), Error> {
        self.check_state(state)?;
        if action.0 >= self.actions {
            return Err(Error::ActionOutOfRange {
                action,
                actions: self.actions,
            });
        }
        if self.allows(state, action) {
            Ok(())
        } else {
            Err(Error::ActionNotAllowed { state, action })
        }
    }

    /// Checks that a state lies in the table.
    ///
    /// # Errors
    /// [`Error::StateOutOfRange`].
    #[inline]
    pub fn check_state(&self, state: State) -> Result<(), Error> {
        if state.0 < self.states() {
            Ok(())
        } else {
            Err(Error::StateOutOfRange {
                state,
                states: self.states(),
            })
        }
    }

    /// Checks that something else has the shape of the table.
    ///
    /// # Errors
    /// [`Error::ShapeMismatch`], in which `what` names the other thing.
    pub fn check_shape(&self, what: &'static str, states: usize, actions: usize) -> Result<(), Error> {
        if (states, actions) == (self.states(), self.actions) {
            return Ok(());
        }
        Err(Error::ShapeMismatch {
            what,
            states: self.states(),
            actions: self.actions,
            found_states: states,
            found_actions: actions,
        })
    }

    /// Counts a visit of a checked pair.
    #[inline]
    pub(crate) fn count(&mut self, state: State, action: Action) {
        let count = &mut self.visits[state.0 * self.actions + action.0];
        *count = count.saturating_add(1);
    }

    /// The value as it would be stored, or an error if that is not finite.
    #[inline]
    pub(crate) fn check_value(&self, state: State, action: Action, value: f64) -> Result<V, Error> {
        let stored = V::from_f64(value);
        if stored.to_f64().is_finite() {
            Ok(stored)
        } else {
            Err(Error::ValueNotFinite { state, action, value })
        }
    }

    /// Writes a value at a checked place, if it is finite, and keeps the best action.
    #[inline]
    pub(crate) fn store(&mut self, state: State, action: Action, value: f64) -> Result<(), Error> {
        let value = self.check_value(state, action, value)?;
        let index = state.0 * self.actions + action.0;
        let old = std::mem::replace(&mut self.values[index], value);
        let best = self.best(state);
        if action == best {
            if value < old {
                self.find_best(state);
            }
        } else if self.allows(state, action) {
            let highest = self.max(state);
            if value > highest || (value == highest && action < best) {
                self.best[state.0] = action.0 as u32;
            }
        }
        Ok(())
    }

    fn find_best(&mut self, state: State) {
        let row = self.row(state);
        let highest = |best: Action, action: Action| {
            if row[action.0] > row[best.0] { action } else { best }
        };
        let best = self.offered(state).reduce(highest).unwrap_or_default();
        self.best[state.0] = best.0 as u32;
    }

    fn find_all_best(&mut self) {
        for state in 0..self.states() {
            self.find_best(State(state));
        }
    }

    /// Checks a table that was read and rebuilds its best actions.
    #[cfg(feature = "serde")]
    fn restore(mut self) -> Result<Self, Error> {
        let actions = self.actions;
        let states = self.values.len() / actions.max(1);
        let needed = checked_entries(states, actions)?;
        for (what, found) in [
            ("the table", self.values.len()),
            ("the visit counts", self.visits.len()),
        ] {
            if found != needed {
                return Err(Error::WrongLength { what, needed, found });
            }
        }
        if let Some(index) = self.values.iter().position(|value| !value.to_f64().is_finite()) {
            let (state, action) = (State(index / actions), Action(index % actions));
            return Err(Error::ValueNotFinite {
                state,
                action,
                value: self.values[index].to_f64(),
            });
        }
        self.best = vec![0; states];
        let mask = self.mask.take();
        self.set_mask(mask)?;
        Ok(self)
    }
}

validated!(QTable<V: Value>);
