//! A behaviour in a simulator, as an environment of `qtable`.

use hough_heuristic::Features;
use puma_val2::JointDelta;
use qtable::{Action, Environment, State, Status, Step};
use rand::Rng;

use crate::behaviour::spec::BehaviourSpec;
use crate::percept::Percept;

/// A behaviour as an environment: states, actions and rewards of a specification, with the percepts
/// of a simulator. Any learner of `qtable` can learn it.
#[derive(Debug)]
pub struct BehaviourTask<'a, M, S> {
    spec: &'a BehaviourSpec,
    /// Joint move of each action.
    deltas: Vec<JointDelta>,
    gamma: f64,
    simulate: M,
    start: S,
    now: Percept,
    state: State,
}

/// Draws of a start before one at the goal is accepted.
const STARTS_TRIED: usize = 1000;

impl<'a, M, S> BehaviourTask<'a, M, S>
where
    M: FnMut(&Percept, &JointDelta) -> Option<Percept>,
    S: FnMut(&mut dyn Rng) -> Percept,
{
    /// Creates the environment. `simulate` returns the percept after a move, `None` if the ball is
    /// lost; `start` draws the percept that an episode begins with; `gamma` is the discount factor,
    /// for the value of an absorbing goal.
    pub fn new(spec: &'a BehaviourSpec, gamma: f64, simulate: M, start: S) -> Self {
        let now = Percept {
            features: Features::new(0.0, 0.0, 0.0),
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
        // A start at the goal would be an episode without a choice.
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
        let known = self.deltas.get(action.0).copied();
        let delta = known.unwrap_or_else(|| self.spec.delta(action));
        let after = (self.simulate)(&self.now, &delta);
        let (spec, before) = (self.spec, (&self.now, self.state));
        let step = spec.outcome(before, after.as_ref(), self.gamma);
        self.state = step.observation;
        self.now = after.unwrap_or(self.now);
        Ok(step)
    }

    /// A success is the goal: a lost ball pays nothing positive.
    fn succeeded(&self, last: &Step) -> Option<bool> {
        Some(last.status == Status::Terminated && last.reward > 0.0)
    }
}
