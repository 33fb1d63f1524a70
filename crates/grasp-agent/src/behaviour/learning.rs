//! Learning a behaviour in a simulator, as the paper does in section 4.

use std::ops::ControlFlow;

use puma_val2::{Joint, JointDelta};
use qtable::{Action, Boltzmann, QLearning, QTable, Record, Schedule, State, Training, Until};
use rand::Rng;

use crate::behaviour::policy::{Behaviour, KAPPA};
use crate::behaviour::spec::BehaviourSpec;
use crate::behaviour::task::BehaviourTask;
use crate::error::BehaviourError;
use crate::percept::Percept;

/// Result of learning a behaviour.
#[derive(Clone, Debug)]
pub struct Lesson {
    /// The learned behaviour.
    pub behaviour: Behaviour,
    /// Learning curve, oldest record first.
    pub curve: Vec<Record>,
    /// Number of actions after which the table of `behaviour` was reached: all of them, or fewer
    /// if the best table was kept.
    pub learned_by: u64,
}

/// Settings of Q-learning with a Boltzmann policy.
#[derive(Clone, Debug, PartialEq)]
pub struct LearningSettings {
    /// Discount factor γ, `0..=1`.
    pub gamma: f64,
    /// Learning rate α over the actions taken, within `0..=1`.
    pub alpha: Schedule,
    /// Temperature T over the actions taken, in units of the values, within `1e-6..=1e6`.
    pub temperature: Schedule,
    /// Actions to take in all, at least 1.
    pub actions: u64,
    /// Actions after which an episode is truncated, at least 1.
    pub episode_limit: u64,
    /// Actions from one record of the learning curve to the next, at least 1.
    pub record_every: u64,
}

impl LearningSettings {
    /// Returns the paper's settings (section 4) for a number of actions: γ = 0.9, α from 0.6, T
    /// from 1000, 60 actions to an episode, 100 records. The ends of the two schedules, which
    /// the paper does not give, are 0.1 for α and 5 for T.
    ///
    /// Both ends are high: on states as coarse as these, values that are still moving and actions
    /// that are still tried find the policies that reach the goal from everywhere. A colder end
    /// settles early on some that do not.
    ///
    /// # Errors
    /// No actions to learn by.
    pub fn paper(actions: u64) -> Result<Self, BehaviourError> {
        Ok(Self {
            gamma: 0.9,
            alpha: Schedule::exponential(0.6, 0.1, actions)?,
            temperature: Schedule::exponential(1000.0, 5.0, actions)?,
            actions,
            episode_limit: 60,
            record_every: actions.div_ceil(100),
        })
    }
}

impl BehaviourSpec {
    /// Learns the behaviour in a simulator: `simulate` returns the percept after a move, `None` if
    /// the ball is lost, and `start` draws the percept that an episode begins with.
    ///
    /// With `trials`, the best of the tables met on the way is kept. In the second half of the run,
    /// at every record of the learning curve, the greedy policy is tried in the simulator from each
    /// of them. The table that needs the fewest steps stays, without the actions that lost the ball
    /// in a trial. Otherwise the last table is kept; on coarse states it is never at rest, since
    /// each update may lose a way here and find one there.
    ///
    /// ```
    /// use std::ops::ControlFlow;
    ///
    /// use grasp_agent::hough_heuristic::Features;
    /// use grasp_agent::puma_val2::{Joint, JointDelta};
    /// use grasp_agent::qtable::rand::{Rng, RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};
    /// use grasp_agent::{BehaviourSpec, LearningSettings, Percept};
    ///
    /// fn main() -> Result<(), Box<dyn std::error::Error>> {
    ///     // A degree of the first joint moves the ball by four units.
    ///     let simulate = |percept: &Percept, delta: &JointDelta| {
    ///         let mut next = *percept;
    ///         next.features.x += 4.0 * delta[Joint::J1].to_degrees();
    ///         (0.0..192.0).contains(&next.features.x).then_some(next)
    ///     };
    ///     let start = |rng: &mut dyn Rng| Percept {
    ///         features: Features::new(rng.random_range(0.0..192.0), 72.0, 33.0),
    ///         theta3: 0.0,
    ///     };
    ///     let settings = LearningSettings::paper(20_000)?;
    ///     let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    ///     let spec = BehaviourSpec::centering();
    ///     let go_on = &mut |_: &_| ControlFlow::Continue(());
    ///     let lesson = spec.learn(simulate, start, &[], &settings, &mut rng, go_on)?;
    ///     assert!(lesson.curve.last().and_then(|record| record.success_share) > Some(0.9));
    ///     Ok(())
    /// }
    /// ```
    ///
    /// `on_progress` is called with each record. Its [`ControlFlow::Break`] ends the learning; the
    /// lesson is then that of the actions so far.
    ///
    /// # Errors
    /// [`BehaviourError::Settings`] for a specification that cannot be run, and a reward that is
    /// not a number: the literal Eq. 5 and 6 divide by zero on their targets.
    pub fn learn(
        self,
        mut simulate: impl FnMut(&Percept, &JointDelta) -> Option<Percept>,
        mut start: impl FnMut(&mut dyn Rng) -> Percept,
        trials: &[Percept],
        settings: &LearningSettings,
        rng: &mut dyn Rng,
        on_progress: &mut dyn FnMut(&Record) -> ControlFlow<()>,
    ) -> Result<Lesson, BehaviourError> {
        /// Parts from record to record in which α and the temperature stand still.
        const BLOCKS: u64 = 5;
        let spec = self;
        spec.check()?;
        let (gamma, actions) = (settings.gamma, settings.actions);
        let every = settings.record_every.clamp(1, actions.max(1));
        let alpha = along_lines(&settings.alpha, every, actions)?;
        let temperature = along_lines(&settings.temperature, every, actions)?;
        let mut training = Training::new(
            &BehaviourTask::new(&spec, gamma, &mut simulate, &mut start),
            QTable::new(spec.states(), spec.actions())?,
            QLearning::new(alpha, gamma)?,
            Boltzmann::new(temperature)?,
        )?
        .with_episode_limit(settings.episode_limit)?;
        let mut best: Option<(usize, u64, QTable)> = None;
        while training.actions() < actions {
            let part = every.min(actions - training.actions());
            let to = training.actions() + part;
            training = training.with_record_every(part)?;
            let mut task = BehaviourTask::new(&spec, gamma, &mut simulate, &mut start);
            let until = Until::Actions(to);
            let ended = training.run_in_blocks(&mut task, until, BLOCKS, rng, |record, _| {
                on_progress(record)
            })?;
            training.end_episode();
            if ended {
                break;
            }
            if !trials.is_empty() && 2 * to > actions {
                let behaviour = Behaviour::new(spec.clone(), training.table().clone())?;
                let fewest = best.as_ref().map_or(usize::MAX, |(fewest, ..)| *fewest);
                let (tried, without) = without_losses(trials, behaviour, fewest, &mut simulate)?;
                if tried.steps < fewest {
                    best = Some((tried.steps, to, without));
                }
            }
        }
        let curve = training.take_curve();
        let last = (training.actions(), training.into_parts().0);
        let (learned_by, table) = best.map_or(last, |(_, by, table)| (by, table));
        Ok(Lesson {
            behaviour: Behaviour::new(spec, table)?,
            curve,
            learned_by,
        })
    }
}

/// Returns a schedule by straight lines from one record to the next. A schedule by visits stays.
fn along_lines(schedule: &Schedule, every: u64, actions: u64) -> Result<Schedule, qtable::Error> {
    if schedule.is_by_visits() {
        return Ok(schedule.clone());
    }
    let records = (0..actions).step_by(usize::try_from(every).unwrap_or(usize::MAX));
    let points: Vec<_> = records
        .chain([actions])
        .map(|action| (action, schedule.at(action)))
        .collect();
    Schedule::piecewise(&points)
}

/// Trials of the greedy policy, with the repetition penalty, from a number of starts.
#[derive(Debug, Default)]
struct Trials {
    /// Steps to the goal, together; a trial that did not reach it counts as [`Trials::FAILED`].
    steps: usize,
    /// States and actions that lost the ball.
    lost_by: Vec<(State, Action)>,
}

impl Trials {
    const MOST: usize = 60;
    /// More than any detour.
    const FAILED: usize = 5 * Self::MOST;

    fn of(
        starts: &[Percept],
        behaviour: &Behaviour,
        mut simulate: impl FnMut(&Percept, &JointDelta) -> Option<Percept>,
    ) -> Self {
        let mut trials = Self::default();
        let (low, high) = behaviour.spec().theta3_range;
        let within = |now: &Percept, delta: &JointDelta| {
            let turned = now.theta3 + delta[Joint::J3].to_degrees();
            (low..=high).contains(&turned)
        };
        for start in starts {
            let run = behaviour.steps_to_goal(start, KAPPA, Self::MOST, within, &mut simulate);
            trials.steps += match run {
                Ok(steps) if steps < Self::MOST => steps,
                Ok(_) => Self::FAILED,
                Err(lost_by) => {
                    trials.lost_by.extend(lost_by);
                    Self::FAILED
                }
            };
        }
        trials
    }

    /// Returns the least number of steps that a table could need if it lost no ball any more.
    fn at_least(&self) -> usize {
        self.steps
            .saturating_sub(Self::FAILED.saturating_mul(self.lost_by.len()))
    }
}

/// Removes the actions by which the greedy policy loses the ball from `starts`, and returns the
/// trials without them.
///
/// A state is a region, and an action that is the best in nearly all of it may lose the ball from
/// one of its corners: on average that costs too little to be noticed. Such an action gets the
/// lowest value of its state. Stops early if the policy would take `fewest` steps or more even
/// without losses.
fn without_losses(
    starts: &[Percept],
    mut behaviour: Behaviour,
    fewest: usize,
    mut simulate: impl FnMut(&Percept, &JointDelta) -> Option<Percept>,
) -> Result<(Trials, QTable), BehaviourError> {
    /// Most rounds of replacing actions that lose the ball: a replacement may lose it as well.
    const ROUNDS: usize = 5;
    let mut tried = Trials::of(starts, &behaviour, &mut simulate);
    for _ in 0..ROUNDS {
        if tried.lost_by.is_empty() || tried.at_least() >= fewest {
            break;
        }
        let mut table = behaviour.table().clone();
        for (state, action) in &tried.lost_by {
            let lowest = table
                .row(*state)
                .iter()
                .copied()
                .fold(f64::INFINITY, f64::min);
            table.set(*state, *action, lowest)?;
        }
        behaviour = Behaviour::new(behaviour.spec().clone(), table)?;
        tried = Trials::of(starts, &behaviour, &mut simulate);
    }
    Ok((tried, behaviour.into_table()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::behaviour::policy::Episode;
    use crate::limits::JointLimits;
    use crate::sight::camera_model::CameraModel;
    use hough_heuristic::Features;
    use puma_val2::Joints;

    #[test]
    fn actions_that_lose_the_ball_in_a_trial_are_removed() {
        let spec = BehaviourSpec::approaching_fine();
        let seen = |y, r| Percept {
            features: Features::new(98.7, y, r),
            theta3: 40.0,
        };
        // One state, from whose corner the longest move toward the ball loses it.
        let (corner, inside) = (seen(73.2, 11.87), seen(67.0, 10.7));
        let state = spec.state(&corner).expect("finite");
        assert_eq!(spec.state(&inside).expect("finite"), state);
        let actions = || (0..spec.actions()).map(Action);
        let turns = |action: Action, j2: f64, j3: f64| {
            let [_, a, b, ..] = spec.delta(action).degrees();
            (a - j2).abs() < 1e-9 && (b - j3).abs() < 1e-9
        };
        let long = actions()
            .find(|a| turns(*a, 20.0, -16.0))
            .expect("the paper's");
        let short = actions()
            .find(|a| turns(*a, 6.0, -1.6))
            .expect("the paper's");
        let mut table = QTable::new(spec.states(), spec.actions()).expect("not empty");
        table.set(state, long, 740.0).expect("in the table");
        table.set(state, short, 700.0).expect("in the table");
        let wrist = Joints::from_degrees([0.0, 0.0, 0.0, 0.0, 45.0, 0.0]);
        let behaviour = Behaviour::new(spec.clone(), table).expect("fits");

        let model = CameraModel::paper();
        let mut plane = model.approaching(&spec, JointLimits::paper(), &wrist);
        // Seen is what shows 60 % of its outline.
        let seen = |f: &Features| {
            let inside = (0..360).filter(|degree| {
                let (sin, cos) = f64::from(*degree).to_radians().sin_cos();
                let (x, y) = (f.x + f.r * cos, f.y + f.r * sin);
                (0.0..192.0).contains(&x) && (0.0..144.0).contains(&y)
            });
            inside.count() >= 216
        };
        let mut simulate = |percept: &Percept, delta: &JointDelta| {
            let after = plane(percept, delta)?;
            seen(&after.features).then_some(after)
        };
        let lost_by =
            |behaviour: &Behaviour,
             start: Percept,
             simulate: &mut dyn FnMut(&Percept, &JointDelta) -> Option<Percept>| {
                Trials::of(&[start], behaviour, simulate).lost_by
            };
        assert!(lost_by(&behaviour, corner, &mut simulate).contains(&(state, long)));
        assert!(!lost_by(&behaviour, inside, &mut simulate).contains(&(state, long)));
        let starts = [corner, inside];
        let (_, table) = without_losses(&starts, behaviour.clone(), usize::MAX, &mut simulate)
            .expect("sets values");
        let without = Behaviour::new(behaviour.spec().clone(), table).expect("fits");
        let chosen = without.choose(state, &Episode::new(&without), 0.0, |_| true);
        assert_eq!(chosen, Some(short));
        // Where another table does better anyhow, nothing is changed.
        let (_, table) =
            without_losses(&starts, behaviour.clone(), 0, &mut simulate).expect("changes nothing");
        assert_eq!(table, *behaviour.table());
    }
}
