//! The optimum of a known model, by dynamic programming.

use crate::error::{Error, check_gamma, check_setting};
use crate::model::dynamics::Model;
use crate::step::{Action, State};
use crate::table::QTable;

/// Sweeps after which a computation is given up.
const MOST_SWEEPS: u64 = 1_000_000;

/// An optimal policy and its values.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The optimal action values Q*; its greedy policy is optimal. It carries the model's mask.
    pub table: QTable,
    /// Sweeps over all states that it took.
    pub sweeps: u64,
    /// Largest change of a value in the last sweep. For γ < 1 no value is further than
    /// `change γ / (1 - γ)` from the optimum.
    pub change: f64,
}

impl Model {
    /// Value iteration (Bellman 1957), in place: sweeps
    /// `Q(s,a) <- Σ p (r + γ max over b of Q(s',b))` until no value changes by more than
    /// `tolerance`, in units of the values.
    ///
    /// γ = 1 is allowed; it converges where every policy worth having reaches an end.
    ///
    /// # Errors
    /// γ outside `0..=1`, a tolerance that is not positive, values that overflow, or
    /// [`Error::NotConverged`].
    pub fn value_iteration(&self, gamma: f64, tolerance: f64) -> Result<Plan, Error> {
        check_limits(gamma, tolerance)?;
        let mut table = self.empty_table()?;
        let (mut sweeps, mut change) = (0, f64::INFINITY);
        while change > tolerance {
            if sweeps == MOST_SWEEPS {
                return Err(Error::NotConverged { sweeps, change });
            }
            change = 0.0;
            for (state, action) in self.offered() {
                let value = self.backup(state, action, gamma, |next| table.max(next));
                change = f64::max(change, (value - table.value(state, action)).abs());
                table.set(state, action, value)?;
            }
            sweeps += 1;
        }
        Ok(Plan {
            table,
            sweeps,
            change,
        })
    }

    /// Policy iteration (Howard 1960): values the present policy, makes it greedy for these values,
    /// and so on until it stays. The valuations are iterative, to `tolerance`.
    ///
    /// At γ = 1 a policy met on the way may never end; then it does not converge and value
    /// iteration is the way.
    ///
    /// # Errors
    /// As [`Model::value_iteration`].
    pub fn policy_iteration(&self, gamma: f64, tolerance: f64) -> Result<Plan, Error> {
        check_limits(gamma, tolerance)?;
        let mut table = self.empty_table()?;
        let mut policy = table.greedy();
        let mut sweeps = 0;
        loop {
            let (values, change, taken) = self.value_policy(&policy, gamma, tolerance)?;
            sweeps += taken;
            for (state, action) in self.offered() {
                table.set(
                    state,
                    action,
                    self.backup(state, action, gamma, |next| values[next.0]),
                )?;
            }
            let mut stable = true;
            for (state, action) in policy.iter_mut().enumerate() {
                let better = table.max(State(state)) - table.value(State(state), *action);
                // Less than the values are known to is no reason to change.
                if better > tolerance * 10.0 {
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
            if sweeps >= MOST_SWEEPS {
                return Err(Error::NotConverged { sweeps, change });
            }
        }
    }

    /// The value of each state under a deterministic policy, to `tolerance`.
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

    /// Values, the last change and the sweeps taken.
    fn value_policy(
        &self,
        policy: &[Action],
        gamma: f64,
        tolerance: f64,
    ) -> Result<(Vec<f64>, f64, u64), Error> {
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
            if !change.is_finite() || sweeps == MOST_SWEEPS {
                return Err(Error::NotConverged { sweeps, change });
            }
        }
    }

    /// Refuses a policy that does not name an offered action for each state.
    pub(super) fn check_policy(&self, policy: &[Action]) -> Result<(), Error> {
        if policy.len() != self.states {
            return Err(Error::WrongLength {
                what: "the policy",
                needed: self.states,
                found: policy.len(),
            });
        }
        for (state, &action) in policy.iter().enumerate() {
            let (state, actions) = (State(state), self.actions);
            if action.0 >= actions {
                return Err(Error::ActionOutOfRange { action, actions });
            }
            if self.outcomes(state, action).is_empty() {
                return Err(Error::ActionNotAllowed { state, action });
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
        table.set_mask(self.mask.clone())?;
        Ok(table)
    }
}

fn check_limits(gamma: f64, tolerance: f64) -> Result<(), Error> {
    check_gamma(gamma)?;
    let positive = tolerance.is_finite() && tolerance > 0.0;
    check_setting("tolerance", tolerance, positive, "positive and finite")
}
