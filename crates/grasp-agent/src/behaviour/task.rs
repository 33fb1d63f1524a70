//! Learning a behaviour in a simulator: the behaviour as a reinforcement-learning environment.

use hough_heuristic::Features;
use puma_val2::JointDelta;
use qtable::{Action, Environment, State, Status, Step};
use rand::Rng;

use crate::behaviour::spec::BehaviourSpec;
use crate::percept::Percept;

/// A behaviour in a simulator: states, actions and rewards of the specification, what follows from
/// the simulator.
///
/// The simulator is any closure that turns a percept and a joint move into the next percept, or
/// `None` when the ball is lost; the starts are drawn by a second one.
pub struct BehaviourTask<'a, M, S> {
    spec: &'a BehaviourSpec,
    /// The joint move of each action.
    deltas: Vec<JointDelta>,
    gamma: f64,
    simulate: M,
    start: S,
    now: Percept,
    state: State,
}

/// How often a start is drawn again before one at the goal is accepted.
const STARTS_TRIED: usize = 1000;

impl<'a, M, S> BehaviourTask<'a, M, S>
where
    M: FnMut(&Percept, &JointDelta) -> Option<Percept>,
    S: FnMut(&mut dyn Rng) -> Percept,
{
    /// A task for learning `spec` with the discount factor `gamma` (an absorbing goal is worth
    /// more, the higher it is).
    pub fn new(spec: &'a BehaviourSpec, gamma: f64, simulate: M, start: S) -> Self {
        let now = Percept {
            features: Features {
                x: 0.0,
                y: 0.0,
                r: 0.0,
            },
            theta3: 0.0,
        };
        Self {
            spec,
            deltas: (0..spec.actions()).map(|a| spec.delta(Action(a))).collect(),
            gamma,
            simulate,
            start,
            now,
            state: State(0),
        }
    }
}

impl<M, S> std::fmt::Debug for BehaviourTask<'_, M, S> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("BehaviourTask")
            .field("spec", &self.spec.name)
            .field("now", &self.now)
            .finish_non_exhaustive()
    }
}

impl<M, S> Environment for BehaviourTask<'_, M, S>
where
    M: FnMut(&Percept, &JointDelta) -> Option<Percept>,
    S: FnMut(&mut dyn Rng) -> Percept,
{
    fn states(&self) -> usize {
        self.spec.states()
    }

    fn actions(&self) -> usize {
        self.spec.actions()
    }

    fn reset(&mut self, rng: &mut dyn Rng) -> Result<State, qtable::Error> {
        // A start at the goal would be an episode without a choice, so it is drawn again, but not
        // for ever.
        for _ in 0..STARTS_TRIED {
            self.now = (self.start)(rng);
            if !self.spec.at_goal(&self.now) {
                break;
            }
        }
        self.state = self.spec.state(&self.now).unwrap_or(State(0));
        Ok(self.state)
    }

    fn step(&mut self, action: Action, _rng: &mut dyn Rng) -> Result<Step, qtable::Error> {
        let reward = &self.spec.reward;
        let known = self.deltas.get(action.0).copied();
        let delta = known.unwrap_or_else(|| self.spec.delta(action));
        let after = (self.simulate)(&self.now, &delta);
        // What is not a number cannot be seen either.
        let seen = after.and_then(|percept| Some((percept, self.spec.state(&percept).ok()?)));
        let Some((after, observation)) = seen else {
            return Ok(Step {
                observation: self.state,
                reward: reward.lost,
                status: Status::Terminated,
            });
        };
        let before = std::mem::replace(&mut self.now, after);
        self.state = observation;
        let (reward, status) = if self.spec.at_goal(&after) {
            (reward.arrival(self.gamma), Status::Terminated)
        } else {
            (reward.step(&before, &after), Status::Continuing)
        };
        Ok(Step {
            observation,
            reward,
            status,
        })
    }

    /// A success is the goal: a lost ball pays nothing positive.
    fn succeeded(&self, last: &Step) -> Option<bool> {
        Some(last.status == Status::Terminated && last.reward > 0.0)
    }
}
