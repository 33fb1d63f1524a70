//! The simulator in which both behaviours are learned, as in section 4 of the paper.

use std::ops::ControlFlow;

use grasp_agent::{BehaviourError, BehaviourSpec, JointLimits, LearningSettings, Lesson, Percept};
use pipeline_sim::{MoveForm, MoveModel, MoveSample, Quality, QuantityError};
use puma_val2::{Joint, JointDelta};
use qtable::Record;
use rand::{Rng, RngExt};

/// Regression simulator of section 4: predicts x, y and r after a joint move from models fitted to
/// samples.
#[derive(Clone, Debug)]
pub struct Simulator {
    centre: MoveModel,
    reach: MoveModel,
    starts: Vec<Percept>,
}

/// Elbow angles that divide the intervals of theta 3, degrees of `JT3`.
const ELBOW_EDGES: [f64; 2] = [175.0, 190.0];

/// Working range of `JT3`, degrees. A move beyond it changes nothing.
const ELBOW_RANGE: (f64, f64) = JointLimits::PAPER_DEGREES[2];

impl Simulator {
    /// Fits the simulator to samples of the cell by least squares.
    ///
    /// # Errors
    /// Too few samples, or samples that do not determine the model.
    pub fn fit(
        centering: &[MoveSample],
        reaching: &[MoveSample],
        form: MoveForm,
    ) -> Result<Self, QuantityError> {
        Ok(Self {
            centre: MoveModel::fit(centering, MoveForm::Centering, &[])?,
            reach: MoveModel::fit(reaching, form, &ELBOW_EDGES)?,
            starts: starts(reaching),
        })
    }

    /// Draws the starts of episodes from these samples instead: a few samples of an arm fit a
    /// model, and those of a nominal cell show the ball everywhere.
    #[must_use]
    pub fn starting_from(self, samples: &[MoveSample]) -> Self {
        Self {
            starts: starts(samples),
            ..self
        }
    }

    /// Returns the quality of fit of each output: `dx` of centering, `dy` and `dr` of approaching,
    /// in feature units.
    pub fn quality(&self) -> Vec<Quality> {
        let mut all = self.centre.quality().to_vec();
        all.extend_from_slice(self.reach.quality());
        all
    }

    /// Draws the start of an episode from those of the samples, which were in view and in reach.
    pub fn start(&self, rng: &mut dyn Rng) -> Percept {
        self.starts[rng.random_range(0..self.starts.len())]
    }

    /// Returns what the camera shows after the move, `None` when the ball is out of view.
    fn predict(&self, percept: &Percept, delta: &JointDelta) -> Option<Percept> {
        let [d1, d2, d3, ..] = delta.degrees();
        let elbow = percept.theta3 + Percept::THETA3_ZERO;
        if !(ELBOW_RANGE.0..=ELBOW_RANGE.1).contains(&(elbow + d3)) {
            return Some(*percept);
        }
        let mut features = percept.features;
        if delta[Joint::J1] != 0.0 {
            features = self.centre.predict(&features, elbow, [d1, 0.0, 0.0])?;
        }
        if d2 != 0.0 || d3 != 0.0 {
            features = self.reach.predict(&features, elbow, [0.0, d2, d3])?;
        }
        Some(Percept {
            features,
            theta3: percept.theta3 + d3,
        })
    }

    /// Learns `spec` in this simulator with the paper's settings ([`LearningSettings::paper`]).
    ///
    /// `trials` are percepts from which tables are tried. With them, the best table of the second
    /// half of the run is kept ([`BehaviourSpec::learn`]); if `trials` is empty, the last table.
    /// A [`ControlFlow::Break`] of `on_progress` ends the learning.
    ///
    /// # Errors
    /// No actions to learn from, or a reward that is not a number (the literal Eq. 5 and 6 divide
    /// by zero on their targets).
    pub fn learn(
        &self,
        spec: BehaviourSpec,
        trials: &[Percept],
        actions: u64,
        rng: &mut dyn Rng,
        on_progress: &mut dyn FnMut(&Record) -> ControlFlow<()>,
    ) -> Result<Lesson, BehaviourError> {
        let simulate = |percept: &Percept, delta: &JointDelta| self.predict(percept, delta);
        let start = |rng: &mut dyn Rng| self.start(rng);
        let config = LearningSettings::paper(actions)?;
        spec.learn(simulate, start, trials, &config, rng, on_progress)
    }
}

fn starts(samples: &[MoveSample]) -> Vec<Percept> {
    let start = |sample: &MoveSample| Percept {
        features: sample.before,
        theta3: sample.jt3_degrees - Percept::THETA3_ZERO,
    };
    samples.iter().map(start).collect()
}
