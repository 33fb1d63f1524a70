//! The Q-table: one value for every pair of a state and an action.

use crate::error::{Error, check_finite, check_index, check_length};
use crate::step::{Action, State};
use crate::table::best::Best;
use crate::validated::validated;

validated! {
    /// A dense table of action values, `states` rows of `actions` values, with a visit count for
    /// each value.
    ///
    /// The table keeps the best action of every row. A write costs one comparison; the row is
    /// searched again only when its best value falls. No value is ever infinite or NaN.
    ///
    /// A table may be restricted to the actions that each state offers, `A(s)` in the literature
    /// ([`restrict`](QTable::restrict)). Then it never reports another action as its best, and no
    /// policy chooses one. A state without any action is a terminal one.
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
        pub(super) actions: usize,
        /// Value of an entry that was never written, also in states added later.
        initial: f64,
        pub(super) values: Vec<f64>,
        pub(super) visits: Vec<u32>,
        /// For each entry, `true` if the state offers the action; `None` if all are offered.
        pub(super) mask: Option<Vec<bool>>,
        /// The best action of each state.
        #[cfg_attr(feature = "serde", serde(skip))]
        pub(super) best: Vec<Best>,
        /// `true` once a dynamic environment was met: the mask is that of the present, and values
        /// of actions that were offered before may still be learned.
        #[cfg_attr(feature = "serde", serde(skip))]
        pub(super) dynamic: bool,
    }
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
        let mut table = Self {
            actions,
            initial: value,
            values: Vec::new(),
            visits: Vec::new(),
            mask: None,
            best: Vec::new(),
            dynamic: false,
        };
        table.resize(states)?;
        table.restore()
    }

    /// Adds or removes states at the end.
    fn resize(&mut self, states: usize) -> Result<(), Error> {
        let entries = checked_entries(states, self.actions)?;
        let too_large = |_| Error::too_large(states, self.actions);
        let new = entries.saturating_sub(self.values.len());
        self.values.try_reserve(new).map_err(too_large)?;
        self.visits.try_reserve(new).map_err(too_large)?;
        self.values.resize(entries, self.initial);
        self.visits.resize(entries, 0);
        if let Some(mask) = &mut self.mask {
            mask.resize(entries, true);
        }
        Ok(())
    }

    /// Adds states at the end until there are `states`, with the value of a new table.
    pub(crate) fn grow(&mut self, states: usize) -> Result<(), Error> {
        let before = self.states();
        if states > before {
            self.resize(states)?;
            let best = Best::new(self.initial, 0, self.actions as u32);
            self.best.resize(states, best);
        }
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

    /// Returns the best action of every state.
    pub fn greedy(&self) -> Vec<Action> {
        (0..self.states()).map(|s| self.best(State(s))).collect()
    }

    /// Checks that a pair lies in the table and is offered.
    #[inline(always)]
    pub(crate) fn check(&self, state: State, action: Action) -> Result<(), Error> {
        self.entry(state, action).map(|_| ())
    }

    /// Checks that a state lies in the table.
    #[inline(always)]
    pub(crate) fn check_state(&self, state: State) -> Result<(), Error> {
        if state.0 < self.states() {
            return Ok(());
        }
        Err(self.refuse(state, Action(0)))
    }

    /// Returns the number of states and actions.
    pub(crate) fn shape(&self) -> (usize, usize) {
        (self.states(), self.actions)
    }

    /// Checks that `what` has the shape of the table.
    pub(crate) fn check_shape(
        &self,
        what: &'static str,
        found: (usize, usize),
    ) -> Result<(), Error> {
        let needed = self.shape();
        if found == needed {
            return Ok(());
        }
        Err(Error::ShapeMismatch(what, needed, found))
    }

    /// Returns the first entry of a state, which panics outside the table: a product that wraps
    /// would lead to another row.
    #[inline(always)]
    pub(super) fn start(&self, state: State) -> usize {
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
        if inside && self.mask.is_none() {
            return Ok(index);
        }
        self.masked_entry(inside, index, state, action)
    }

    /// Returns the entry of a pair of a table with a mask.
    #[inline(never)]
    fn masked_entry(
        &self,
        inside: bool,
        index: usize,
        state: State,
        action: Action,
    ) -> Result<usize, Error> {
        match &self.mask {
            Some(mask) if inside && (self.dynamic || mask[index]) => Ok(index),
            _ => Err(self.refuse(state, action)),
        }
    }

    /// Returns the error for a pair that is refused.
    #[cold]
    fn refuse(&self, state: State, action: Action) -> Error {
        check_index("state", state.0, self.states())
            .and_then(|()| check_index("action", action.0, self.actions))
            .err()
            .unwrap_or(Error::ActionNotAllowed(state, action))
    }

    /// Checks a choice: a pair in the table that is offered now.
    #[inline(always)]
    pub(crate) fn check_choice(&self, state: State, action: Action) -> Result<(), Error> {
        self.check(state, action)?;
        if self.mask.is_some() && !self.allows(state, action) {
            return Err(Error::ActionNotAllowed(state, action));
        }
        Ok(())
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

    /// Checks a table and finds its best actions.
    fn restore(mut self) -> Result<Self, Error> {
        let actions = self.actions;
        let states = self.values.len() / actions.max(1);
        let needed = checked_entries(states, actions)?;
        check_length("the table", needed, self.values.len())?;
        check_length("the list of visit counts", needed, self.visits.len())?;
        let masked = self.mask.as_ref().map_or(needed, Vec::len);
        check_length("the mask", needed, masked)?;
        let entries = [self.initial]
            .into_iter()
            .chain(self.values.iter().copied());
        for (entry, value) in entries.enumerate() {
            let index = entry.saturating_sub(1);
            let (state, action) = (State(index / actions), Action(index % actions));
            check_finite("value", state, action, value)?;
        }
        self.best.clear();
        let reserved = self.best.try_reserve_exact(states);
        reserved.map_err(|_| Error::too_large(states, actions))?;
        self.best.resize(states, Best::new(self.initial, 0, 0));
        self.find_all_best();
        Ok(self)
    }
}

/// Returns `states * actions` where both are positive, the action index fits into 32 bits and the
/// product into memory.
pub(crate) fn checked_entries(states: usize, actions: usize) -> Result<usize, Error> {
    if states == 0 || actions == 0 {
        let problem = "an empty table: both must be at least 1";
        return Err(Error::Shape {
            states,
            actions,
            problem,
        });
    }
    match states.checked_mul(actions) {
        Some(entries) if entries <= isize::MAX as usize / 8 && u32::try_from(actions).is_ok() => {
            Ok(entries)
        }
        _ => Err(Error::too_large(states, actions)),
    }
}
