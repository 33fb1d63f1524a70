//! From samples of the cell to two learned behaviours: the paper's "first learned in a simulated
//! environment".

use grasp_agent::{BehaviourSpec, LearnError, Lesson, Percept, schedule};
use pipeline_sim::{
    CentreModel, CentreSample, FitError, Quality, ReachForm, ReachModel, ReachSample,
};
use puma_val2::{Joint, JointDelta};
use qtable::Progress;
use rand::{Rng, RngExt};

/// The regression simulator of section 4: what becomes of x, y and r when the joints move, fitted
/// to samples.
#[derive(Clone, Debug)]
pub struct Simulator {
    centre: CentreModel,
    reach: ReachModel,
    starts: Vec<Percept>,
}

/// Elbow angles at which one interval of theta 3 ends and the next begins, in degrees of `JT3`.
const ELBOW_EDGES: [f64; 2] = [175.0, 190.0];

/// Working range of `JT3`, degrees: a move beyond it is refused, and nothing changes.
const ELBOW_RANGE: (f64, f64) = (120.0, 215.0);

/// `JT3` where theta 3 is zero, degrees.
const THETA3_ZERO: f64 = 170.0;

impl Simulator {
    /// Fits the simulator to samples of the cell by least squares.
    ///
    /// # Errors
    /// Too few samples, or samples that do not determine the model.
    pub fn fit(
        centring: &[CentreSample],
        reaching: &[ReachSample],
        form: ReachForm,
    ) -> Result<Self, FitError> {
        Ok(Self {
            centre: CentreModel::fit(centring)?,
            reach: ReachModel::fit(reaching, form, &ELBOW_EDGES)?,
            starts: reaching
                .iter()
                .map(|sample| Percept {
                    features: sample.before,
                    theta3: sample.jt3_degrees - THETA3_ZERO,
                })
                .collect(),
        })
    }

    /// How well each output is explained: `dx` of centering, `dy` and `dr` of approaching, in
    /// feature units.
    pub fn quality(&self) -> Vec<Quality> {
        let mut all = self.centre.quality();
        all.extend(self.reach.quality());
        all
    }

    /// A start for an episode: what one of the samples began with. All of them were in view and
    /// within reach.
    pub fn start(&self, rng: &mut dyn Rng) -> Percept {
        self.starts[rng.random_range(0..self.starts.len())]
    }

    /// What the camera shows after the move, `None` when the ball is out of view.
    pub fn predict(&self, percept: &Percept, delta: &JointDelta) -> Option<Percept> {
        let [d1, d2, d3, ..] = delta.degrees();
        let elbow = percept.theta3 + THETA3_ZERO;
        if !(ELBOW_RANGE.0..=ELBOW_RANGE.1).contains(&(elbow + d3)) {
            return Some(*percept);
        }
        let mut features = percept.features;
        if delta[Joint::J1] != 0.0 {
            features = self.centre.predict(&features, d1)?;
        }
        if d2 != 0.0 || d3 != 0.0 {
            features = self.reach.predict(&features, elbow, d2, d3)?;
        }
        Some(Percept {
            features,
            theta3: percept.theta3 + d3,
        })
    }
}

/// Learns `spec` in `simulator` with the paper's settings (section 4): gamma 0.9, alpha falling
/// from 0.6, the temperature from 1000, exploring starts.
///
/// # Errors
/// No actions to learn by, or a reward that is not a number (the literal Eq. 5 and 6 divide by zero
/// on their targets).
pub fn learn(
    spec: BehaviourSpec,
    simulator: &Simulator,
    actions: u64,
    rng: &mut dyn Rng,
    on_progress: &mut dyn FnMut(&Progress),
) -> Result<Lesson, LearnError> {
    learn_best(spec, simulator, &[], actions, rng, on_progress)
}

/// As [`learn`], and keeps the best of the tables met on the way: in the second half of the run, at
/// every record of the learning curve, the greedy policy goes for the ball from each of `trials` in
/// the simulator, and the table that needs the fewest steps stays, with an action that lost the
/// ball in a trial not chosen in its state any more. Without trials it is the last one.
///
/// A table on coarse states is never at rest: with each update the policy may lose a way here and
/// find one there.
///
/// # Errors
/// As for [`learn`].
pub fn learn_best(
    spec: BehaviourSpec,
    simulator: &Simulator,
    trials: &[Percept],
    actions: u64,
    rng: &mut dyn Rng,
    on_progress: &mut dyn FnMut(&Progress),
) -> Result<Lesson, LearnError> {
    let simulate = |percept: &Percept, delta: &JointDelta| simulator.predict(percept, delta);
    let start = |rng: &mut dyn Rng| simulator.start(rng);
    let config = schedule(actions)?;
    grasp_agent::learn(spec, simulate, start, trials, &config, rng, on_progress)
}
