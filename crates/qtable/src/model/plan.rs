//! The optimum of a known model, by dynamic programming.

use crate::error::{Error, check_fraction, check_index, check_length, check_setting};
use crate::model::dynamics::Model;
use crate::step::{Action, State};
use crate::table::QTable;

/// Most states for which a policy is valued by elimination.
const ELIMINATED: usize = 1000;

/// An optimal policy and its values.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Optimal action values Q*, whose greedy policy is optimal, under the model's mask.
    pub table: QTable,
    /// Sweeps over all states that it took.
    pub sweeps: u64,
    /// Largest change of a value in the last sweep. For γ < 1 no value is further than
    /// `change γ / (1 - γ)` from the optimum.
    pub change: f64,
}

impl Model {
    /// Plans by value iteration (Bellman 1957), in place: sweeps
    /// `Q(s,a) <- Σ p (r + γ max over b of Q(s',b))` until no value changes by more than
    /// `tolerance`, in units of the values.
    ///
    /// Up to 1000 states, where the sweeps are slow to settle, the greedy policy is valued by
    /// elimination in between. γ = 1 is allowed; the values settle where every policy worth having
    /// reaches an end.
    ///
    /// # Errors
    /// γ outside `0..=1`, a tolerance that is not positive, values that overflow, or
    /// [`Error::NotConverged`] after the [number of sweeps](Model::with_most_sweeps), or once the
    /// values are seen to grow without bound.
    pub fn value_iteration(&self, gamma: f64, tolerance: f64) -> Result<Plan, Error> {
        /// Sweeps from one elimination, or look at the course of the changes, to the next.
        const PART: u64 = 1000;
        check_limits(gamma, tolerance)?;
        let mut table = self.empty_table()?;
        let (mut sweeps, mut change, mut before) = (0, f64::INFINITY, f64::INFINITY);
        while change > tolerance {
            if sweeps == self.most_sweeps {
                return Err(Error::NotConverged(sweeps, change));
            }
            change = self.sweep(&mut table, gamma)?;
            sweeps += 1;
            if change <= tolerance || !sweeps.is_multiple_of(PART) {
                continue;
            }
            if let Some(values) = self.eliminate(&table.greedy(), gamma) {
                self.fill(&mut table, &values, gamma)?;
            } else if gamma >= 1.0 && change >= before && sweeps > 2 * self.states as u64 {
                return Err(Error::NotConverged(sweeps, change));
            }
            before = change;
        }
        Ok(Plan {
            table,
            sweeps,
            change,
        })
    }

    /// Plans by policy iteration (Howard 1960): values the present policy, makes it greedy for
    /// these values, and so on until it stays. It begins with the greedy policy after as many
    /// sweeps of value iteration as there are states, at most 1000.
    ///
    /// A policy is valued by elimination up to 1000 states, and by sweeps to `tolerance` beyond. At
    /// γ = 1 a policy met on the way may never end; then the sweeps do not settle, and value
    /// iteration is the better choice.
    ///
    /// # Errors
    /// [`Model::value_iteration`] lists them.
    pub fn policy_iteration(&self, gamma: f64, tolerance: f64) -> Result<Plan, Error> {
        check_limits(gamma, tolerance)?;
        let mut table = self.empty_table()?;
        let mut sweeps = 0;
        while sweeps < self.states.min(ELIMINATED) as u64 {
            sweeps += 1;
            if self.sweep(&mut table, gamma)? <= tolerance {
                break;
            }
        }
        let mut policy = table.greedy();
        loop {
            let (values, change, taken) = self.value_policy(&policy, gamma, tolerance)?;
            sweeps += taken;
            self.fill(&mut table, &values, gamma)?;
            let mut stable = true;
            for (state, action) in policy.iter_mut().enumerate() {
                let better = table.max(State(state)) - table.value(State(state), *action);
                // A gain below the accuracy of the values is no reason to change.
                if better > tolerance * 10.0 && !self.is_terminal(State(state)) {
                    *action = table.best(State(state));
                    stable = false;
                }
            }
            if stable {
                return Ok(Plan {
                    table,
                    sweeps,
                    change,
                });
            }
            if sweeps >= self.most_sweeps {
                return Err(Error::NotConverged(sweeps, change));
            }
        }
    }

    /// Returns the value of each state under a deterministic policy, by elimination up to 1000
    /// states and by sweeps to `tolerance` beyond. The action given for a terminal state is
    /// ignored.
    ///
    /// # Errors
    /// A policy of the wrong length or with an action that is not offered, γ outside `0..=1`, a
    /// tolerance that is not positive, or [`Error::NotConverged`].
    pub fn evaluate(
        &self,
        policy: &[Action],
        gamma: f64,
        tolerance: f64,
    ) -> Result<Vec<f64>, Error> {
        check_limits(gamma, tolerance)?;
        self.check_policy(policy)?;
        self.value_policy(policy, gamma, tolerance)
            .map(|(values, ..)| values)
    }

    /// Makes one sweep of value iteration and returns the largest change.
    fn sweep(&self, table: &mut QTable, gamma: f64) -> Result<f64, Error> {
        let mut change: f64 = 0.0;
        for (state, action) in self.offered() {
            let value = self.backup(state, action, gamma, |next| table.max(next));
            change = change.max((value - table.value(state, action)).abs());
            table.set(state, action, value)?;
        }
        Ok(change)
    }

    /// Sets every action value to what follows from the values of the states.
    fn fill(&self, table: &mut QTable, values: &[f64], gamma: f64) -> Result<(), Error> {
        for (state, action) in self.offered() {
            let value = self.backup(state, action, gamma, |next| values[next.0]);
            table.set(state, action, value)?;
        }
        Ok(())
    }

    /// Returns the values of a policy, the last change and the sweeps taken.
    fn value_policy(
        &self,
        policy: &[Action],
        gamma: f64,
        tolerance: f64,
    ) -> Result<(Vec<f64>, f64, u64), Error> {
        if let Some(values) = self.eliminate(policy, gamma) {
            return Ok((values, 0.0, 1));
        }
        let mut values = vec![0.0; self.states];
        let mut sweeps = 0;
        loop {
            let mut change: f64 = 0.0;
            for (state, &action) in policy.iter().enumerate() {
                let value = self.backup(State(state), action, gamma, |next| values[next.0]);
                change = change.max((value - values[state]).abs());
                values[state] = value;
            }
            sweeps += 1;
            if change <= tolerance {
                return Ok((values, change, sweeps));
            }
            if !change.is_finite() || sweeps == self.most_sweeps {
                return Err(Error::NotConverged(sweeps, change));
            }
        }
    }

    /// Solves `V = r + γ P V` for the values of a policy by elimination with pivots. `None` for
    /// more than 1000 states, and for a policy that has no values because it never ends.
    fn eliminate(&self, policy: &[Action], gamma: f64) -> Option<Vec<f64>> {
        let n = self.states;
        if n > ELIMINATED {
            return None;
        }
        let width = n + 1;
        let mut rows = vec![0.0; n * width];
        for (state, (row, &action)) in rows.chunks_exact_mut(width).zip(policy).enumerate() {
            row[state] = 1.0;
            for outcome in self.outcomes(State(state), action) {
                row[n] += outcome.probability * outcome.reward;
                if !outcome.terminated {
                    row[outcome.next.0] -= gamma * outcome.probability;
                }
            }
        }
        for column in 0..n {
            let size = |row: &usize| rows[row * width + column].abs();
            let pivot = (column..n).max_by(|a, b| size(a).total_cmp(&size(b)))?;
            if size(&pivot) < 1e-12 {
                return None;
            }
            if pivot != column {
                let (upper, lower) = rows.split_at_mut(pivot * width);
                upper[column * width..][..width].swap_with_slice(&mut lower[..width]);
            }
            let (upper, lower) = rows.split_at_mut((column + 1) * width);
            let pivot = &upper[column * width..];
            for row in lower.chunks_exact_mut(width) {
                let factor = row[column] / pivot[column];
                if factor != 0.0 {
                    for (entry, above) in row[column..].iter_mut().zip(&pivot[column..]) {
                        *entry -= factor * above;
                    }
                }
            }
        }
        let mut values = vec![0.0; n];
        for state in (0..n).rev() {
            let row = &rows[state * width..][..width];
            let known: f64 = (state + 1..n).map(|next| row[next] * values[next]).sum();
            values[state] = (row[n] - known) / row[state];
        }
        let finite = values.iter().all(|value| value.is_finite());
        finite.then_some(values)
    }

    /// Refuses a policy that does not name an offered action for each state that has one.
    pub(super) fn check_policy(&self, policy: &[Action]) -> Result<(), Error> {
        check_length("the policy", self.states, policy.len())?;
        for (state, &action) in policy.iter().enumerate() {
            let state = State(state);
            check_index("action", action.0, self.actions)?;
            if self.outcomes(state, action).is_empty() && !self.is_terminal(state) {
                return Err(Error::ActionNotAllowed(state, action));
            }
        }
        Ok(())
    }

    fn offered(&self) -> impl Iterator<Item = (State, Action)> + '_ {
        (0..self.states * self.actions)
            .map(|pair| (State(pair / self.actions), Action(pair % self.actions)))
            .filter(|&(state, action)| !self.outcomes(state, action).is_empty())
    }

    fn empty_table(&self) -> Result<QTable, Error> {
        let mut table = QTable::new(self.states, self.actions)?;
        table.restrict(|state, action| !self.outcomes(state, action).is_empty());
        Ok(table)
    }
}

fn check_limits(gamma: f64, tolerance: f64) -> Result<(), Error> {
    check_fraction("gamma", gamma)?;
    let positive = tolerance.is_finite() && tolerance > 0.0;
    check_setting("tolerance", tolerance, positive, "positive and finite")
}
