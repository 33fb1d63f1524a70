//! The behaviours of the paper as a task: moves, goal and rewards.

use grasp_agent::puma_val2::Joint;
use grasp_agent::qtable::Action;
use grasp_agent::{BehaviourPair, BehaviourSpec, Input, Percept};
use hough_heuristic::Features;
use pipeline_sim::Cell;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Discount factor of the paper, for the value of an absorbing goal.
const GAMMA: f64 = 0.9;

/// The way that steps are paid.
#[derive(Clone, Copy, PartialEq)]
pub enum Pay {
    /// Equations 5 and 6 of the paper with both mends.
    Paper,
    /// 1 for success, -1 for failure.
    Sparse,
    /// The way that the ball came closer to the goal, 5 for success, -5 for failure.
    Shaped,
}

/// Pay for success and, below zero, for failure, if steps are paid as [`Pay::Shaped`].
const SHAPED_END: f64 = 5.0;
/// Cost of a step then.
const SHAPED_STEP: f64 = 0.05;

/// The end of a step; the numbers go to Python.
#[derive(Clone, Copy, PartialEq)]
#[repr(u8)]
pub enum Outcome {
    Continuing = 0,
    Reached = 1,
    Lost = 2,
    Grasped = 3,
    Missed = 4,
    Collided = 5,
}

/// One or both behaviours.
#[derive(Clone)]
pub struct Task {
    behaviours: Vec<BehaviourSpec>,
    pay: Pay,
    /// Turns of `JT1`, `JT2` and `JT3` of each action of each behaviour, degrees.
    pub moves: Vec<Vec<[f64; 3]>>,
}

impl Task {
    pub fn new(name: &str, reward: &str) -> PyResult<Self> {
        let BehaviourPair {
            centering,
            approaching,
        } = BehaviourPair::paper_mended();
        let behaviours = match name {
            "reaching" => vec![centering, approaching],
            "centering" => vec![centering],
            "approaching" => vec![approaching],
            _ => {
                return Err(PyValueError::new_err(format!(
                    "task is {name:?}: use \"reaching\", \"centering\" or \"approaching\""
                )));
            }
        };
        let pay = match reward {
            "paper" => Pay::Paper,
            "sparse" => Pay::Sparse,
            "shaped" => Pay::Shaped,
            _ => {
                return Err(PyValueError::new_err(format!(
                    "reward is {reward:?}: use \"paper\", \"sparse\" or \"shaped\""
                )));
            }
        };
        let turns = |spec: &BehaviourSpec, action| {
            let [d1, d2, d3, ..] = spec.delta(Action(action)).degrees();
            [d1, d2, d3]
        };
        let of = |spec: &BehaviourSpec| (0..spec.actions()).map(|a| turns(spec, a)).collect();
        Ok(Self {
            moves: behaviours.iter().map(of).collect(),
            behaviours,
            pay,
        })
    }

    /// Largest turn of each of the three joints, degrees.
    pub fn largest(&self) -> [f64; 3] {
        let steps = self.behaviours.iter().flat_map(|spec| &spec.moves);
        let mut largest = [0.0; 3];
        for step in steps {
            let at = match step.joint {
                Joint::J1 => 0,
                Joint::J2 => 1,
                _ => 2,
            };
            largest[at] = step.degrees.iter().copied().fold(0.0, f64::max);
        }
        largest
    }

    pub fn at_goal(&self, percept: &Percept) -> bool {
        self.behaviours.iter().all(|spec| spec.at_goal(percept))
    }

    /// The goal intervals: index in the observation (x, y, r, theta 3), lowest and highest value.
    pub fn goal(&self) -> Vec<(usize, f64, f64)> {
        let all = self.behaviours.iter().flat_map(|spec| &spec.goal);
        all.map(|interval| (interval.input as usize, interval.low, interval.high))
            .collect()
    }

    /// Pay for a step that ended so.
    pub fn reward(&self, before: &Percept, after: &Percept, outcome: Outcome) -> f64 {
        let reward = &self.behaviours[0].reward;
        match (outcome, self.pay) {
            (Outcome::Reached | Outcome::Grasped, Pay::Paper) => reward.arrival(GAMMA),
            (Outcome::Reached | Outcome::Grasped, Pay::Sparse) => 1.0,
            (Outcome::Reached | Outcome::Grasped, Pay::Shaped) => SHAPED_END,
            (Outcome::Continuing, Pay::Paper) => {
                let steps = self.behaviours.iter();
                steps.map(|spec| spec.reward.step(before, after)).sum()
            }
            (Outcome::Continuing, Pay::Sparse) => 0.0,
            (Outcome::Continuing, Pay::Shaped) => self.off(before) - self.off(after) - SHAPED_STEP,
            (_, Pay::Paper) => reward.lost,
            (_, Pay::Sparse) => -1.0,
            (_, Pay::Shaped) => -SHAPED_END,
        }
    }

    /// Distance to the middle of the goal, about 1 for a quarter of the frame or a factor of e in
    /// the radius.
    fn off(&self, percept: &Percept) -> f64 {
        let [x, y, r, _] = relative(percept);
        let goals = self.behaviours.iter().flat_map(|spec| &spec.goal);
        let off = goals.map(|goal| match goal.input {
            Input::X => 2.0 * x.abs(),
            Input::Y => 2.0 * y.abs(),
            Input::R => r.abs(),
            Input::Theta3 => 0.0,
        });
        off.sum()
    }
}

/// x and y relative to the middle of the goal by half the frame, the logarithm of the radius
/// relative to that there, and theta 3 by 45 degrees.
pub fn relative(percept: &Percept) -> [f64; 4] {
    let (seen, goal) = (&percept.features, Cell::GOAL);
    [
        (seen.x - goal.x) / (Features::WIDTH / 2.0),
        (seen.y - goal.y) / (Features::HEIGHT / 2.0),
        (seen.r.max(1.0) / goal.r).ln(),
        percept.theta3 / 45.0,
    ]
}
