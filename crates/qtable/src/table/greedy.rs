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
        let offered = self.mask.is_none() || self.allows(state, action);
        let entry = state.0 * self.actions + action.0;
        let (cell, count) = (&mut self.values[entry], &mut self.visits[entry]);
        let best = &mut self.best[state.0];
        let (old, value) = (*cell, value(*cell, *count));
        check_finite("value", state, action, value)?;
        *cell = value;
        *count = count.saturating_add(visits);
        if best.equals == OUTDATED {
            return Ok(());
        }
        if value > best.value {
            if offered {
                *best = Best::new(value, action.0 as u32, 1);
            }
        } else if (old >= best.value) != (value >= best.value) && offered {
            self.follow(state, action, value < old);
        }
        Ok(())
    }

    /// Keeps the best action after an offered action began or ceased to share the highest value.
    #[inline]
    fn follow(&mut self, state: State, action: Action, falls: bool) {
        let (best, action) = (&mut self.best[state.0], action.0 as u32);
        if !falls {
            best.equals += 1;
            best.action = best.action.min(action);
        } else if best.equals > 1 && best.action != action {
            best.equals -= 1;
        } else {
            self.find_best(state);
        }
    }

    /// Multiplies all factors, in `0..=1`, by `decay`, and adds `amount` times its factor to the
    /// value of each pair, all in the table and each once but for factors of 0: all of them, or
    /// none and an error if a value would not be finite. The best actions of these rows are
    /// outdated then, and searched when they are asked for.
    pub(crate) fn add_to_all(
        &mut self,
        pairs: &[(State, Action)],
        factors: &mut [f64],
        decay: f64,
        amount: f64,
    ) -> Result<(), Error> {
        // Half a unit in the last place of the largest number: less cannot lead beyond it.
        let harmless = amount.abs() < 2.0f64.powi(970);
        if !harmless {
            for (&(state, action), factor) in pairs.iter().zip(&*factors) {
                let value = self.value(state, action) + amount * (factor * decay);
                check_finite("value", state, action, value)?;
            }
        }
        let actions = self.actions;
        for (&(state, action), factor) in pairs.iter().zip(factors) {
            *factor *= decay;
            self.values[state.0 * actions + action.0] += amount * *factor;
            self.best[state.0].equals = OUTDATED;
        }
        Ok(())
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
    #[inline(always)]
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
                        table
                            .add_to_all(&several, &mut [1.0, 0.0, 0.5], 0.5, amount)
                            .unwrap();
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
    fn a_sum_that_is_not_finite_changes_nothing() {
        let mut table = QTable::filled(2, 2, 1e308).unwrap();
        let pairs = [(State(0), Action(1)), (State(1), Action(0))];
        let before = table.clone();
        assert!(
            table
                .add_to_all(&pairs, &mut [1e-9, 1.0], 1.0, 1e308)
                .is_err()
        );
        assert!(
            table
                .add_to_all(&pairs, &mut [1e-9, 1.0], 1.0, f64::NAN)
                .is_err()
        );
        assert_eq!(table.values, before.values);
        assert_eq!(table.greedy(), before.greedy());
        let largest = QTable::filled(2, 2, f64::MAX).unwrap();
        let mut table = largest.clone();
        let amount = 2.0f64.powi(970).next_down();
        table
            .add_to_all(&pairs, &mut [1.0; 2], 1.0, amount)
            .unwrap();
        assert_eq!(table.values, largest.values);
    }
}
