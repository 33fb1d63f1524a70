//! Prioritized sweeping: planning where it changes most.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rand::Rng;

use crate::error::{Error, check_fraction, check_length, check_not_negative, positive};
use crate::learner::rule::{Experience, Learner};
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
    ///
    /// ```
    /// use qtable::{PrioritizedSweeping, QTable};
    ///
    /// fn main() -> Result<(), qtable::Error> {
    ///     let table = QTable::new(54, 4)?;
    ///     let learner = PrioritizedSweeping::new(&table, 0.95)?.with_backups(10)?;
    ///     // Training::new(&environment, table, learner, policy)?
    ///     Ok(())
    /// }
    /// ```
    #[derive(Clone, Debug, PartialEq)]
    pub struct PrioritizedSweeping {
        gamma: f64,
        backups: u32,
        threshold: f64,
        model: ModelEstimate,
        /// Change that the backup of each pair would make, 0 for pairs that are not queued.
        priorities: Vec<f64>,
        #[cfg_attr(feature = "serde", serde(skip))]
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
            priorities: Vec::new(),
            queue: Queue::default(),
        }
        .restore()
    }

    /// Sets the number of backups after each real step, at least 1 (default 5).
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn with_backups(self, backups: u32) -> Result<Self, Error> {
        Self { backups, ..self }.restore()
    }

    /// Sets the change up to which a pair is not queued, in units of the values (default 0).
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

    /// Queues a pair, or moves it forward, if its backup would change its value by more than the
    /// threshold. A change that is not finite is the most urgent; its backup is refused if its
    /// value is not finite.
    fn raise(&mut self, table: &QTable, state: State, action: Action) {
        if let Some(value) = self.backup(table, state, action) {
            let change = (value - table.value(state, action)).abs().min(f64::MAX);
            let pair = state.0 * self.model.actions() + action.0;
            if change > self.threshold && change > self.priorities[pair] {
                self.priorities[pair] = change;
                self.queue.0.push((change.to_bits(), Reverse(pair)));
            }
        }
    }

    /// Takes the pair of the largest change from the queue.
    fn pop(&mut self) -> Option<(State, Action)> {
        while let Some((bits, Reverse(pair))) = self.queue.0.pop() {
            if self.priorities[pair].to_bits() == bits {
                self.priorities[pair] = 0.0;
                return Some(self.model.pair(pair));
            }
        }
        None
    }

    fn restore(mut self) -> Result<Self, Error> {
        check_fraction("gamma", self.gamma)?;
        positive("backups", u64::from(self.backups))?;
        check_not_negative("threshold", self.threshold)?;
        self.priorities
            .iter()
            .try_for_each(|&priority| check_not_negative("a priority", priority))?;
        let needed = self.model.states() * self.model.actions();
        if self.priorities.is_empty() {
            self.priorities.resize(needed, 0.0);
        }
        check_length("the queue", needed, self.priorities.len())?;
        let entries = self.priorities.iter().enumerate();
        let queued = entries.filter(|&(_, &priority)| priority > 0.0);
        let queued = queued.map(|(pair, priority)| (priority.to_bits(), Reverse(pair)));
        self.queue = Queue(queued.collect());
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
        let (state, action, step) = experience.parts(table)?;
        self.model.follow(table)?;
        let entries = self.model.states() * self.model.actions();
        self.priorities.resize(entries, 0.0);
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
            let Some((state, action)) = self.pop() else {
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

/// Bits of each queued pair's priority (ordered as the positive number itself) and the pair. Of
/// equal changes the lower pair comes first, so that the order does not depend on how the queue
/// grew. Outdated entries stay until they are met; the priorities alone are the queue's state.
#[derive(Clone, Debug, Default)]
struct Queue(BinaryHeap<(u64, Reverse<usize>)>);

impl PartialEq for Queue {
    fn eq(&self, _other: &Self) -> bool {
        true
    }
}
