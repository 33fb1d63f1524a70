//! The Q-table: one value for every pair of a state and an action.

use crate::error::Error;
use crate::step::{Action, State};
use crate::table::mask::{ActionMask, checked_entries};
use crate::validated::validated;

validated! {
    /// A dense table of action values, `states` rows of `actions` values, with a visit count for
    /// each value.
    ///
    /// The table keeps the best action of every row. A write costs one comparison; the row is
    /// searched again only when its best value falls. No value is ever infinite or NaN.
    ///
    /// Methods that take a [`State`] or an [`Action`] and return no `Result` panic outside the
    /// table, like an index into a slice. [`get`](QTable::get) does not.
    ///
    /// ```
    /// use qtable::{Action, QTable, State};
    ///
    /// fn main() -> Result<(), qtable::Error> {
    ///     let mut table = QTable::new(3, 2)?;
    ///     table.set(State(1), Action(1), 0.5)?;
    ///     assert_eq!(table.best(State(1)), Action(1));
    ///     assert_eq!(table.best(State(0)), Action(0));
    ///     assert!(table.set(State(1), Action(1), f64::NAN).is_err());
    ///     assert_eq!(table.row(State(1)), [0.0, 0.5]);
    ///     Ok(())
    /// }
    /// ```
    #[derive(Clone, Debug, PartialEq)]
    pub struct QTable {
        actions: usize,
        values: Vec<f64>,
        visits: Vec<u32>,
        mask: Option<ActionMask>,
        /// The best action of each state.
        #[cfg_attr(feature = "serde", serde(skip))]
        best: Vec<Best>,
    }
}

/// The best action of a row: the lowest index among those of the highest value.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Best {
    value: f64,
    action: u32,
    /// Number of offered actions that have the highest value.
    equals: u32,
}

impl QTable {
    /// Creates a table of zeros.
    ///
    /// # Errors
    /// An empty shape, or one that does not fit into memory.
    pub fn new(states: usize, actions: usize) -> Result<Self, Error> {
        Self::filled(states, actions, 0.0)
    }

    /// Creates a table that holds `value` everywhere. A value above all possible returns is an
    /// *optimistic start*: every action looks good until it has been tried.
    ///
    /// # Errors
    /// An empty shape, one that does not fit into memory, or a value that is not finite.
    pub fn filled(states: usize, actions: usize, value: f64) -> Result<Self, Error> {
        let entries = checked_entries(states, actions)?;
        let too_large = |_| Error::TooLarge { states, actions };
        let (mut values, mut visits) = (Vec::new(), Vec::new());
        values.try_reserve_exact(entries).map_err(too_large)?;
        visits.try_reserve_exact(entries).map_err(too_large)?;
        values.resize(entries, value);
        visits.resize(entries, 0);
        let (mask, best) = (None, Vec::new());
        Self {
            actions,
            values,
            visits,
            mask,
            best,
        }
        .restore()
    }

    /// Restricts every state to the actions of a mask; `None` lifts the restriction. Values stay.
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
    pub fn set(&mut self, state: State, action: Action, value: f64) -> Result<(), Error> {
        self.check(state, action)?;
        self.store(state, action, value)
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

    /// Returns the number of states.
    #[inline]
    pub fn states(&self) -> usize {
        self.best.len()
    }

    /// Returns the number of actions.
    #[inline]
    pub fn actions(&self) -> usize {
        self.actions
    }

    /// Returns the value of an action in a state.
    #[inline]
    pub fn value(&self, state: State, action: Action) -> f64 {
        self.row(state)[action.0]
    }

    /// Returns the value of an action in a state, or `None` outside the table and for a forbidden
    /// action.
    pub fn get(&self, state: State, action: Action) -> Option<f64> {
        let entry = self.entry(state, action).ok()?;
        Some(self.values[entry])
    }

    /// Returns the values of all actions of a state, forbidden ones included.
    #[inline]
    pub fn row(&self, state: State) -> &[f64] {
        &self.values[self.start(state)..][..self.actions]
    }

    /// Returns the highest value among the actions that a state offers.
    #[inline(always)]
    pub fn max(&self, state: State) -> f64 {
        self.best[state.0].value
    }

    /// Returns the action of the highest value among those that a state offers; of several, the one
    /// with the lowest index.
    #[inline(always)]
    pub fn best(&self, state: State) -> Action {
        Action(self.best[state.0].action as usize)
    }

    /// Returns how often a pair was visited.
    #[inline]
    pub fn visits(&self, state: State, action: Action) -> u32 {
        self.visit_row(state)[action.0]
    }

    /// Returns how often each action of a state was visited.
    #[inline]
    pub fn visit_row(&self, state: State) -> &[u32] {
        &self.visits[self.start(state)..][..self.actions]
    }

    /// Returns the mask, if one restricts the table.
    #[inline]
    pub fn mask(&self) -> Option<&ActionMask> {
        self.mask.as_ref()
    }

    /// Returns `true` if a state offers an action.
    #[inline]
    pub fn allows(&self, state: State, action: Action) -> bool {
        self.mask
            .as_ref()
            .is_none_or(|mask| mask.row(state)[action.0])
    }

    /// Returns the actions that a state offers, by ascending index.
    pub fn offered(&self, state: State) -> impl Iterator<Item = Action> + '_ {
        let row = self.mask.as_ref().map(|mask| mask.row(state));
        (0..self.actions)
            .filter(move |&action| row.is_none_or(|row| row[action]))
            .map(Action)
    }

    /// Returns the best action of every state.
    pub fn greedy(&self) -> Vec<Action> {
        (0..self.states()).map(|s| self.best(State(s))).collect()
    }

    /// Checks that a pair lies in the table and is offered.
    ///
    /// # Errors
    /// A state or action out of range, or an action that the mask forbids.
    #[inline(always)]
    pub(crate) fn check(&self, state: State, action: Action) -> Result<(), Error> {
        self.entry(state, action).map(|_| ())
    }

    /// Checks that a state lies in the table.
    ///
    /// # Errors
    /// [`Error::StateOutOfRange`].
    #[inline(always)]
    pub(crate) fn check_state(&self, state: State) -> Result<(), Error> {
        if state.0 < self.states() {
            Ok(())
        } else {
            Err(self.refuse(state, Action(0)))
        }
    }

    /// Checks that `what` has the shape of the table.
    pub(crate) fn check_shape(
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

    /// Returns the number of offered actions that share the highest value.
    #[inline(always)]
    pub(crate) fn equals(&self, state: State) -> usize {
        self.best[state.0].equals as usize
    }

    /// Returns the first entry of a state, which panics outside the table: a product that wraps
    /// would lead to another row.
    #[inline(always)]
    fn start(&self, state: State) -> usize {
        assert!(
            state.0 < self.best.len(),
            "{}",
            self.refuse(state, Action(0))
        );
        state.0 * self.actions
    }

    /// Returns the entry of a pair after the checks of [`check`](QTable::check).
    #[inline(always)]
    pub(crate) fn entry(&self, state: State, action: Action) -> Result<usize, Error> {
        let inside = state.0 < self.states() && action.0 < self.actions;
        let index = state.0.wrapping_mul(self.actions).wrapping_add(action.0);
        let masked = self.mask.as_ref();
        if inside && masked.is_none_or(|mask| mask.row(state)[action.0]) {
            Ok(index)
        } else {
            Err(self.refuse(state, action))
        }
    }

    /// Returns the error for a pair that is refused.
    #[cold]
    fn refuse(&self, state: State, action: Action) -> Error {
        let (states, actions) = (self.states(), self.actions);
        if state.0 >= states {
            Error::StateOutOfRange { state, states }
        } else if action.0 >= actions {
            Error::ActionOutOfRange { action, actions }
        } else {
            Error::ActionNotAllowed { state, action }
        }
    }

    /// Returns value and visits of an entry.
    #[inline(always)]
    pub(crate) fn at(&self, entry: usize) -> (f64, u32) {
        (self.values[entry], self.visits[entry])
    }

    /// Counts a visit of an entry.
    #[inline(always)]
    pub(crate) fn count(&mut self, entry: usize) {
        let count = &mut self.visits[entry];
        *count = count.saturating_add(1);
    }

    /// Sets the count of a pair inside the table.
    pub(crate) fn set_visits(&mut self, state: State, action: Action, visits: u32) {
        let entry = self.start(state) + action.0;
        self.visits[entry] = visits;
    }

    /// Writes a value at a pair that was checked, if it is finite, and keeps the best action.
    #[inline(always)]
    pub(crate) fn store(&mut self, state: State, action: Action, value: f64) -> Result<(), Error> {
        check_value(state, action, value)?;
        let entry = state.0 * self.actions + action.0;
        let old = std::mem::replace(&mut self.values[entry], value);
        let best = &mut self.best[state.0];
        let index = action.0 as u32;
        if index == best.action {
            best.value = value;
            if value < old {
                self.find_best(state);
            } else if value > old {
                best.equals = 1;
            }
        } else if old.max(value) >= best.value && self.allows(state, action) {
            self.follow(state, index, old, value);
        }
        Ok(())
    }

    /// Keeps the best action after an offered action other than it went from `old` to `value`, one
    /// of which reaches the highest value.
    #[inline]
    fn follow(&mut self, state: State, action: u32, old: f64, value: f64) {
        let best = &mut self.best[state.0];
        if value > best.value {
            let equals = 1;
            *best = Best {
                value,
                action,
                equals,
            };
            return;
        }
        let (was, is) = (old >= best.value, value >= best.value);
        best.equals = best.equals + u32::from(is) - u32::from(was);
        if is {
            best.action = best.action.min(action);
        }
    }

    #[inline(never)]
    fn find_best(&mut self, state: State) {
        let row = &self.values[state.0 * self.actions..][..self.actions];
        let higher = |a: f64, b: f64| if b > a { b } else { a };
        let mut found = Best {
            value: row[0],
            action: 0,
            equals: 0,
        };
        match &self.mask {
            None => {
                // Lane by lane, so that it is done with vectors.
                let (chunks, rest) = row.as_chunks::<8>();
                let mut lanes = [row[0]; 8];
                for chunk in chunks {
                    for (lane, &value) in lanes.iter_mut().zip(chunk) {
                        *lane = higher(*lane, value);
                    }
                }
                let all = lanes.into_iter().chain(rest.iter().copied());
                found.value = all.fold(row[0], higher);
                let equals = row.iter().map(|&value| u32::from(value >= found.value));
                found.equals = equals.sum();
                let first = row.iter().position(|&value| value >= found.value);
                found.action = first.unwrap_or(0) as u32;
            }
            Some(mask) => {
                let offered = mask.row(state);
                for (action, (&value, &offered)) in row.iter().zip(offered).enumerate() {
                    if offered && (found.equals == 0 || value > found.value) {
                        (found.value, found.action, found.equals) = (value, action as u32, 1);
                    } else if offered && value >= found.value {
                        found.equals += 1;
                    }
                }
            }
        }
        if found.equals == 0 {
            // Nothing comes after a state without actions.
            found.value = 0.0;
        }
        self.best[state.0] = found;
    }

    fn find_all_best(&mut self) {
        for state in 0..self.states() {
            self.find_best(State(state));
        }
    }

    /// Checks a table and finds its best actions.
    fn restore(mut self) -> Result<Self, Error> {
        let actions = self.actions;
        let states = self.values.len() / actions.max(1);
        let needed = checked_entries(states, actions)?;
        for (what, found) in [
            ("the table", self.values.len()),
            ("the list of visit counts", self.visits.len()),
        ] {
            if found != needed {
                return Err(Error::WrongLength {
                    what,
                    needed,
                    found,
                });
            }
        }
        for (index, &value) in self.values.iter().enumerate() {
            check_value(State(index / actions), Action(index % actions), value)?;
        }
        let too_large = |_| Error::TooLarge { states, actions };
        self.best.clear();
        self.best.try_reserve_exact(states).map_err(too_large)?;
        let (value, action, equals) = (self.values[0], 0, 0);
        self.best.resize(
            states,
            Best {
                value,
                action,
                equals,
            },
        );
        let mask = self.mask.take();
        self.set_mask(mask)?;
        Ok(self)
    }
}

/// Refuses a value that is not finite.
#[inline(always)]
pub(crate) fn check_value(state: State, action: Action, value: f64) -> Result<(), Error> {
    if value.is_finite() {
        Ok(())
    } else {
        Err(Error::ValueNotFinite {
            state,
            action,
            value,
        })
    }
}
