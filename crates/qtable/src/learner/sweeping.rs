//! Prioritized sweeping: planning where it changes most.

use std::collections::BinaryHeap;

use rand::Rng;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::{Error, check_gamma, check_setting};
use crate::learner::rule::{Experience, Learner, check};
use crate::model::ModelEstimate;
use crate::policy::Policy;
use crate::step::{Action, State, Status};
use crate::table::QTable;
use crate::validated::validated;

validated! {
    /// Prioritized sweeping (Moore and Atkeson 1993): after each real step the model is brought up
    /// to date and up to k pairs, those first whose value would change most, get their full backup
    /// under the model, `Q(s,a) <- Σ p(s'|s,a) (r + γ max over b of Q(s',b))`. The pairs that lead
    /// to a changed state are queued in turn.
    ///
    /// There is no α: the model's counts do the averaging. Default: k = 5, every change is queued.
    ///
    /// A learner belongs to the table it was made for; another table is refused with
    /// [`Error::OtherTable`].
    #[derive(Clone, Debug, PartialEq)]
    pub struct PrioritizedSweeping {
        gamma: f64,
        backups: u32,
        threshold: f64,
        model: ModelEstimate,
        queue: Queue,
    }
}

impl PrioritizedSweeping {
    /// Creates the learner for a table with the discount factor γ.
    ///
    /// # Errors
    /// [`Error::Setting`] if γ leaves `0..=1`.
    pub fn new(table: &QTable, gamma: f64) -> Result<Self, Error> {
        Self {
            gamma,
            backups: 5,
            threshold: 0.0,
            model: ModelEstimate::new(table.states(), table.actions())?,
            queue: Queue::default(),
        }
        .restore()
    }

    /// Sets the number of backups after each real step, at least 1.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn with_backups(self, backups: u32) -> Result<Self, Error> {
        Self { backups, ..self }.restore()
    }

    /// Sets the change up to which a pair is not queued, in units of the values.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn with_threshold(self, threshold: f64) -> Result<Self, Error> {
        Self { threshold, ..self }.restore()
    }

    /// Returns the model learned so far.
    pub fn model(&self) -> &ModelEstimate {
        &self.model
    }

    /// Returns the value of a pair under the model.
    fn backup(&self, table: &QTable, state: State, action: Action) -> Option<f64> {
        self.model
            .backup(state, action, self.gamma, |next| table.max(next))
    }

    /// Queues a pair if its backup would change its value by more than the threshold. A change that
    /// is not finite is the most urgent; its backup is refused if its value is not finite.
    fn raise(&mut self, table: &QTable, state: State, action: Action) {
        if let Some(value) = self.backup(table, state, action) {
            let change = (value - table.value(state, action)).abs().min(f64::MAX);
            if change > self.threshold {
                self.queue.raise(&self.model, state, action, change);
            }
        }
    }

    fn restore(self) -> Result<Self, Error> {
        check_gamma(self.gamma)?;
        check_setting(
            "backups",
            f64::from(self.backups),
            self.backups > 0,
            "at least 1",
        )?;
        let valid = self.threshold.is_finite() && self.threshold >= 0.0;
        check_setting(
            "threshold",
            self.threshold,
            valid,
            "finite and not negative",
        )?;
        let needed = self.model.states() * self.model.actions();
        let found = self.queue.priorities.len();
        if found != 0 && found != needed {
            return Err(Error::WrongLength {
                what: "the queue",
                needed,
                found,
            });
        }
        if let Some(&priority) = self
            .queue
            .priorities
            .iter()
            .find(|p| !p.is_finite() || **p < 0.0)
        {
            check_setting("a priority", priority, false, "finite and not negative")?;
        }
        Ok(self)
    }
}

impl Learner for PrioritizedSweeping {
    fn learn(
        &mut self,
        table: &mut QTable,
        experience: &Experience,
        _policy: &dyn Policy,
        _rng: &mut dyn Rng,
    ) -> Result<f64, Error> {
        let (state, action, step) = (experience.state, experience.action, &experience.step);
        check(table, state, action, step)?;
        self.model.check_table(table)?;
        let next = match step.status {
            Status::Terminated => 0.0,
            Status::Continuing | Status::Truncated => table.max(step.observation),
        };
        let error = step.reward + self.gamma * next - table.value(state, action);
        // The experience fits the table, and the table the model: from here on only a backup can
        // fail.
        self.model.observe(state, action, step)?;
        table.visit(state, action)?;

        self.raise(table, state, action);
        for _ in 0..self.backups {
            let Some((state, action)) = self.queue.pop(&self.model) else {
                break;
            };
            let before = table.max(state);
            if let Some(value) = self.backup(table, state, action) {
                table.store(state, action, value)?;
            }
            if table.max(state).to_bits() == before.to_bits() {
                continue;
            }
            for place in 0..self.model.predecessors(state).len() {
                let (state, action) = self.model.pair(self.model.predecessors(state)[place]);
                self.raise(table, state, action);
            }
        }
        Ok(error)
    }
}

/// Pairs by the change that their backup would make. Of equal changes the lower pair comes first,
/// so that the order does not depend on how the queue grew.
#[derive(Clone, Debug, Default)]
#[cfg_attr(
    feature = "serde",
    derive(Serialize, Deserialize),
    serde(from = "Vec<f64>", into = "Vec<f64>")
)]
struct Queue {
    /// Priority of each pair, 0 for those not queued.
    priorities: Vec<f64>,
    /// Bits of the priority (ordered as the positive number itself) and the pair; outdated entries
    /// stay until they are met.
    heap: BinaryHeap<(u64, std::cmp::Reverse<usize>)>,
}

impl PartialEq for Queue {
    fn eq(&self, other: &Self) -> bool {
        self.priorities == other.priorities
    }
}

impl From<Vec<f64>> for Queue {
    fn from(priorities: Vec<f64>) -> Self {
        let queued = |&(_, &p): &(usize, &f64)| p > 0.0;
        let heap = priorities
            .iter()
            .enumerate()
            .filter(queued)
            .map(|(pair, p)| (p.to_bits(), std::cmp::Reverse(pair)))
            .collect();
        Self { priorities, heap }
    }
}

impl From<Queue> for Vec<f64> {
    fn from(queue: Queue) -> Self {
        queue.priorities
    }
}

impl Queue {
    /// Queues a pair, or moves it forward.
    fn raise(&mut self, model: &ModelEstimate, state: State, action: Action, change: f64) {
        self.priorities
            .resize(model.states() * model.actions(), 0.0);
        let pair = state.0 * model.actions() + action.0;
        if change > self.priorities[pair] {
            self.priorities[pair] = change;
            self.heap.push((change.to_bits(), std::cmp::Reverse(pair)));
        }
    }

    fn pop(&mut self, model: &ModelEstimate) -> Option<(State, Action)> {
        while let Some((bits, std::cmp::Reverse(pair))) = self.heap.pop() {
            if self.priorities[pair].to_bits() == bits {
                self.priorities[pair] = 0.0;
                return Some((
                    State(pair / model.actions()),
                    Action(pair % model.actions()),
                ));
            }
        }
        None
    }
}
