//! Dyna-Q: learning from remembered experience between real steps.

use rand::{Rng, RngExt};

use crate::error::{Error, check_index, check_length, check_not_negative, check_setting};
use crate::learner::q_learning::QLearning;
use crate::learner::rule::{Experience, Learner};
use crate::model::ModelEstimate;
use crate::policy::Policy;
use crate::schedule::Schedule;
use crate::step::{Action, State, Status, Step};
use crate::table::QTable;
use crate::validated::validated;

validated! {
    /// Dyna-Q (Sutton 1990; Sutton and Barto, section 8.2): one-step Q-learning on each real step,
    /// then on k steps drawn from a model: a pair tried before, each with the same probability, and
    /// one of the outcomes seen, by their counts.
    ///
    /// The book keeps the last outcome only ([`with_last_outcome`](DynaQ::with_last_outcome)),
    /// which notices sooner that a deterministic world has changed, and is wrong in a stochastic
    /// one. [`with_bonus`](DynaQ::with_bonus) is Dyna-Q+. Imagined steps use the α of the present,
    /// and count neither as visits nor for the schedule. Default: k = 5.
    ///
    /// A learner belongs to the table it was made for; another table is refused with
    /// [`Error::OtherTable`].
    ///
    /// ```
    /// use qtable::{DynaQ, QTable, Schedule};
    ///
    /// fn main() -> Result<(), qtable::Error> {
    ///     let table = QTable::new(54, 4)?;
    ///     let dyna = DynaQ::new(&table, Schedule::constant(0.5)?, 0.95)?.with_planning_steps(50);
    ///     let dyna_plus = dyna.clone().with_last_outcome().with_bonus(1e-3)?;
    ///     // Training::new(&environment, table, dyna_plus, policy)?
    ///     Ok(())
    /// }
    /// ```
    #[derive(Clone, Debug, PartialEq)]
    pub struct DynaQ {
        real: QLearning,
        planning_steps: u32,
        last_only: bool,
        bonus: f64,
        model: ModelEstimate,
        /// Real steps so far, and the number of the step at which each pair was tried last; empty
        /// without bonus.
        steps: u64,
        last_tried: Vec<u64>,
        /// States met, in order; empty without bonus.
        met: Vec<State>,
    }
}

impl DynaQ {
    /// Creates the learner for a table, with a schedule of α over its updates, episodes or visits,
    /// and the discount factor γ.
    ///
    /// # Errors
    /// [`Error::Setting`] if α or γ leaves `0..=1`.
    pub fn new(table: &QTable, alpha: Schedule, gamma: f64) -> Result<Self, Error> {
        Ok(Self {
            real: QLearning::new(alpha, gamma)?,
            planning_steps: 5,
            last_only: false,
            bonus: 0.0,
            model: ModelEstimate::new(table.states(), table.actions())?,
            steps: 0,
            last_tried: Vec::new(),
            met: Vec::new(),
        })
    }

    /// Sets the number of imagined steps after each real one (default 5); 0 is plain Q-learning.
    #[must_use]
    pub fn with_planning_steps(self, planning_steps: u32) -> Self {
        Self {
            planning_steps,
            ..self
        }
    }

    /// Keeps only the last outcome of each pair, for deterministic worlds that change.
    #[must_use]
    pub fn with_last_outcome(self) -> Self {
        let last_only = true;
        Self { last_only, ..self }
    }

    /// Makes it Dyna-Q+ (Sutton and Barto, section 8.3): an imagined reward grows by `κ sqrt(τ)`
    /// with the steps τ since the pair was tried last, so that the learner looks again at what may
    /// have changed. All actions of the states met are imagined; one never tried leads back to its
    /// state.
    ///
    /// # Errors
    /// [`Error::Setting`] if κ is negative or not finite.
    pub fn with_bonus(self, kappa: f64) -> Result<Self, Error> {
        let last_tried = vec![0; self.model.states() * self.model.actions()];
        Self {
            bonus: kappa,
            last_tried,
            ..self
        }
        .restore()
    }

    /// Returns the model learned so far.
    pub fn model(&self) -> &ModelEstimate {
        &self.model
    }

    /// Draws an imagined step.
    fn imagine(&self, table: &QTable, rng: &mut dyn Rng) -> Option<(State, Action, Step)> {
        if self.last_tried.is_empty() {
            return self.model.draw(rng);
        }
        let state = self.met[rng.random_range(0..self.met.len())];
        let offered = table.offered(state).count();
        let drawn = rng.random_range(0..offered.max(1));
        let action = table.offered(state).nth(drawn)?;
        let tried_last = self.last_tried[state.0 * table.actions() + action.0];
        let untried = Step::new(state, 0.0, Status::Continuing);
        let known = self.model.draw_outcome(state, action, rng);
        let mut step = known.unwrap_or(untried);
        step.reward += self.bonus * ((self.steps - tried_last) as f64).sqrt();
        Some((state, action, step))
    }

    /// Notes that a pair is tried now.
    fn note_trial(&mut self, state: State, action: Action) {
        let actions = self.model.actions();
        let entries = self.model.states() * actions;
        self.last_tried.resize(entries, 0);
        let row = &mut self.last_tried[state.0 * actions..][..actions];
        if row.iter().all(|&step| step == 0) {
            self.met.push(state);
        }
        self.steps = self.steps.saturating_add(1);
        row[action.0] = self.steps;
    }

    fn restore(self) -> Result<Self, Error> {
        check_not_negative("kappa", self.bonus)?;
        let (states, found) = (self.model.states(), self.last_tried.len());
        let needed = if found == 0 {
            0
        } else {
            states * self.model.actions()
        };
        check_length("the list of trials", needed, found)?;
        let mut met = self.met.iter();
        met.try_for_each(|state| check_index("state", state.0, states))?;
        let latest = self.last_tried.iter().copied().max().unwrap_or(0);
        let valid = latest <= self.steps;
        check_setting("the step of a trial", latest as f64, valid, "a past step")?;
        Ok(self)
    }
}

impl Learner for DynaQ {
    fn begin_episode(&mut self) {
        self.real.begin_episode();
    }

    fn learn(
        &mut self,
        table: &mut QTable,
        experience: &Experience,
        _policy: &dyn Policy,
        rng: &mut dyn Rng,
    ) -> Result<f64, Error> {
        let (state, action, step) = experience.parts(table)?;
        self.model.follow(table)?;
        let error = self.real.update(table, state, action, step)?;
        self.model.note(state, action, step, self.last_only)?;
        if !self.last_tried.is_empty() {
            self.note_trial(state, action);
        }
        for _ in 0..self.planning_steps {
            if let Some((state, action, step)) = self.imagine(table, rng) {
                self.real.update_imagined(table, state, action, &step)?;
            }
        }
        Ok(error)
    }
}
