//! From samples of the cell to two learned behaviours: the paper's "first learned in a simulated environment".

use grasp_agent::{Behaviour, BehaviourError, BehaviourSpec, BehaviourTask, Episode, Learned, Percept};
use pipeline_sim::{CentreModel, CentreSample, FitError, Quality, ReachForm, ReachModel, ReachSample};
use puma_val2::{Joint, JointDelta};
use qtable::{Action, Progress, QTable, Record, Schedule, TrainConfig, TrainReport, train_in_blocks};
use rand::{Rng, RngExt};

/// The regression simulator of section 4: what becomes of x, y and r when the joints move, fitted to samples.
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

    /// How well each output is explained: `dx` of centering, `dy` and `dr` of approaching, in feature units.
    pub fn quality(&self) -> Vec<Quality> {
        let mut all = self.centre.quality();
        all.extend(self.reach.quality());
        all
    }

    /// A start for an episode: what one of the samples began with. All of them were in view and within reach.
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

/// A behaviour just learned, and how that went.
#[derive(Clone, Debug)]
pub struct Lesson {
    /// What was learned.
    pub behaviour: Behaviour,
    /// The learning curve.
    pub report: TrainReport,
    /// Actions after which the table was as it is in `behaviour`: all of them, or fewer where the best table was kept.
    pub learned_by: u64,
}

/// Learns `spec` in `simulator` with the paper's settings (section 4): gamma 0.9, alpha falling from 0.6, the temperature from
/// 1000, exploring starts.
///
/// # Errors
/// No actions to learn by, or a reward that is not a number (the literal Eq. 5 and 6 divide by zero on their targets).
pub fn learn(
    spec: BehaviourSpec,
    simulator: &Simulator,
    actions: u64,
    rng: &mut dyn Rng,
    on_progress: &mut dyn FnMut(&Progress),
) -> Result<Lesson, LearnError> {
    learn_best(spec, simulator, &[], actions, rng, on_progress)
}

/// As [`learn`], and keeps the best of the tables met on the way: in the second half of the run, at every record of the learning
/// curve, the greedy policy goes for the ball from each of `trials` in the simulator, and the table that needs the fewest steps stays.
/// Without trials it is the last one.
///
/// A table on coarse states is never at rest: with each update the policy may lose a way here and find one there.
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
    learn_in(spec, simulate, start, trials, &config, rng, on_progress)
}

/// The paper's settings (section 4) for a number of actions, with the ends of the two courses, which it does not give, at 0.1 for alpha
/// and 5 for the temperature.
///
/// Both are far above those of [`TrainConfig::paper`]: on states as coarse as these, values that are still moving and actions that are
/// still tried find the policies that reach the goal from everywhere, where a colder end settles early on some that do not.
///
/// # Errors
/// No actions to learn by.
pub fn schedule(actions: u64) -> Result<TrainConfig, LearnError> {
    let exponential = |start, end| Schedule::exponential(start, end, actions).map_err(qtable::Error::from);
    Ok(TrainConfig {
        alpha: exponential(0.6, 0.1)?,
        temperature: exponential(1000.0, 5.0)?,
        ..TrainConfig::paper(actions)
    })
}

/// Learns `spec` in any simulator, from one record of the learning curve to the next.
pub(crate) fn learn_in(
    spec: BehaviourSpec,
    mut simulate: impl FnMut(&Percept, &JointDelta) -> Option<Percept>,
    mut start: impl FnMut(&mut dyn Rng) -> Percept,
    trials: &[Percept],
    config: &TrainConfig,
    mut rng: &mut dyn Rng,
    on_progress: &mut dyn FnMut(&Progress),
) -> Result<Lesson, LearnError> {
    /// Parts from record to record in which alpha and the temperature stand still.
    const BLOCKS: u64 = 5;
    let mut table = QTable::new(spec.states(), spec.actions())?;
    let mut report = TrainReport::default();
    let mut best: Option<(usize, u64, QTable)> = None;
    while report.actions < config.actions {
        let from = report.actions;
        let to = from
            .saturating_add(config.record_every.max(1))
            .min(config.actions);
        let part = TrainConfig {
            alpha: between(&config.alpha, from, to)?,
            temperature: between(&config.temperature, from, to)?,
            actions: to - from,
            record_every: to - from,
            ..config.clone()
        };
        let mut task = BehaviourTask::new(&spec, config.gamma, &mut simulate, &mut start);
        let done = train_in_blocks(&mut task, &mut table, &part, BLOCKS, &mut rng, &mut |_| ())?;
        for record in done.curve {
            let latest = Record {
                actions: from + record.actions,
                episodes: report.episodes + record.episodes,
                ..record
            };
            report.curve.push(latest);
            on_progress(&Progress {
                actions: latest.actions,
                of: config.actions,
                latest,
            });
        }
        report.actions = to;
        report.episodes += done.episodes;
        if !trials.is_empty() && 2 * to > config.actions {
            let behaviour = Behaviour::new(spec.clone(), table.clone())?;
            let steps = steps_from(trials, &behaviour, &mut simulate);
            if best.as_ref().is_none_or(|(fewest, ..)| steps < *fewest) {
                best = Some((steps, to, table.clone()));
            }
        }
    }
    let (learned_by, table) = best.map_or((report.actions, table), |(_, by, table)| (by, table));
    Ok(Lesson {
        behaviour: Behaviour::new(spec, table)?,
        report,
        learned_by,
    })
}

/// The part of a schedule from one action to another.
fn between(schedule: &Schedule, from: u64, to: u64) -> Result<Schedule, qtable::Error> {
    if matches!(schedule, Schedule::InverseVisits { .. }) {
        return Ok(schedule.clone());
    }
    let (start, end) = (schedule.at(from), schedule.at(to));
    Ok(Schedule::piecewise(&[(0, start), (to - from, end)])?)
}

/// Steps to the goal from all of `trials` together, greedy and with the loop breaker of approaching.
fn steps_from(
    trials: &[Percept],
    behaviour: &Behaviour,
    mut simulate: impl FnMut(&Percept, &JointDelta) -> Option<Percept>,
) -> usize {
    const MOST: usize = 60;
    /// What a trial counts that does not reach the goal: more than any detour.
    const FAILED: usize = 5 * MOST;
    let spec = behaviour.spec();
    let deltas: Vec<JointDelta> = (0..spec.actions()).map(|a| spec.delta(Action(a))).collect();
    let mut steps = |start: &Percept| {
        let (mut now, mut episode) = (*start, Episode::new(behaviour));
        for step in 0..MOST {
            if spec.at_goal(&now) {
                return Some(step);
            }
            let elbow = now.theta3 + THETA3_ZERO;
            let admitted = |action: Action| {
                let turned = elbow + deltas[action.0][Joint::J3].to_degrees();
                (ELBOW_RANGE.0..=ELBOW_RANGE.1).contains(&turned)
            };
            let state = spec.state(&now).ok()?;
            let action = behaviour.choose(state, &episode, Learned::APPROACHING_KAPPA, admitted)?;
            episode.chose(state, action);
            now = simulate(&now, &deltas[action.0])?;
        }
        None
    };
    trials.iter().map(|start| steps(start).unwrap_or(FAILED)).sum()
}

/// Why a behaviour could not be learned.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LearnError {
    /// Training could not go on.
    #[error("training: {0}")]
    Training(#[from] qtable::Error),
    /// What was learned does not fit the behaviour.
    #[error(transparent)]
    Behaviour(#[from] BehaviourError),
}
