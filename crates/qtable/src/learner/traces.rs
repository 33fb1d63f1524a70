//! Learning with eligibility traces.

use rand::Rng;

use crate::error::{Error, check_finite, check_fraction};
use crate::learner::rule::{Experience, Learner, Rates, is_greedy};
use crate::learner::target::{Target, probabilities};
use crate::policy::Policy;
use crate::schedule::Schedule;
use crate::scratch::Scratch;
use crate::step::{Action, State, Status};
use crate::table::QTable;
use crate::validated::validated;

/// Traces smaller than this are dropped.
const SMALLEST_TRACE: f64 = 1e-6;

validated! {
    /// Q(λ), SARSA(λ), Expected SARSA(λ) and TB(λ) with replacing traces (Singh and Sutton 1996):
    /// the error `δ = r + γ V(s') - Q(s,a)`, with V by the [`Target`], moves every pair on the way
    /// by `α δ e`. The trace e is 1 for the present pair and decays by γλ with each step.
    ///
    /// With [`Target::Q`] an exploratory action cuts all traces, after Watkins. With
    /// [`Target::UncutQ`] earlier pairs are moved by the error from the state's best value,
    /// `r + γ V(s') - V(s)`, so that the price of exploring is charged to the action that explored
    /// (Peng and Williams). With [`Target::TreeBackup`] traces decay by the probability of the
    /// action too. λ = 0 is one-step learning, λ = 1 close to Monte Carlo. Traces below 1e-6 are
    /// dropped. α is that of the present pair, for all traces.
    ///
    /// (The "naive" form, Watkins's without the cut, is not offered: on the cliff problem its
    /// values grow without bound.)
    ///
    /// ```
    /// use qtable::rand::{SeedableRng, rngs::Xoshiro256PlusPlus};
    /// use qtable::{
    ///     EpsilonGreedy, ModelEnvironment, QTable, Schedule, State, Target, Traces, Training,
    ///     Until,
    /// };
    ///
    /// fn main() -> Result<(), qtable::Error> {
    ///     let mut chain = ModelEnvironment::chain(20)?;
    ///     let q_lambda = Traces::new(Target::Q, 0.9, Schedule::constant(0.5)?, 0.9)?;
    ///     let policy = EpsilonGreedy::new(Schedule::constant(0.3)?)?;
    ///     let mut training = Training::new(&chain, QTable::new(20, 2)?, q_lambda, policy)?;
    ///     let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    ///     training.run(&mut chain, Until::Episodes(200), &mut rng)?;
    ///     assert!((training.table().max(State(0)) - 0.9f64.powi(18)).abs() < 0.01);
    ///     Ok(())
    /// }
    /// ```
    #[derive(Clone, Debug, PartialEq)]
    pub struct Traces {
        rates: Rates,
        target: Target,
        lambda: f64,
        recent: Recent,
        #[cfg_attr(feature = "serde", serde(skip))]
        probabilities: Scratch,
    }
}

impl Traces {
    /// Creates the learner with λ, in `0..=1`, a schedule of α over its updates, episodes or
    /// visits, and the discount factor γ.
    ///
    /// # Errors
    /// [`Error::Setting`] if λ, α or γ leaves `0..=1`.
    pub fn new(target: Target, lambda: f64, alpha: Schedule, gamma: f64) -> Result<Self, Error> {
        Self {
            rates: Rates::new(alpha, gamma)?,
            target,
            lambda,
            recent: Recent::default(),
            probabilities: Scratch::default(),
        }
        .restore()
    }

    fn restore(self) -> Result<Self, Error> {
        check_fraction("lambda", self.lambda)?;
        let mut traces = self.recent.traces.iter();
        traces.try_for_each(|&trace| check_fraction("a trace", trace))?;
        Ok(self)
    }
}

impl Learner for Traces {
    fn needs_next_action(&self) -> bool {
        self.target == Target::Sarsa
    }

    fn begin_episode(&mut self) {
        self.rates.clock.begin_episode();
        self.recent.clear();
    }

    fn learn(
        &mut self,
        table: &mut QTable,
        experience: &Experience,
        policy: &dyn Policy,
        _rng: &mut dyn Rng,
    ) -> Result<f64, Error> {
        let (state, action, step) = experience.parts(table)?;
        table.refresh(step.observation);
        let scratch = &mut self.probabilities;
        let next = match step.status {
            Status::Terminated => 0.0,
            Status::Continuing | Status::Truncated => {
                let next_action = experience.next_action;
                self.target
                    .value(table, step.observation, next_action, policy, scratch)?
            }
        };
        let target = self.rates.target(step, || next);
        let expected = match self.target {
            Target::Q | Target::UncutQ => table.max(state),
            _ => table.value(state, action),
        };
        match self.target {
            Target::Q if !is_greedy(table, state, action) => self.recent.clear(),
            Target::TreeBackup => {
                let taken = probabilities(table, state, policy, scratch)?[action.0];
                self.recent.decay(taken);
            }
            _ => {}
        }
        let old = table.value(state, action);
        let error = target - old;
        let visits = table.visits(state, action);
        let alpha = self.rates.alpha.current(&mut self.rates.clock, visits);
        check_finite("value", state, action, old + alpha * error)?;
        let entry = table.entry(state, action)?;
        if self.recent.shape != table.shape() || self.recent.head > Recent::SPARE {
            self.recent.compact(table)?;
        }
        self.recent.forget(entry, state, action);
        self.recent.spread(table, alpha * (target - expected))?;
        table.update(state, action, 1, |old, _| old + alpha * error)?;
        self.recent.push(entry, state, action);
        self.rates.clock.tick();
        match step.status {
            Status::Continuing => self.recent.decay(self.rates.gamma * self.lambda),
            Status::Terminated | Status::Truncated => self.recent.clear(),
        }
        Ok(error)
    }
}

/// Pairs with a trace, from the longest ago to the last. Traces never rise along the list, because
/// all decay together, but for the 0 of a pair that was visited again.
#[derive(Clone, Debug, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(from = "Vec<(State, Action, f64)>", into = "Vec<(State, Action, f64)>")
)]
struct Recent {
    /// Place from which on the traces are large enough.
    head: usize,
    pairs: Vec<(State, Action)>,
    traces: Vec<f64>,
    /// The factor by which all traces are still to be multiplied.
    decay: Option<f64>,
    /// Shape of the table in which all pairs lie.
    shape: (usize, usize),
    /// Place of the last visit of each entry of the table; a hint, which may be outdated.
    places: Vec<u32>,
}

impl PartialEq for Recent {
    fn eq(&self, other: &Self) -> bool {
        self.live().eq(other.live())
    }
}

impl From<Vec<(State, Action, f64)>> for Recent {
    fn from(stored: Vec<(State, Action, f64)>) -> Self {
        let pairs = stored.iter().map(|&(state, action, _)| (state, action));
        Self {
            pairs: pairs.collect(),
            traces: stored.iter().map(|&(.., trace)| trace).collect(),
            ..Self::default()
        }
    }
}

impl From<Recent> for Vec<(State, Action, f64)> {
    fn from(recent: Recent) -> Self {
        recent.live().collect()
    }
}

impl Recent {
    /// Most places before the list's head that are kept.
    const SPARE: usize = 256;

    #[inline(always)]
    fn live(&self) -> impl Iterator<Item = (State, Action, f64)> + '_ {
        let places = self.pairs[self.head..]
            .iter()
            .zip(&self.traces[self.head..]);
        let live = places.filter(|(_, trace)| **trace > 0.0);
        let decay = self.decay.unwrap_or(1.0);
        live.map(move |(&(state, action), &trace)| (state, action, trace * decay))
    }

    fn clear(&mut self) {
        self.head = 0;
        self.pairs.clear();
        self.traces.clear();
        self.decay = None;
    }

    /// Drops the places before the head, and notes the places of the others.
    fn compact(&mut self, table: &QTable) -> Result<(), Error> {
        self.pairs.drain(..self.head);
        self.traces.drain(..self.head);
        self.head = 0;
        for place in 0..self.pairs.len() {
            let (state, action) = self.pairs[place];
            self.note(table.entry(state, action)?, place);
        }
        self.shape = table.shape();
        Ok(())
    }

    fn note(&mut self, entry: usize, place: usize) {
        if entry >= self.places.len() {
            self.places.resize(entry + 1, 0);
        }
        self.places[entry] = place as u32;
    }

    /// Removes the trace of a pair.
    fn forget(&mut self, entry: usize, state: State, action: Action) {
        let place = self.places.get(entry).map_or(0, |&place| place as usize);
        if self.pairs.get(place) == Some(&(state, action)) {
            self.traces[place] = 0.0;
        }
    }

    /// Adds a pair with the trace 1.
    fn push(&mut self, entry: usize, state: State, action: Action) {
        self.note(entry, self.pairs.len());
        self.pairs.push((state, action));
        self.traces.push(1.0);
    }

    /// Moves every pair by `amount` times its trace: all of them, or none and an error.
    fn spread(&mut self, table: &mut QTable, amount: f64) -> Result<(), Error> {
        let (pairs, traces) = (&self.pairs[self.head..], &mut self.traces[self.head..]);
        table.add_to_all(pairs, traces, self.decay.unwrap_or(1.0), amount)?;
        self.decay = None;
        Ok(())
    }

    /// Multiplies all traces, when they are needed next, and drops the smallest.
    fn decay(&mut self, factor: f64) {
        if let Some(before) = self.decay.replace(factor) {
            for trace in &mut self.traces[self.head..] {
                *trace *= before;
            }
        }
        let small = |trace: &&f64| **trace * factor < SMALLEST_TRACE;
        self.head += self.traces[self.head..].iter().take_while(small).count();
    }
}
