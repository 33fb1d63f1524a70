//! States known by a key of their own.

use std::collections::HashMap;
use std::hash::Hash;

use crate::error::Error;
use crate::step::State;

/// The states of a problem whose states are not numbered beforehand, such as the positions of a
/// game: each new key gets the next index, in the order in which keys are met.
///
/// An environment owns its keys, reports their number as
/// [`Environment::states`](crate::Environment::states), and says that it
/// [is dynamic](crate::Environment::is_dynamic); then tables and learners grow with it. Keys are
/// stored in their order, so the same run gives the same bytes.
///
/// ```
/// use qtable::{Keys, State};
///
/// fn main() -> Result<(), qtable::Error> {
///     let mut keys = Keys::new(1_000_000);
///     assert_eq!(keys.state(&"east")?, State(0));
///     assert_eq!(keys.state(&"west")?, State(1));
///     assert_eq!(keys.state(&"east")?, State(0));
///     assert_eq!((keys.get(&"north"), keys.key(State(1))), (None, Some(&"west")));
///     assert_eq!(keys.states(), 2);
///     Ok(())
/// }
/// ```
#[derive(Clone, Debug)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(
        into = "(usize, Vec<K>)",
        try_from = "(usize, Vec<K>)",
        bound(
            serialize = "K: Clone + serde::Serialize",
            deserialize = "K: Clone + Eq + Hash + serde::Deserialize<'de>"
        )
    )
)]
pub struct Keys<K> {
    most: usize,
    keys: Vec<K>,
    states: HashMap<K, usize>,
}

impl<K: Clone + Eq + Hash> Keys<K> {
    /// Creates an empty list that takes `most` keys.
    pub fn new(most: usize) -> Self {
        Self {
            most,
            keys: Vec::new(),
            states: HashMap::new(),
        }
    }

    /// Returns the state of a key, a new one for a key not met before.
    ///
    /// # Errors
    /// [`Error::TooManyKeys`] for a new key beyond the bound.
    pub fn state(&mut self, key: &K) -> Result<State, Error> {
        if let Some(&state) = self.states.get(key) {
            return Ok(State(state));
        }
        let (state, most) = (self.keys.len(), self.most);
        if state >= most {
            return Err(Error::TooManyKeys(most));
        }
        self.keys.push(key.clone());
        self.states.insert(key.clone(), state);
        Ok(State(state))
    }

    /// Returns the state of a key that was met before.
    pub fn get(&self, key: &K) -> Option<State> {
        self.states.get(key).copied().map(State)
    }

    /// Returns the key of a state.
    pub fn key(&self, state: State) -> Option<&K> {
        self.keys.get(state.0)
    }

    /// Returns the number of states, 1 while no key was met.
    pub fn states(&self) -> usize {
        self.keys.len().max(1)
    }
}

impl<K: PartialEq> PartialEq for Keys<K> {
    fn eq(&self, other: &Self) -> bool {
        self.most == other.most && self.keys == other.keys
    }
}

impl<K> From<Keys<K>> for (usize, Vec<K>) {
    fn from(keys: Keys<K>) -> Self {
        (keys.most, keys.keys)
    }
}

impl<K: Clone + Eq + Hash> TryFrom<(usize, Vec<K>)> for Keys<K> {
    type Error = Error;

    fn try_from((most, stored): (usize, Vec<K>)) -> Result<Self, Error> {
        let mut keys = Self::new(most);
        for key in &stored {
            keys.state(key)?;
        }
        crate::error::check_length("the list of keys", keys.keys.len(), stored.len())?;
        Ok(keys)
    }
}
