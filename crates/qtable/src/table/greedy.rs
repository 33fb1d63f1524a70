//! The best actions of a table, kept from write to write.

use crate::error::{Error, check_finite};
use crate::step::{Action, State};
use crate::table::best::{Best, OUTDATED};
use crate::table::qtable::QTable;

impl QTable {
    /// Returns the highest value among the actions that a state offers.
    #[inline(always)]
    pub fn max(&self, state: State) -> f64 {
        match &self.best[state.0] {
            best if best.equals == OUTDATED => self.found(state).0,
            best => best.value,
        }
    }

    /// Returns the action of the highest value among those that a state offers; of several, the one
    /// with the lowest index.
    #[inline(always)]
    pub fn best(&self, state: State) -> Action {
        match &self.best[state.0] {
            best if best.equals == OUTDATED => Action(self.found(state).1),
            best => Action(best.action as usize),
        }
    }

    /// Returns the number of offered actions that share the highest value.
    #[inline(always)]
    pub(crate) fn equals(&self, state: State) -> usize {
        match &self.best[state.0] {
            best if best.equals == OUTDATED => self.found(state).2,
            best => best.equals as usize,
        }
    }

    /// Searches the best action of a row whose entry is outdated.
    #[cold]
    #[inline(never)]
    fn found(&self, state: State) -> (f64, usize, usize) {
        let found = self.searched(state);
        (found.value, found.action as usize, found.equals as usize)
    }

    /// Prepares a state for a choice: its best action is up to date afterwards.
    ///
    /// # Errors
    /// A state out of range, or one without an action.
    #[inline(always)]
    pub(crate) fn prepare(&mut self, state: State) -> Result<(), Error> {
        match self.best.get(state.0) {
            Some(best) if best.equals.wrapping_sub(1) < OUTDATED - 1 => Ok(()),
            _ => self.prepare_anew(state),
        }
    }

    #[cold]
    #[inline(never)]
    fn prepare_anew(&mut self, state: State) -> Result<(), Error> {
        self.check_state(state)?;
        self.find_best(state);
        match self.equals(state) {
            0 => Err(Error::NoActionAllowed(state)),
            _ => Ok(()),
        }
    }

    /// Returns the best action of a state if it is known to be the only one.
    #[inline(always)]
    pub(crate) fn only_best(&self, state: State) -> Option<Action> {
        let best = &self.best[state.0];
        (best.equals == 1).then_some(Action(best.action as usize))
    }

    /// Writes a value at a pair that was checked, if it is finite, and keeps the best action.
    #[inline(always)]
    pub(crate) fn store(&mut self, state: State, action: Action, value: f64) -> Result<(), Error> {
        self.update(state, action, 0, |_, _| value)
    }

    /// Writes a value at a pair that was checked, made from the value and the visits before, and
    /// adds visits; nothing at all if the value is not finite. Keeps the best action.
    #[inline(always)]
    pub(crate) fn update(
        &mut self,
        state: State,
        action: Action,
        visits: u32,
        value: impl FnOnce(f64, u32) -> f64,
    ) -> Result<(), Error> {
        let entry = state.0 * self.actions + action.0;
        let (cell, count) = (&mut self.values[entry], &mut self.visits[entry]);
        let best = &mut self.best[state.0];
        let (old, value) = (*cell, value(*cell, *count));
        check_finite("value", state, action, value)?;
        *cell = value;
        *count = count.saturating_add(visits);
        let index = action.0 as u32;
        // The best of a row that is up to date and offers any.
        if index == best.action && best.equals.wrapping_sub(1) < OUTDATED - 1 {
            best.value = value;
            if value < old {
                self.find_best(state);
            } else if value > old {
                best.equals = 1;
            }
        } else if (old >= best.value || value >= best.value)
            && best.equals != OUTDATED
            && self.allows(state, action)
        {
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
            *best = Best::new(value, action, 1);
            return;
        }
        let (was, is) = (old >= best.value, value >= best.value);
        best.equals = best.equals + u32::from(is) - u32::from(was);
        if is {
            best.action = best.action.min(action);
        }
    }

    /// Adds `amount` times its factor to the value of each pair, all in the table, and writes the
    /// values before into `before`. Returns `false` if a value is not finite now. The best actions
    /// of these rows are outdated then, and searched when they are asked for.
    pub(crate) fn add_to_all(
        &mut self,
        pairs: &[(State, Action)],
        factors: &[f64],
        amount: f64,
        before: &mut [f64],
    ) -> bool {
        // Stays 0 as long as all values are finite.
        let mut sum = 0.0;
        for ((&(state, action), factor), before) in pairs.iter().zip(factors).zip(before) {
            let value = &mut self.values[state.0 * self.actions + action.0];
            *before = *value;
            *value += amount * factor;
            sum += 0.0 * *value;
            self.best[state.0].equals = OUTDATED;
        }
        sum == 0.0
    }

    /// Writes values back that [`add_to_all`](QTable::add_to_all) has replaced.
    #[cold]
    pub(crate) fn put_back(&mut self, pairs: &[(State, Action)], before: &[f64]) {
        for (&(state, action), &value) in pairs.iter().zip(before).rev() {
            self.values[state.0 * self.actions + action.0] = value;
            self.find_best(state);
        }
    }

    /// Searches the best action of a row that is outdated.
    #[inline(always)]
    pub(crate) fn refresh(&mut self, state: State) {
        if self.best[state.0].equals == OUTDATED {
            self.find_best(state);
        }
    }

    #[inline(never)]
    pub(super) fn find_best(&mut self, state: State) {
        self.best[state.0] = self.searched(state);
    }

    /// Searches the best action of a row.
    #[inline(never)]
    fn searched(&self, state: State) -> Best {
        let row = &self.values[state.0 * self.actions..][..self.actions];
        let higher = |a: f64, b: f64| if b > a { b } else { a };
        let mut found = Best::new(row[0], 0, 0);
        match self.mask_row(state) {
            None if row.len() < 16 => {
                // Selections instead of branches, which such short rows would mostly mispredict.
                for (action, &value) in row.iter().enumerate() {
                    let (above, level) = (value > found.value, value >= found.value);
                    let equals = found.equals + u32::from(level);
                    found.equals = if above { 1 } else { equals };
                    found.action = if above { action as u32 } else { found.action };
                    found.value = higher(found.value, value);
                }
            }
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
            Some(offered) => {
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
        found
    }

    pub(super) fn find_all_best(&mut self) {
        for state in 0..self.states() {
            self.find_best(State(state));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::rngs::Xoshiro256PlusPlus;
    use rand::{RngExt, SeedableRng};

    /// Few different values, so that there are many ties.
    #[test]
    fn the_best_action_is_found_after_any_order_of_writes() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        for (actions, masked) in [(2, false), (4, false), (5, true), (20, false), (20, true)] {
            let mut table = QTable::new(3, actions).unwrap();
            if masked {
                table.restrict(|state, action| !(state.0 + action.0).is_multiple_of(3));
            }
            for _ in 0..2000 {
                let mut pair = || {
                    let state = State(rng.random_range(0..3));
                    (state, Action(rng.random_range(0..actions)))
                };
                let (several, (state, action)) = ([pair(), pair(), pair()], pair());
                match rng.random_range(0..3) {
                    0 => {
                        let amount = f64::from(rng.random_range(-2..=2));
                        let finite =
                            table.add_to_all(&several, &[1.0, 0.0, 2.0], amount, &mut [0.0; 3]);
                        assert!(finite);
                    }
                    1 => table.refresh(state),
                    _ if table.allows(state, action) => {
                        let value = f64::from(rng.random_range(-3..=3));
                        table.set(state, action, value).unwrap();
                    }
                    _ => {}
                }
                let mut fresh = table.clone();
                fresh.find_all_best();
                for state in (0..3).map(State) {
                    let wanted = (fresh.max(state), fresh.best(state), fresh.equals(state));
                    let found = (table.max(state), table.best(state), table.equals(state));
                    assert_eq!(found, wanted);
                    let only = (wanted.2 == 1).then_some(wanted.1);
                    assert!(table.only_best(state).is_none_or(|best| Some(best) == only));
                }
            }
        }
    }

    #[test]
    fn values_that_are_not_finite_are_put_back() {
        let mut table = QTable::filled(2, 2, 1e308).unwrap();
        let pairs = [
            (State(0), Action(1)),
            (State(1), Action(0)),
            (State(0), Action(1)),
        ];
        let (before, mut kept) = (table.clone(), [0.0; 3]);
        assert!(!table.add_to_all(&pairs, &[1e-9, 1.0, 1.0], 1e308, &mut kept));
        table.put_back(&pairs, &kept);
        assert_eq!(table.values, before.values);
        assert_eq!(table.greedy(), before.greedy());
    }
}
