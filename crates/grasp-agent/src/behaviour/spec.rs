//! Behaviours as data: states, actions, goal and reward, with the paper's values as presets.

use hough_heuristic::Features;
use puma_val2::{Joint, JointDelta, Joints};
use qtable::{Action, Error, Intervals, State, Status, Step};
use serde::{Deserialize, Serialize};

use crate::behaviour::reward::Reward;
use crate::behaviour::space::StateSpace;
use crate::limits::JointLimits;
use crate::percept::{Input, Percept};

/// A behaviour as data, without its table.
///
/// The state is the product of intervals of some inputs; the action is the product of angle steps
/// of some joints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BehaviourSpec {
    /// Name, for files and messages.
    pub name: String,
    /// Inputs, in the order of the intervals of `space`.
    pub inputs: Vec<Input>,
    /// Bins of each input.
    pub space: StateSpace,
    /// Joints that it moves, and their steps.
    pub moves: Vec<JointSteps>,
    /// Goal intervals; at the goal all of them hold at once.
    pub goal: Vec<GoalInterval>,
    /// Reward that teaches it.
    pub reward: Reward,
    /// Angle of the third joint at which theta 3 is zero, degrees (default
    /// [`Percept::THETA3_ZERO`]).
    #[serde(default = "puma_zero")]
    pub theta3_zero: f64,
    /// Range of theta 3 that trials of a table keep to, degrees (default -50 to 45, the range of
    /// `JT3` in [`JointLimits::paper`](crate::JointLimits::paper)).
    #[serde(default = "puma_range")]
    pub theta3_range: (f64, f64),
}

fn puma_zero() -> f64 {
    Percept::THETA3_ZERO
}

fn puma_range() -> (f64, f64) {
    let (low, high) = JointLimits::PAPER_DEGREES[2];
    (low - puma_zero(), high - puma_zero())
}

/// Steps that a behaviour can make with one joint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointSteps {
    /// The joint.
    pub joint: Joint,
    /// The steps, degrees.
    pub degrees: Vec<f64>,
}

impl JointSteps {
    fn check(&self) -> Result<(), String> {
        let Self { joint, degrees } = self;
        if degrees.is_empty() {
            return Err(format!("{joint} has no steps"));
        }
        match degrees.iter().find(|step| !step.is_finite()) {
            Some(step) => Err(format!("{joint} has a step of {step} degrees")),
            None => Ok(()),
        }
    }
}

/// A goal interval of one input, closed at both ends.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GoalInterval {
    /// The input.
    pub input: Input,
    /// Lowest value at the goal.
    pub low: f64,
    /// Highest value at the goal.
    pub high: f64,
}

impl GoalInterval {
    /// The paper's goal interval of x, feature units.
    pub const X: Self = Self::new(Input::X, 99.0, 108.0);
    /// The paper's goal interval of y in Eq. 6, feature units. Its middle is the 78 that the reward
    /// of the same equation aims at; from anywhere in it the paper's fixed turn of the fifth joint
    /// brings the gripper to within 6.3 mm of the ball.
    pub const Y: Self = Self::new(Input::Y, 74.0, 82.0);
    /// The paper's goal interval of y in section 4, feature units. It is reached in fewer moves
    /// than that of Eq. 6, and leaves the gripper up to 10.6 mm beside the ball.
    pub const Y_SECTION_4: Self = Self::new(Input::Y, 74.0, 92.0);
    /// The paper's goal interval of r, feature units.
    pub const R: Self = Self::new(Input::R, 32.0, 34.0);

    /// Creates an interval.
    pub const fn new(input: Input, low: f64, high: f64) -> Self {
        Self { input, low, high }
    }

    /// Returns the features in the middle of the paper's goal intervals: (103.5, 78, 33).
    pub(crate) fn paper_features() -> Features {
        Features::new(Self::X.middle(), Self::Y.middle(), Self::R.middle())
    }

    /// Returns the middle.
    pub(crate) fn middle(&self) -> f64 {
        0.5 * (self.low + self.high)
    }

    /// Returns half the width.
    pub(crate) fn half_width(&self) -> f64 {
        0.5 * (self.high - self.low)
    }

    /// Returns `true` if `percept` lies in the interval.
    pub fn holds(&self, percept: &Percept) -> bool {
        (self.low..=self.high).contains(&self.input.of(percept))
    }

    /// Checks that the interval is one.
    pub(crate) fn check(&self) -> Result<(), String> {
        let Self { input, low, high } = self;
        if low.is_finite() && high.is_finite() && low <= high {
            return Ok(());
        }
        Err(format!("the goal of {input:?} is from {low} to {high}"))
    }
}

/// Edges of the radius, common to both behaviours; the goal is \[32, 34\].
const R_EDGES: [f64; 5] = [14.0, 22.0, R.low, R.high, 47.0];
const Y: GoalInterval = GoalInterval::Y;
const R: GoalInterval = GoalInterval::R;

impl BehaviourSpec {
    /// Returns the paper's centering behaviour: 7 intervals of x by 6 of r (42 states), 9 steps of
    /// J1, Eq. 5 with both mends.
    ///
    /// The goal interval \[99, 108\] and the steps of 5 and 1 degrees are the paper's; it does not
    /// print the others.
    pub fn centering() -> Self {
        Self {
            name: "centering".into(),
            inputs: vec![Input::X, Input::R],
            space: space([
                (
                    &[
                        50.0,
                        82.0,
                        GoalInterval::X.low,
                        GoalInterval::X.high,
                        125.0,
                        157.0,
                    ],
                    Some(3),
                ),
                (&R_EDGES, Some(3)),
            ]),
            moves: vec![JointSteps {
                joint: Joint::J1,
                degrees: vec![-5.0, -1.0, -0.5, -0.2, 0.0, 0.2, 0.5, 1.0, 5.0],
            }],
            goal: vec![GoalInterval::X],
            reward: Reward::centering_literal().mended(),
            theta3_zero: puma_zero(),
            theta3_range: puma_range(),
        }
    }

    /// Returns the paper's approaching behaviour: 5 intervals of y by 6 of r by 3 of theta 3 (90
    /// states), 9 steps of J2 by 9 of J3 (81 actions), Eq. 6 with both mends.
    ///
    /// The goal (y in \[74, 82\], r in \[32, 34\]) and the steps of 20, 6 and 16, 5 degrees are the
    /// paper's; it does not print the others.
    pub fn approaching() -> Self {
        Self {
            name: "approaching".into(),
            inputs: vec![Input::Y, Input::R, Input::Theta3],
            space: space([
                (&[43.0, Y.low, Y.high, 98.0], Some(2)),
                (&[15.0, 27.0, R.low, R.high, 50.0], Some(3)),
                (&[6.0, 27.0], None),
            ]),
            moves: vec![
                JointSteps {
                    joint: Joint::J2,
                    degrees: vec![-20.0, -6.0, -2.0, -0.6, 0.0, 0.6, 2.0, 6.0, 20.0],
                },
                JointSteps {
                    joint: Joint::J3,
                    degrees: vec![-16.0, -5.0, -1.6, -0.5, 0.0, 0.5, 1.6, 5.0, 16.0],
                },
            ],
            goal: vec![GoalInterval::Y, GoalInterval::R],
            reward: Reward::approaching_literal().mended(),
            theta3_zero: puma_zero(),
            theta3_range: puma_range(),
        }
    }

    /// Returns [`BehaviourSpec::approaching`] on 540 states, 9 intervals of y by 10 of r by 6 of
    /// theta 3. A lost ball costs 1000: 100 / (1 - gamma) with the paper's gamma of 0.9, as the
    /// goal is worth.
    ///
    /// In regions as small as these the long actions lose the ball from a corner only. A penalty of
    /// 100 is too little, on average over the region, to bar them.
    pub fn approaching_fine() -> Self {
        let approaching = Self::approaching();
        Self {
            name: "approaching_fine".into(),
            reward: Reward {
                lost: -1000.0,
                ..approaching.reward
            },
            space: space([
                (
                    &[20.0, 40.0, 60.0, Y.low, Y.high, 96.0, 114.0, 130.0],
                    Some(4),
                ),
                (
                    &[9.5, 12.0, 16.0, 21.0, 27.0, R.low, R.high, 40.0, 50.0],
                    Some(6),
                ),
                (&[-3.0, 5.0, 15.0, 25.0, 33.0], None),
            ]),
            ..approaching
        }
    }

    /// Returns the behaviour with another goal interval of y, [`GoalInterval::Y_SECTION_4`] for
    /// example.
    ///
    /// The interval replaces the goal bin in the state space too; edges inside it are dropped.
    /// Specifications without y stay as they are.
    ///
    /// # Errors
    /// Edges that do not increase: ends that are not finite or not in order.
    pub fn with_y_goal(mut self, goal: GoalInterval) -> Result<Self, Error> {
        let GoalInterval { low, high, .. } = goal;
        let space = self.space.inputs().zip(&self.inputs);
        let space = space.map(|((bins, goal), input)| match goal {
            Some(goal) if *input == Input::Y => with_ends(bins, goal, low, high),
            _ => Ok((bins.clone(), goal)),
        });
        self.space = StateSpace::new(space.collect::<Result<_, _>>()?)?;
        for interval in &mut self.goal {
            if interval.input == Input::Y {
                (interval.low, interval.high) = (low, high);
            }
        }
        Ok(self)
    }

    /// Returns the behaviour with another reward.
    #[must_use]
    pub(crate) fn with_reward(self, reward: Reward) -> Self {
        Self { reward, ..self }
    }

    /// Returns the number of states.
    pub fn states(&self) -> usize {
        self.space.states()
    }

    /// Returns the number of actions, [`usize::MAX`] if there are more.
    pub fn actions(&self) -> usize {
        self.moves.iter().fold(1, |actions: usize, steps| {
            actions.saturating_mul(steps.degrees.len())
        })
    }

    /// Returns what the behaviour perceives of `features` from the pose `joints`.
    pub fn percept(&self, features: Features, joints: &Joints) -> Percept {
        let theta3 = joints[Joint::J3].to_degrees() - self.theta3_zero;
        Percept { features, theta3 }
    }

    /// Returns the state of `percept`.
    ///
    /// # Errors
    /// An input that is NaN, with its position.
    pub fn state(&self, percept: &Percept) -> Result<State, Error> {
        self.space
            .state(self.inputs.iter().map(|input| input.of(percept)))
    }

    /// Returns the joint move of `action`, a mixed-radix number in which the last joint's step
    /// varies fastest. Actions from [`BehaviourSpec::actions`] on repeat from the beginning.
    pub fn delta(&self, action: Action) -> JointDelta {
        let mut degrees = [0.0; 6];
        let mut rest = action.0;
        for steps in self
            .moves
            .iter()
            .rev()
            .filter(|steps| !steps.degrees.is_empty())
        {
            degrees[steps.joint.index()] = steps.degrees[rest % steps.degrees.len()];
            rest /= steps.degrees.len();
        }
        JointDelta::from_degrees(degrees)
    }

    /// Returns the step to the percept `after`; without one, or for NaN, the ball is lost.
    pub(crate) fn outcome(
        &self,
        (before, state): (&Percept, State),
        after: Option<&Percept>,
        gamma: f64,
    ) -> Step {
        let seen = after.and_then(|after| Some((after, self.state(after).ok()?)));
        let (observation, reward, status) = match seen {
            None => (state, self.reward.lost, Status::Terminated),
            Some((after, next)) if self.at_goal(after) => {
                (next, self.reward.arrival(gamma), Status::Terminated)
            }
            Some((after, next)) => (next, self.reward.step(before, after), Status::Continuing),
        };
        Step {
            observation,
            reward,
            status,
        }
    }

    /// Checks that a program could run it.
    pub(crate) fn check(&self) -> Result<(), String> {
        let (low, high) = self.theta3_range;
        if !(self.theta3_zero.is_finite() && low <= high) {
            let zero = self.theta3_zero;
            return Err(format!(
                "theta 3 is zero at {zero} degrees and goes from {low} to {high}"
            ));
        }
        let axes = self.space.inputs().len();
        if self.inputs.len() != axes {
            return Err(format!(
                "there are {} inputs and intervals for {axes}",
                self.inputs.len()
            ));
        }
        if self.moves.is_empty() {
            return Err("it moves no joint".into());
        }
        for (i, steps) in self.moves.iter().enumerate() {
            if self.moves[..i]
                .iter()
                .any(|before| before.joint == steps.joint)
            {
                return Err(format!("{} is moved twice", steps.joint));
            }
            steps.check()?;
        }
        if self.goal.is_empty() {
            return Err("it has no goal".into());
        }
        self.goal.iter().try_for_each(GoalInterval::check)?;
        self.reward.check()
    }

    /// Returns the first part in which two specifications differ.
    pub(crate) fn difference(&self, other: &Self) -> &'static str {
        match () {
            () if self.name != other.name => "name",
            () if self.inputs != other.inputs || self.space != other.space => "state space",
            () if self.moves != other.moves => "set of actions",
            () if self.goal != other.goal => "goal",
            () if self.reward != other.reward => "reward",
            () => "angle theta 3",
        }
    }

    /// Returns `true` if `percept` is at the goal.
    pub fn at_goal(&self, percept: &Percept) -> bool {
        self.goal.iter().all(|interval| interval.holds(percept))
    }
}

/// Returns the bins with other ends of the goal bin, without edges inside it, and its new place.
fn with_ends(
    bins: &Intervals,
    goal: usize,
    low: f64,
    high: f64,
) -> Result<(Intervals, Option<usize>), Error> {
    // All edges but the two of the goal.
    let others = bins.edges().iter().copied().enumerate();
    let others = others.filter(|(i, _)| *i != goal && i + 1 != goal);
    let others = others.map(|(_, edge)| edge);
    let below = others.clone().filter(|edge| *edge < low);
    let above = others.filter(|edge| *edge > high);
    let edges: Vec<f64> = below.chain([low, high]).chain(above).collect();
    let place = edges.iter().position(|edge| *edge >= low);
    Ok((Intervals::new(&edges)?, Some(place.map_or(1, |i| i + 1))))
}

/// Returns the state space with these edges and goal bins.
fn space<const N: usize>(inputs: [(&[f64], Option<usize>); N]) -> StateSpace {
    let inputs = inputs.map(|(edges, goal)| Ok((Intervals::new(edges)?, goal)));
    inputs
        .into_iter()
        .collect::<Result<_, _>>()
        .and_then(StateSpace::new)
        .expect("the edges of the presets increase strictly and their goals exist")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn percept(x: f64, y: f64, r: f64, theta3: f64) -> Percept {
        Percept {
            features: Features::new(x, y, r),
            theta3,
        }
    }

    #[test]
    fn the_presets_have_the_papers_sizes() {
        let (centering, approaching) = (BehaviourSpec::centering(), BehaviourSpec::approaching());
        assert_eq!((centering.states(), centering.actions()), (42, 9));
        assert_eq!((approaching.states(), approaching.actions()), (90, 81));
    }

    #[test]
    fn goal_intervals_are_closed_in_state_and_test_alike() {
        let spec = BehaviourSpec::centering();
        let inside = spec.state(&percept(103.0, 0.0, 33.0, 0.0)).unwrap();
        for (x, at_goal) in [
            (99.0, true),
            (108.0, true),
            (98.999, false),
            (108.001, false),
        ] {
            let p = percept(x, 0.0, 33.0, 0.0);
            assert_eq!(spec.at_goal(&p), at_goal, "x = {x}");
            assert_eq!(spec.state(&p).unwrap() == inside, at_goal, "x = {x}");
        }
    }

    #[test]
    fn the_goal_of_y_can_be_that_of_section_4() {
        let spec = BehaviourSpec::approaching()
            .with_y_goal(GoalInterval::Y_SECTION_4)
            .unwrap();
        assert_eq!(spec.states(), 90);
        assert!(
            spec.at_goal(&percept(0.0, 91.0, 33.0, 10.0))
                && !spec.at_goal(&percept(0.0, 93.0, 33.0, 10.0))
        );
        let inside = spec.state(&percept(0.0, 80.0, 33.0, 10.0)).unwrap();
        assert_eq!(spec.state(&percept(0.0, 92.0, 33.0, 10.0)).unwrap(), inside);
        assert!(
            BehaviourSpec::approaching()
                .with_y_goal(GoalInterval::new(Input::Y, 92.0, 74.0))
                .is_err()
        );
    }

    #[test]
    fn more_actions_than_can_be_counted_are_no_panic() {
        let mut spec = BehaviourSpec::centering();
        let two = JointSteps {
            joint: Joint::J1,
            degrees: vec![-1.0, 1.0],
        };
        spec.moves = vec![two; 65];
        assert_eq!(spec.actions(), usize::MAX);
    }

    #[test]
    fn every_action_is_another_move() {
        let spec = BehaviourSpec::approaching();
        let moves: Vec<[f64; 6]> = (0..spec.actions())
            .map(|a| spec.delta(Action(a)).degrees())
            .collect();
        assert!((moves[0][1] + 20.0).abs() < 1e-9 && (moves[0][2] + 16.0).abs() < 1e-9);
        assert!(moves[40].iter().all(|d| d.abs() < 1e-12));
        assert!((moves[41][2] - 0.5).abs() < 1e-9 && moves[41][1].abs() < 1e-12);
        for (i, a) in moves.iter().enumerate() {
            let same = |b: &[f64; 6]| a.iter().zip(b).all(|(p, q)| (p - q).abs() < 1e-9);
            assert!(!moves[..i].iter().any(same), "action {i} repeats");
        }
    }
}
