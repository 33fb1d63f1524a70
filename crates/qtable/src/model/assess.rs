//! The quality of a policy under a known model, exactly.

use crate::error::{
    Error, check_fraction, check_index, check_not_negative, check_setting, positive,
};
use crate::model::dynamics::Model;
use crate::model::played::ModelEnvironment;
use crate::problem::Environment;
use crate::step::{Action, State};
use crate::table::QTable;

/// The expected results of a policy within a limited number of steps. They are exact, not sampled.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Assessment {
    /// Probability that the episode ends in success.
    pub success: f64,
    /// Expected number of steps of an episode; one that reaches the limit counts as the limit.
    pub steps: f64,
    /// Expected number of steps of an episode that succeeds; `None` if none does.
    pub steps_to_success: Option<f64>,
    /// Expected sum of rewards, undiscounted.
    pub total_reward: f64,
    /// Expected discounted sum of rewards.
    pub value: f64,
}

impl ModelEnvironment {
    /// Returns the expected results of a deterministic policy from the first states, in episodes
    /// that are truncated after `limit` steps.
    ///
    /// # Errors
    /// A policy of the wrong length or with an action that is not offered, γ outside `0..=1`, or a
    /// limit of 0.
    pub fn assess(&self, policy: &[Action], gamma: f64, limit: u64) -> Result<Assessment, Error> {
        check_fraction("gamma", gamma)?;
        positive("limit", limit)?;
        self.model().check_policy(policy)?;
        let mut present = self.model().spread_start(self.start())?;
        let mut next = vec![0.0; present.len()];
        let mut sums = Assessment::default();
        let (mut steps_of_successes, mut discount) = (0.0, 1.0);
        for taken in 1..=limit {
            next.fill(0.0);
            for (state, &share) in present.iter().enumerate() {
                if share <= 0.0 {
                    continue;
                }
                sums.steps += share;
                for outcome in self.model().outcomes(State(state), policy[state]) {
                    let share = share * outcome.probability;
                    sums.total_reward += share * outcome.reward;
                    sums.value += share * discount * outcome.reward;
                    if !outcome.terminated {
                        next[outcome.next.0] += share;
                    } else if self.succeeded(&outcome.step()) == Some(true) {
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

    /// Returns the results of the greedy policy of a table, then those of an optimal policy for γ.
    ///
    /// # Errors
    /// [`assess`](ModelEnvironment::assess) and [`Model::value_iteration`] list them.
    pub fn compare(
        &self,
        table: &QTable,
        gamma: f64,
        limit: u64,
    ) -> Result<[Assessment; 2], Error> {
        let plan = self.model().value_iteration(gamma, 1e-10)?;
        let learned = self.assess(&table.greedy(), gamma, limit)?;
        Ok([learned, self.assess(&plan.table.greedy(), gamma, limit)?])
    }
}

impl Model {
    /// Returns the probability of each state from a list of first states.
    pub(super) fn spread_start(&self, start: &[(State, f64)]) -> Result<Vec<f64>, Error> {
        let mut spread = vec![0.0; self.states];
        for &(state, probability) in start {
            check_index("state", state.0, self.states)?;
            check_not_negative("the probability of a first state", probability)?;
            spread[state.0] += probability;
        }
        let sum: f64 = spread.iter().sum();
        let whole = (sum - 1.0).abs() <= 1e-6;
        check_setting(
            "the sum of the first states' probabilities",
            sum,
            whole,
            "1 to within 1e-6",
        )?;
        Ok(spread)
    }
}
