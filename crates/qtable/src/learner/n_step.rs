//! Learning from the rewards of n steps.

use std::collections::VecDeque;

use rand::Rng;

use crate::error::{Error, check_not_negative, check_setting};
use crate::learner::rule::{Experience, Learner, Rates, is_greedy};
use crate::learner::target::{Target, probabilities};
use crate::policy::Policy;
use crate::schedule::Schedule;
use crate::scratch::Scratch;
use crate::step::{Action, State, Status, Step};
use crate::table::QTable;
use crate::validated::validated;

validated! {
    /// SARSA, Expected SARSA, Q-learning and tree backup with returns of n steps:
    /// `Q(s0,a0) <- Q(s0,a0) + α (r1 + γ r2 + … + γ^(n-1) rn + γ^n V(sn) - Q(s0,a0))`, with V by
    /// the [`Target`].
    ///
    /// | method | Sutton and Barto | made by |
    /// |---|---|---|
    /// | SARSA | 6.4 | `NStep::new(Target::Sarsa, 1, alpha, gamma)` |
    /// | Expected SARSA | 6.6 | `NStep::new(Target::ExpectedSarsa, 1, alpha, gamma)` |
    /// | n-step SARSA | 7.2 | `NStep::new(Target::Sarsa, n, alpha, gamma)` |
    /// | n-step tree backup | 7.5 | `NStep::new(Target::TreeBackup, n, alpha, gamma)` |
    /// | Monte Carlo control | 5.4 | `NStep::new(Target::Sarsa, usize::MAX, alpha, gamma)` |
    /// | differential SARSA | 10.3 | [`with_average_reward`](NStep::with_average_reward) |
    ///
    /// A return is closed early when the episode ends. A pair is updated up to n steps after each
    /// visit; the visit is counted at once. For means over all returns, as in the book's Monte
    /// Carlo methods, α is [`Schedule::inverse_visits`]`(1.0, 1.0)`.
    ///
    /// ```
    /// use qtable::rand::{SeedableRng, rngs::Xoshiro256PlusPlus};
    /// use qtable::{
    ///     EpsilonGreedy, ModelEnvironment, NStep, QTable, Schedule, Target, Training, Until,
    /// };
    ///
    /// fn main() -> Result<(), qtable::Error> {
    ///     let mut cliff = ModelEnvironment::cliff_walking()?;
    ///     let sarsa = NStep::new(Target::Sarsa, 1, Schedule::constant(0.5)?, 1.0)?;
    ///     let policy = EpsilonGreedy::new(Schedule::constant(0.1)?)?;
    ///     let mut training = Training::new(&cliff, QTable::new(48, 4)?, sarsa, policy)?;
    ///     let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    ///     training.run(&mut cliff, Until::Episodes(1_000), &mut rng)?;
    ///     // Away from the edge.
    ///     let walked = cliff.assess(&training.table().greedy(), 1.0, 100)?;
    ///     assert!(walked.steps > 13.0);
    ///     Ok(())
    /// }
    /// ```
    #[derive(Clone, Debug, PartialEq)]
    pub struct NStep {
        rates: Rates,
        target: Target,
        n: usize,
        /// Rate of the average reward in units of α, and the average.
        average: (f64, f64),
        /// Pairs not yet updated, oldest first.
        pending: VecDeque<Pending>,
        #[cfg_attr(feature = "serde", serde(skip))]
        probabilities: Scratch,
    }
}

/// A visit whose update is still to come.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Pending {
    state: State,
    action: Action,
    /// The reward that followed.
    reward: f64,
    /// Visits of the pair before this one.
    visits: u32,
}

/// The state in which a return ends, and the action chosen there; `None` after a termination.
type End = Option<(State, Option<Action>)>;

impl NStep {
    /// Creates the learner with a number of steps, at least 1, a schedule of α over its updates,
    /// episodes or visits, and the discount factor γ.
    ///
    /// # Errors
    /// [`Error::Setting`] if `n` is 0, or α or γ leaves `0..=1`.
    pub fn new(target: Target, n: usize, alpha: Schedule, gamma: f64) -> Result<Self, Error> {
        Self {
            rates: Rates::new(alpha, gamma)?,
            target,
            n,
            average: (0.0, 0.0),
            pending: VecDeque::new(),
            probabilities: Scratch::default(),
        }
        .restore()
    }

    /// Learns how much better than the average reward each pair is, for tasks without an end
    /// (differential SARSA, Sutton and Barto 10.3; with [`Target::Q`] the differential Q-learning
    /// of Wan and others 2021). The average, at first 0, moves by `eta` α times each error.
    ///
    /// # Errors
    /// [`Error::Setting`] if γ is not 1, or `eta` is negative or not finite.
    pub fn with_average_reward(self, eta: f64) -> Result<Self, Error> {
        let gamma = self.rates.gamma;
        check_setting("gamma", gamma, gamma >= 1.0, "1 with an average reward")?;
        let average = (eta, 0.0);
        Self { average, ..self }.restore()
    }

    /// Returns the average reward of a step, 0 unless it is learned.
    pub fn average_reward(&self) -> f64 {
        self.average.1
    }

    fn restore(self) -> Result<Self, Error> {
        check_setting("n", self.n as f64, self.n > 0, "at least 1")?;
        check_not_negative("eta", self.average.0)?;
        let average = self.average.1;
        check_setting("the average reward", average, average.is_finite(), "finite")?;
        Ok(self)
    }

    /// Returns the value of the end of a return.
    #[inline(always)]
    fn tail(&mut self, table: &QTable, end: End, policy: &dyn Policy) -> Result<f64, Error> {
        end.map_or(Ok(0.0), |(state, next_action)| {
            self.target
                .value(table, state, next_action, policy, &mut self.probabilities)
        })
    }

    /// Computes the returns of all pending pairs, newest first, up to an end of value `tail`.
    /// Returns the last one, that of the oldest pair.
    #[inline(always)]
    fn returns(
        &mut self,
        table: &QTable,
        tail: f64,
        policy: &dyn Policy,
        mut on_return: impl FnMut(f64),
    ) -> Result<f64, Error> {
        let (mut rest, mut whole) = (tail, tail);
        for visit in self.pending.iter().rev() {
            whole = visit.reward - self.average.1 + self.rates.gamma * rest;
            rest = whole;
            on_return(whole);
            if self.target == Target::TreeBackup {
                let (state, action) = (visit.state, visit.action);
                table.check(state, action)?;
                let p = probabilities(table, state, policy, &mut self.probabilities)?;
                let row = table.row(state);
                let mean: f64 = p.iter().zip(row).map(|(p, q)| p * q).sum();
                rest = mean + p[action.0] * (rest - row[action.0]);
            }
        }
        Ok(whole)
    }

    /// Moves the oldest pending pair toward its return.
    #[inline]
    fn update_oldest(&mut self, table: &mut QTable, target: f64) -> Result<(), Error> {
        let Some(visit) = self.pending.pop_front() else {
            return Ok(());
        };
        let (state, action) = (visit.state, visit.action);
        table.check(state, action)?;
        let alpha = self.rates.alpha.now(&self.rates.clock, visit.visits);
        let old = table.value(state, action);
        let error = target - old;
        table.store(state, action, old + alpha * error)?;
        self.average.1 += self.average.0 * alpha * error;
        self.rates.clock.tick();
        Ok(())
    }

    /// Updates all pending pairs, oldest first, with returns that end here.
    fn close(&mut self, table: &mut QTable, end: End, policy: &dyn Policy) -> Result<(), Error> {
        let mut returns = Vec::new();
        while !self.pending.is_empty() {
            let tail = self.tail(table, end, policy)?;
            returns.clear();
            self.returns(table, tail, policy, |whole| returns.push(whole))?;
            while let Some(target) = returns.pop() {
                self.update_oldest(table, target)?;
                // An update may change the values that the next returns are made of.
                let steady = self.average.0 <= 0.0 && self.target != Target::TreeBackup;
                if !steady || self.tail(table, end, policy)?.to_bits() != tail.to_bits() {
                    break;
                }
            }
        }
        Ok(())
    }

    /// Learns by one step, which needs no list of pending pairs.
    #[inline(never)]
    fn learn_one(
        &mut self,
        table: &mut QTable,
        experience: &Experience,
        policy: &dyn Policy,
    ) -> Result<f64, Error> {
        let (state, action, step) = experience.parts(table)?;
        let tail = self.tail(table, experience.end(), policy)?;
        let reward = step.reward - self.average.1;
        let target = self.rates.target(&Step { reward, ..*step }, || tail);
        if self.average.0 > 0.0 {
            let alpha = self.rates.alpha(table, state, action);
            let error = target - table.value(state, action);
            self.average.1 += self.average.0 * alpha * error;
        }
        self.rates.learn(table, state, action, target)
    }

    #[inline(never)]
    fn learn_several(
        &mut self,
        table: &mut QTable,
        experience: &Experience,
        policy: &dyn Policy,
    ) -> Result<f64, Error> {
        let (state, action, step) = experience.parts(table)?;
        if self.target == Target::Q && !is_greedy(table, state, action) {
            self.close(table, Some((state, None)), policy)?;
        }
        let end = experience.end();
        let tail = self.tail(table, end, policy)?;
        let reward = step.reward - self.average.1;
        let target = self.rates.target(&Step { reward, ..*step }, || tail);
        let error = target - table.value(state, action);
        self.pending.push_back(Pending {
            state,
            action,
            reward: step.reward,
            visits: table.visits(state, action),
        });
        table.visit(state, action)?;
        match step.status {
            Status::Terminated | Status::Truncated => self.close(table, end, policy)?,
            Status::Continuing if self.pending.len() >= self.n => {
                let target = self.returns(table, tail, policy, |_| ())?;
                self.update_oldest(table, target)?;
            }
            Status::Continuing => {}
        }
        Ok(error)
    }
}

impl Experience {
    /// Returns the state that a return may end in.
    fn end(&self) -> End {
        let goes_on = self.step.status != Status::Terminated;
        goes_on.then_some((self.step.observation, self.next_action))
    }
}

impl Learner for NStep {
    fn needs_next_action(&self) -> bool {
        self.target == Target::Sarsa
    }

    fn begin_episode(&mut self) {
        self.rates.clock.begin_episode();
        self.pending.clear();
    }

    fn learn(
        &mut self,
        table: &mut QTable,
        experience: &Experience,
        policy: &dyn Policy,
        _rng: &mut dyn Rng,
    ) -> Result<f64, Error> {
        if self.n == 1 {
            self.learn_one(table, experience, policy)
        } else {
            self.learn_several(table, experience, policy)
        }
    }
}
