//! How good a policy is under a known model: exactly, not by trying.

use crate::error::{Error, check_gamma, check_setting};
use crate::index::{Action, State};
use crate::model::dynamics::Model;
use crate::problem::Step;
use crate::table::{QTable, Value};

/// What a policy achieves within a limited number of steps, from a distribution of first states.
/// These are exact expectations, not samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Assessment {
    /// Probability that the episode ends in success.
    pub success: f64,
    /// Expected number of steps of an episode, one that reaches the limit counting as the limit.
    pub steps: f64,
    /// Expected number of steps of an episode that succeeds; `None` if none does.
    pub steps_to_success: Option<f64>,
    /// Expected sum of rewards, undiscounted.
    pub total_reward: f64,
    /// Expected discounted sum of rewards.
    pub value: f64,
}

/// A learned policy beside an optimal one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// What the learned policy achieves.
    pub learned: Assessment,
    /// What an optimal policy achieves.
    pub optimal: Assessment,
}

impl Model {
    /// What a deterministic policy achieves.
    ///
    /// `start` gives the probability of each first state; `limit` is the number of steps after
    /// which an episode is truncated; `succeeded` tells which last step is a success.
    ///
    /// # Errors
    /// A policy of the wrong length or with an action that is not offered, a first state out of
    /// range, probabilities that do not sum to 1, γ outside `0..=1`, or a limit of 0.
    pub fn assess(
        &self,
        policy: &[Action],
        start: &[(State, f64)],
        gamma: f64,
        limit: u64,
        succeeded: impl Fn(&Step) -> bool,
    ) -> Result<Assessment, Error> {
        check_gamma(gamma)?;
        check_setting("limit", limit as f64, limit > 0, "at least 1")?;
        self.check_policy(policy)?;
        let mut present = self.spread_start(start)?;
        let mut next = vec![0.0; self.states];
        let mut sums = Assessment::default();
        let (mut steps_of_successes, mut discount) = (0.0, 1.0);
        for taken in 1..=limit {
            next.fill(0.0);
            for (state, &share) in present
                .iter()
                .enumerate()
                .filter(|&(_, &share)| share > 0.0)
            {
                sums.steps += share;
                for outcome in self.outcomes(State(state), policy[state]) {
                    let share = share * outcome.probability;
                    sums.total_reward += share * outcome.reward;
                    sums.value += share * discount * outcome.reward;
                    if !outcome.terminated {
                        next[outcome.next.0] += share;
                    } else if succeeded(&outcome.step()) {
                        sums.success += share;
                        steps_of_successes += share * taken as f64;
                    }
                }
            }
            std::mem::swap(&mut present, &mut next);
            discount *= gamma;
            if !present.iter().any(|&share| share > 0.0) {
                break;
            }
        }
        sums.steps_to_success = (sums.success > 0.0).then(|| steps_of_successes / sums.success);
        Ok(sums)
    }

    /// The greedy policy of a table beside an optimal policy for γ, both assessed as by
    /// [`Model::assess`].
    ///
    /// # Errors
    /// As [`Model::assess`] and [`Model::value_iteration`].
    pub fn compare<V: Value>(
        &self,
        table: &QTable<V>,
        start: &[(State, f64)],
        gamma: f64,
        limit: u64,
        succeeded: impl Fn(&Step) -> bool,
    ) -> Result<Comparison, Error> {
        let plan = self.value_iteration(gamma, 1e-10)?;
        Ok(Comparison {
            learned: self.assess(&table.greedy(), start, gamma, limit, &succeeded)?,
            optimal: self.assess(&plan.table.greedy(), start, gamma, limit, &succeeded)?,
        })
    }

    /// The probability of each state from a list of first states.
    pub(super) fn spread_start(&self, start: &[(State, f64)]) -> Result<Vec<f64>, Error> {
        let mut spread = vec![0.0; self.states];
        for &(state, probability) in start {
            if state.0 >= self.states {
                return Err(Error::StateOutOfRange {
                    state,
                    states: self.states,
                });
            }
            let valid = (0.0..=1.0).contains(&probability);
            check_setting(
                "the probability of a first state",
                probability,
                valid,
                "in 0..=1",
            )?;
            spread[state.0] += probability;
        }
        let sum: f64 = spread.iter().sum();
        let whole = (sum - 1.0).abs() <= 1e-9;
        check_setting(
            "the sum of the first states' probabilities",
            sum,
            whole,
            "1 to within 1e-9",
        )?;
        Ok(spread)
    }
}
