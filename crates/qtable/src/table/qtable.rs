//! The Q-table: one number for every state and action.

#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::index::{Action, State};
use crate::table::mask::{ActionMask, checked_entries};
use crate::validated::validated;

/// A number that a table can hold: `f32` or `f64`. Arithmetic is done in `f64` and rounded on
/// storing.
pub trait Value:
    Copy + PartialOrd + std::fmt::Debug + Send + Sync + sealed::Sealed + 'static
{
    /// The number as `f64`, exactly.
    fn to_f64(self) -> f64;
    /// The nearest number of this type, infinite if there is none.
    fn from_f64(value: f64) -> Self;
    /// Whether it is neither infinite nor NaN.
    fn is_finite(self) -> bool;
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

impl Value for f32 {
    #[inline(always)]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        value as f32
    }
    #[inline(always)]
    fn is_finite(self) -> bool {
        f32::is_finite(self)
    }
}

impl Value for f64 {
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }
    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn is_finite(self) -> bool {
        f64::is_finite(self)
    }
}

/// A dense table of action values with visit counts, `states` rows of `actions` values, and the
/// best action of every row kept up to date.
///
/// It never holds a value that is not finite. The best action is the one with the highest value
/// among those the state offers; of equal values the lowest index wins. Keeping it costs one
/// comparison on a write; the row is searched again only after the best value itself was lowered.
///
/// `QTable` without parameter holds `f64`. Methods that take a [`State`] or an [`Action`] and
/// return no `Result` panic outside the table, as a slice does; [`get`](QTable::get) and
/// [`check`](QTable::check) do not.
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
#[cfg_attr(
    feature = "serde",
    derive(Serialize, Deserialize),
    serde(remote = "Self")
)]
pub struct QTable<V: Value = f64> {
    actions: usize,
    values: Vec<V>,
    visits: Vec<u32>,
    mask: Option<ActionMask>,
    /// The best action of each state.
    #[cfg_attr(feature = "serde", serde(skip, default = "Vec::new"))]
    best: Vec<Best<V>>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Best<V> {
    value: V,
    action: u32,
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
    /// A table that holds `value` everywhere. A value above all possible returns is the *optimistic
    /// start*: every action looks good until it has been tried.
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
        best.resize(states, Best { value, action: 0 });
        Ok(Self {
            actions,
            values,
            visits,
            mask: None,
            best,
        })
    }

    /// Restricts every state to the actions of a mask (`None` lifts the restriction). Values stay
    /// as they are.
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
        let entry = self.entry(state, action)?;
        self.count(entry);
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
        self.check(state, action)
            .ok()
            .map(|()| self.value(state, action))
    }

    /// The values of all actions of a state, forbidden ones included.
    #[inline]
    pub fn row(&self, state: State) -> &[V] {
        &self.values[state.0 * self.actions..][..self.actions]
    }

    /// The highest value among the actions that a state offers.
    #[inline(always)]
    pub fn max(&self, state: State) -> V {
        self.best[state.0].value
    }

    /// The action of the highest value among those that a state offers; of equals the lowest index.
    #[inline(always)]
    pub fn best(&self, state: State) -> Action {
        Action(self.best[state.0].action as usize)
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
        self.mask
            .as_ref()
            .is_none_or(|mask| mask.row(state)[action.0])
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
        self.best
            .iter()
            .map(|best| Action(best.action as usize))
            .collect()
    }

    /// Checks that a pair lies in the table and is offered.
    ///
    /// # Errors
    /// Out of range, or forbidden by the mask.
    #[inline(always)]
    pub fn check(&self, state: State, action: Action) -> Result<(), Error> {
        self.entry(state, action).map(|_| ())
    }

    /// Checks that a state lies in the table.
    ///
    /// # Errors
    /// [`Error::StateOutOfRange`].
    #[inline(always)]
    pub fn check_state(&self, state: State) -> Result<(), Error> {
        if state.0 < self.states() {
            Ok(())
        } else {
            Err(self.refuse(state, Action(0)))
        }
    }

    /// Checks that something else has the shape of the table.
    ///
    /// # Errors
    /// [`Error::ShapeMismatch`], in which `what` names the other thing.
    pub fn check_shape(
        &self,
        what: &'static str,
        states: usize,
        actions: usize,
    ) -> Result<(), Error> {
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

    /// Where a pair stands, after the checks of [`check`](QTable::check).
    #[inline(always)]
    pub(crate) fn entry(&self, state: State, action: Action) -> Result<usize, Error> {
        let index = state.0.wrapping_mul(self.actions).wrapping_add(action.0);
        let inside = state.0 < self.states() && action.0 < self.actions;
        if inside
            && self
                .mask
                .as_ref()
                .is_none_or(|mask| mask.row(state)[action.0])
        {
            Ok(index)
        } else {
            Err(self.refuse(state, action))
        }
    }

    /// Why a pair is refused.
    #[cold]
    fn refuse(&self, state: State, action: Action) -> Error {
        if state.0 >= self.states() {
            Error::StateOutOfRange {
                state,
                states: self.states(),
            }
        } else if action.0 >= self.actions {
            Error::ActionOutOfRange {
                action,
                actions: self.actions,
            }
        } else {
            Error::ActionNotAllowed { state, action }
        }
    }

    /// Value and visits of an entry.
    #[inline(always)]
    pub(crate) fn at(&self, entry: usize) -> (V, u32) {
        (self.values[entry], self.visits[entry])
    }

    /// Counts a visit of an entry.
    #[inline(always)]
    pub(crate) fn count(&mut self, entry: usize) {
        let count = &mut self.visits[entry];
        *count = count.saturating_add(1);
    }

    /// Sets the count of a checked pair.
    pub(crate) fn set_visits(&mut self, state: State, action: Action, visits: u32) {
        self.visits[state.0 * self.actions + action.0] = visits;
    }

    /// The value as it would be stored, or an error if that is not finite.
    #[inline(always)]
    pub(crate) fn check_value(&self, state: State, action: Action, value: f64) -> Result<V, Error> {
        let stored = V::from_f64(value);
        if stored.is_finite() {
            Ok(stored)
        } else {
            Err(Error::ValueNotFinite {
                state,
                action,
                value,
            })
        }
    }

    /// Writes a value at a checked place, if it is finite, and keeps the best action.
    #[inline(always)]
    pub(crate) fn store(&mut self, state: State, action: Action, value: f64) -> Result<(), Error> {
        let value = self.check_value(state, action, value)?;
        let entry = state.0 * self.actions + action.0;
        let old = std::mem::replace(&mut self.values[entry], value);
        let best = &mut self.best[state.0];
        let index = action.0 as u32;
        if index == best.action {
            best.value = value;
            if value < old {
                self.find_best(state);
            }
        } else if (value > best.value || (value == best.value && index < best.action))
            && self
                .mask
                .as_ref()
                .is_none_or(|mask| mask.row(state)[action.0])
        {
            *best = Best {
                value,
                action: index,
            };
        }
        Ok(())
    }

    #[inline(never)]
    fn find_best(&mut self, state: State) {
        let row = &self.values[state.0 * self.actions..][..self.actions];
        let best = match &self.mask {
            None => {
                // Lane by lane, so that it is done with vectors.
                let (chunks, rest) = row.as_chunks::<8>();
                let mut lanes = [row[0]; 8];
                let higher = |a: V, b: V| if b > a { b } else { a };
                for chunk in chunks {
                    for (lane, &value) in lanes.iter_mut().zip(chunk) {
                        *lane = higher(*lane, value);
                    }
                }
                let highest = lanes
                    .into_iter()
                    .chain(rest.iter().copied())
                    .fold(row[0], higher);
                row.iter().position(|&value| value >= highest).unwrap_or(0)
            }
            Some(mask) => {
                let offered = (0..self.actions).filter(|&action| mask.row(state)[action]);
                offered
                    .reduce(|best, action| {
                        if row[action] > row[best] {
                            action
                        } else {
                            best
                        }
                    })
                    .unwrap_or(0)
            }
        };
        self.best[state.0] = Best {
            value: row[best],
            action: best as u32,
        };
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
                return Err(Error::WrongLength {
                    what,
                    needed,
                    found,
                });
            }
        }
        if let Some(index) = self
            .values
            .iter()
            .position(|value| !value.to_f64().is_finite())
        {
            let (state, action) = (State(index / actions), Action(index % actions));
            return Err(Error::ValueNotFinite {
                state,
                action,
                value: self.values[index].to_f64(),
            });
        }
        self.best = vec![
            Best {
                value: self.values[0],
                action: 0
            };
            states
        ];
        let mask = self.mask.take();
        self.set_mask(mask)?;
        Ok(self)
    }
}

validated!(QTable<V: Value>);
