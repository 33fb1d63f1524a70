//! The learners with eligibility traces: Q(λ) and SARSA(λ).

use rand::Rng;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::{Error, check_setting};
use crate::learner::rule::{Experience, Learner, Rates, check, constructor, is_greedy, next_value};
use crate::policy::Policy;
use crate::schedule::Schedule;
use crate::step::{Action, State, Status};
use crate::table::{QTable, check_value};
use crate::validated::validated;

/// Traces smaller than this are dropped.
const SMALLEST_TRACE: f64 = 1e-6;

validated! {
    /// Replacing traces (Singh and Sutton 1996): a visit sets the pair's trace to 1, and each step
    /// lets it decay by γλ.
    #[derive(Clone, Debug, PartialEq)]
    struct Traces {
        lambda: f64,
        /// Pairs with a trace, from the longest ago to the last.
        recent: Vec<(State, Action, f64)>,
    }
}

impl Traces {
    fn new(lambda: f64) -> Result<Self, Error> {
        Self {
            lambda,
            recent: Vec::new(),
        }
        .restore()
    }

    fn restore(self) -> Result<Self, Error> {
        check_setting(
            "lambda",
            self.lambda,
            (0.0..=1.0).contains(&self.lambda),
            "in 0..=1",
        )?;
        if let Some(&(.., trace)) = self
            .recent
            .iter()
            .find(|(.., trace)| !(0.0..=1.0).contains(trace))
        {
            check_setting("a trace", trace, false, "in 0..=1")?;
        }
        Ok(self)
    }

    fn forget(&mut self, state: State, action: Action) {
        self.recent.retain(|&(s, a, _)| (s, a) != (state, action));
    }

    /// Moves every pair by `amount` times its trace: all of them, or none and an error.
    fn spread(&self, table: &mut QTable, amount: f64) -> Result<(), Error> {
        let moved =
            |table: &QTable, state, action, trace| table.value(state, action) + amount * trace;
        for &(state, action, trace) in &self.recent {
            table.check(state, action)?;
            check_value(state, action, moved(table, state, action, trace))?;
        }
        for &(state, action, trace) in &self.recent {
            table.store(state, action, moved(table, state, action, trace))?;
        }
        Ok(())
    }

    fn decay(&mut self, gamma: f64) {
        let factor = gamma * self.lambda;
        for (.., trace) in &mut self.recent {
            *trace *= factor;
        }
        self.recent.retain(|&(.., trace)| trace >= SMALLEST_TRACE);
    }
}

/// One update of a trace learner: the present pair moves toward `target`, earlier ones by how far
/// the target is from what was `expected` of the state.
fn learn_along(
    rates: &mut Rates,
    traces: &mut Traces,
    table: &mut QTable,
    experience: &Experience,
    target: f64,
    expected: f64,
) -> Result<f64, Error> {
    let (state, action, step) = (experience.state, experience.action, &experience.step);
    let old = table.value(state, action);
    let error = target - old;
    let alpha = rates.alpha(table, state, action);
    check_value(state, action, old + alpha * error)?;
    traces.forget(state, action);
    traces.spread(table, alpha * (target - expected))?;
    table.store(state, action, old + alpha * error)?;
    traces.recent.push((state, action, 1.0));
    table.visit(state, action)?;
    rates.clock.tick();
    match step.status {
        Status::Continuing => traces.decay(rates.gamma),
        Status::Terminated | Status::Truncated => traces.recent.clear(),
    }
    Ok(error)
}

/// Q(λ) with replacing traces: the error of Q-learning, `δ = r + γ max over b of Q(s',b) - Q(s,a)`,
/// moves every pair on the way by `α δ e`, where the trace e is 1 for the present pair and decays
/// by γλ with each step.
///
/// After Watkins (1989): an exploratory action cuts all traces, because what follows it is not what
/// the greedy policy would have met. [`uncut`](QLambda::uncut) is the form of Peng and Williams
/// (1996), quicker while much is explored, with a bias toward the policy that acts. Default: λ =
/// 0.8, cut. Traces below 1e-6 are dropped.
///
/// (The "naive" form, Watkins's without the cut, is not offered: on the cliff problem its values
/// grow without bound.)
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct QLambda {
    rates: Rates,
    traces: Traces,
    cut: bool,
}

impl QLambda {
    constructor!(traces: Traces::new(0.8)?, cut: true);

    /// Sets λ, in `0..=1`: 0 is one-step Q-learning, 1 lets traces decay by γ alone.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn with_lambda(self, lambda: f64) -> Result<Self, Error> {
        Ok(Self {
            traces: Traces::new(lambda)?,
            ..self
        })
    }

    /// Lets the traces live through exploratory actions, after Peng and Williams: earlier pairs are
    /// moved by the error from the state's best value,
    /// `r + γ max over b of Q(s',b) - max over b of Q(s,b)`, and only the present pair by δ, so
    /// that the price of exploring is charged to the action that explored.
    pub fn uncut(self) -> Self {
        Self { cut: false, ..self }
    }
}

impl Learner for QLambda {
    fn begin_episode(&mut self) {
        self.rates.clock.begin_episode();
        self.traces.recent.clear();
    }

    fn learn(
        &mut self,
        table: &mut QTable,
        experience: &Experience,
        _policy: &dyn Policy,
        _rng: &mut dyn Rng,
    ) -> Result<f64, Error> {
        let (state, action, step) = (experience.state, experience.action, &experience.step);
        check(table, state, action, step)?;
        let target = self.rates.greedy_target(table, step);
        if self.cut && !is_greedy(table, state, action) {
            self.traces.recent.clear();
        }
        let expected = table.max(state);
        learn_along(
            &mut self.rates,
            &mut self.traces,
            table,
            experience,
            target,
            expected,
        )
    }
}

/// SARSA(λ) with replacing traces (Singh and Sutton 1996): the error of SARSA,
/// `δ = r + γ Q(s',a') - Q(s,a)`, moves every pair on the way by `α δ e`, where the trace e is 1
/// for the present pair and decays by γλ with each step.
///
/// Default: λ = 0.8. Traces below 1e-6 are dropped.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct SarsaLambda {
    rates: Rates,
    traces: Traces,
}

impl SarsaLambda {
    constructor!(traces: Traces::new(0.8)?);

    /// Sets λ, in `0..=1`: 0 is one-step SARSA, 1 is close to Monte Carlo.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn with_lambda(self, lambda: f64) -> Result<Self, Error> {
        Ok(Self {
            traces: Traces::new(lambda)?,
            ..self
        })
    }
}

impl Learner for SarsaLambda {
    fn needs_next_action(&self) -> bool {
        true
    }

    fn begin_episode(&mut self) {
        self.rates.clock.begin_episode();
        self.traces.recent.clear();
    }

    fn learn(
        &mut self,
        table: &mut QTable,
        experience: &Experience,
        _policy: &dyn Policy,
        _rng: &mut dyn Rng,
    ) -> Result<f64, Error> {
        check(table, experience.state, experience.action, &experience.step)?;
        let next = next_value(table, experience)?;
        let target = self.rates.target(&experience.step, || next);
        let expected = table.value(experience.state, experience.action);
        learn_along(
            &mut self.rates,
            &mut self.traces,
            table,
            experience,
            target,
            expected,
        )
    }
}
