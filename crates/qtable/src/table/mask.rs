//! The actions that each state of a table offers.

use crate::error::Error;
use crate::problem::Environment;
use crate::step::{Action, State};
use crate::table::qtable::QTable;

impl QTable {
    /// Restricts every state to the actions for which `allows` returns `true`; if that is all of
    /// them, the restriction is lifted. Values stay.
    pub fn restrict(&mut self, mut allows: impl FnMut(State, Action) -> bool) {
        let pairs = (0..self.states())
            .flat_map(|state| (0..self.actions).map(move |action| (State(state), Action(action))));
        let mask: Vec<bool> = pairs.map(|(state, action)| allows(state, action)).collect();
        self.mask = mask.contains(&false).then_some(mask);
        self.find_all_best();
    }

    /// Takes over the mask of an environment that restricts its actions. Returns `true` if that
    /// changes the table.
    pub(crate) fn restrict_as<E: Environment + ?Sized>(&mut self, environment: &E) -> bool {
        let before = self.mask.take();
        self.restrict(|state, action| environment.allows(state, action));
        if self.mask.is_none() {
            self.mask = before;
            self.find_all_best();
            return false;
        }
        self.mask != before
    }

    /// Adds the states that a dynamic environment has met, and asks for the actions that `state`
    /// offers now.
    pub(crate) fn meet<E: Environment + ?Sized>(
        &mut self,
        environment: &E,
        state: State,
    ) -> Result<(), Error> {
        self.dynamic = true;
        for new in self.states()..environment.states() {
            self.grow(new + 1)?;
            self.ask(environment, State(new));
        }
        self.check_state(state)?;
        self.ask(environment, state);
        Ok(())
    }

    /// Restricts a state to the actions that an environment allows there now.
    fn ask<E: Environment + ?Sized>(&mut self, environment: &E, state: State) {
        for action in (0..self.actions).map(Action) {
            let allowed = environment.allows(state, action);
            if allowed == self.allows(state, action) {
                continue;
            }
            let entry = self.start(state) + action.0;
            let all = || vec![true; self.values.len()];
            self.mask.get_or_insert_with(all)[entry] = allowed;
            self.find_best(state);
        }
    }

    /// Returns one truth value for each action of a state if the table is restricted.
    #[inline]
    pub(crate) fn mask_row(&self, state: State) -> Option<&[bool]> {
        let mask = self.mask.as_ref()?;
        Some(&mask[self.start(state)..][..self.actions])
    }

    /// Returns `true` if some state does not offer all actions.
    #[inline(always)]
    pub(crate) fn is_restricted(&self) -> bool {
        self.mask.is_some()
    }

    /// Returns `true` if a state offers an action.
    #[inline]
    pub fn allows(&self, state: State, action: Action) -> bool {
        self.mask_row(state).is_none_or(|row| row[action.0])
    }

    /// Returns the actions that a state offers, by ascending index.
    pub fn offered(&self, state: State) -> impl Iterator<Item = Action> + '_ {
        let row = self.mask_row(state);
        (0..self.actions)
            .filter(move |&action| row.is_none_or(|row| row[action]))
            .map(Action)
    }
}
