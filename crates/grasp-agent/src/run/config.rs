//! Settings of an agent.

use puma_val2::{Joint, JointDelta, Joints, Kinematics};
use serde::{Deserialize, Serialize};

use crate::behaviour::spec::GoalInterval;
use crate::checked::above_zero;
use crate::controllers::taught_goal::TaughtGoal;
use crate::limits::JointLimits;
use crate::percept::Percept;

/// Settings of an [`Agent`](crate::Agent).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AgentConfig {
    /// Poses to search from, at least one (section 2.2 of the paper: six). The nearest one is
    /// tried first.
    pub search_poses: Vec<Joints>,
    /// Displacements with which the search poses are tried again, one after the other, if the ball
    /// is in view from none of them (default `JT1` +12.5 with `JT2` +6 degrees, then `JT1` +12.5
    /// with `JT2` -6 degrees). A ball at the border of one view is in the middle of another.
    pub search_again: Vec<JointDelta>,
    /// Intervals that must all hold at once before the gripper moves (default x 99..108, y 74..82,
    /// r 32..34).
    pub goal: Vec<GoalInterval>,
    /// Move from the goal pose to the grip (default `JT5` by -18.01 degrees): the paper's "the
    /// fifth joint is activated". If it leads out of the limits and the controller has no aim
    /// of its own, the run ends with [`GaveUp::NoMoveLeft`](crate::GaveUp::NoMoveLeft).
    pub grip: JointDelta,
    /// `true`: turns `JT6` before the grip, the shorter way, until the jaws close at right angles
    /// to the object's longer axis ([`Sighting::long_axis`](crate::Sighting::long_axis)). `false`
    /// (default): leaves `JT6` alone. At `JT6` = 0 the jaws open along the rows of the image; a
    /// positive turn moves them from x toward y.
    pub grip_across: bool,
    /// Moves from the pose of the last sighting to look for a lost ball, after that pose itself
    /// (default four, in degrees: `JT2` -20, which draws the hand back and shows more; `JT2` -20
    /// with `JT1` +15; `JT2` -20 with `JT1` -15; `JT2` +12).
    pub recovery: Vec<JointDelta>,
    /// Range that each joint is kept in, finite (default [`JointLimits::paper`]).
    pub limits: JointLimits,
    /// Name of each joint in errors and logs; `""` for an unused place (default `JT1` to `JT6`).
    pub joint_names: [String; 6],
    /// Angle of the third joint at which theta 3 of a goal interval is zero, degrees (default
    /// [`Percept::THETA3_ZERO`](crate::Percept::THETA3_ZERO)).
    pub theta3_zero: f64,
    /// Moves after the first sighting before the run is given up, at least 1 (default 60). Two
    /// looks at the goal that show the ball at different places, or not at all the second time,
    /// count as a move.
    pub max_cycles: usize,
    /// Viewpoints of one search before it ends without a ball, at least 1 (default 1000). The
    /// search of the paper's poses has 18; a user-supplied search might never end. Together with
    /// `max_cycles` this bounds the run.
    pub max_views: usize,
    /// Frames to look at from one pose before the ball counts as not in view, at least 1
    /// (default 2).
    /// Detection by sampling can miss a circle once.
    pub looks: usize,
    /// Radius up to which any approach is slow enough, feature units (default 62).
    ///
    /// The radius of a ball of known size is inversely proportional to its distance. A move is
    /// taken back if the radius after it exceeds this and is more than `approach_growth` times the
    /// radius before (section 2.2 of the paper: "a rapid approach that could damage the camera").
    pub approach_radius: f64,
    /// Largest ratio of the radius after a move to the radius before it, above 0 and finite
    /// (default 1.5). It applies to radii above `approach_radius`.
    pub approach_growth: f64,
    /// Lift that verifies the grip (default `JT2` by -15 degrees). `None`: closing the jaws at the
    /// goal is success, whatever is between them.
    ///
    /// After the jaws have closed, the hand goes back to the pose from which the ball was last
    /// seen and looks whether the ball is still there. Then it is lifted by this move and
    /// looks whether a ball was left behind. A ball that keeps its place in the image as the
    /// hand goes up is in the jaws. A ball left behind is reached for again. A lift that is
    /// stopped, or shortened by the limits to less than half, verifies nothing: the run ends
    /// with [`GaveUp::Obstructed`](crate::GaveUp::Obstructed) or
    /// [`GaveUp::NoMoveLeft`](crate::GaveUp::NoMoveLeft).
    ///
    /// The jaws lie outside the camera's view, so this is a proof by exclusion: a ball that rolled
    /// out of both views, or that the detector misses in two looks at each, counts as grasped.
    /// Only a sensor in the jaws could tell.
    pub lift: Option<JointDelta>,
    /// Least radius of a ball that was left behind, seen from the lifted hand, feature units (at
    /// least 0, default 9). Smaller circles are something else, for example the end of the ball's
    /// stand.
    pub left_behind: f64,
    /// Largest distance of a joint from where it was sent, radians, before the arm counts as stuck
    /// (default 1 degree). A joint that has not begun a move between a tenth of this and 3.4
    /// degrees is freed first: it turns back by 1.1, 2.3 and 4.6 degrees until it goes all the way.
    pub reach_tolerance: f64,
    /// Unchanged images in a row, each from another pose, before the camera counts as frozen, at
    /// least 1 (default 2). Nothing is gripped after a single one, and with the jaws closed a
    /// single one ends the run.
    pub same_frames: usize,
    /// Small move by which the agent measures, at the first ball that it sees, how many looks an
    /// image is late; it has to displace the ball in the image by 10 units and more (default
    /// `None`: each image is exposed after the look begins). The agent then drops as many images
    /// after every move, and before it knows, the largest number that it can measure: 8.
    pub lag_check: Option<JointDelta>,
}

impl AgentConfig {
    /// Returns the paper's settings with the given search poses, and the defaults where the paper
    /// gives no number.
    pub fn paper(search_poses: impl Into<Vec<Joints>>) -> Self {
        let turn = |joint, degrees: f64| JointDelta::of(joint, degrees.to_radians());
        Self {
            search_poses: search_poses.into(),
            search_again: [6.0, -6.0]
                .map(|j2| JointDelta::from_degrees([12.5, j2, 0.0, 0.0, 0.0, 0.0]))
                .into(),
            goal: vec![GoalInterval::X, GoalInterval::Y, GoalInterval::R],
            grip: turn(Joint::J5, -18.01),
            grip_across: false,
            recovery: [(0.0, -20.0), (15.0, -20.0), (-15.0, -20.0), (0.0, 12.0)]
                .map(|(j1, j2)| JointDelta::from_degrees([j1, j2, 0.0, 0.0, 0.0, 0.0]))
                .into(),
            limits: JointLimits::paper(),
            joint_names: Joint::NAMES.map(Into::into),
            theta3_zero: Percept::THETA3_ZERO,
            max_cycles: 60,
            max_views: 1000,
            looks: 2,
            approach_radius: 62.0,
            approach_growth: 1.5,
            lift: Some(turn(Joint::J2, -15.0)),
            left_behind: 9.0,
            reach_tolerance: 1_f64.to_radians(),
            same_frames: 2,
            lag_check: None,
        }
    }

    /// Returns the settings for an arm: its limits and the names of its joints. Search again,
    /// recovery and lift turn the first two joints as far as those of [`AgentConfig::paper`], the
    /// second one in the direction that raises the hand in the first search pose; the grip is to be
    /// taught.
    pub fn for_arm(arm: &impl Kinematics, search_poses: impl Into<Vec<Joints>>) -> Self {
        let mut config = Self::paper(search_poses);
        config.limits = JointLimits(arm.limits());
        config.joint_names = arm.names().map(Into::into);
        let from = config.search_poses.first().copied().unwrap_or_default();
        let height = |turn: f64| {
            let pose = from + JointDelta::of(Joint::J2, turn);
            arm.forward(&pose).translation.z
        };
        // A PUMA's second joint raises the hand by a negative turn.
        if height(1e-3) > height(-1e-3) {
            let turned = config.search_again.iter_mut().chain(&mut config.recovery);
            turned
                .chain(&mut config.lift)
                .for_each(|delta| delta.0[1] = -delta.0[1]);
        }
        config
    }

    /// Returns the name of a joint.
    pub(crate) fn name(&self, joint: Joint) -> String {
        let name = &self.joint_names[joint.index()];
        if name.is_empty() {
            joint.to_string()
        } else {
            name.clone()
        }
    }

    /// Returns the settings with a goal that was shown on the arm, and its grip. `left_behind` is
    /// scaled by the radius at the goal, and `approach_radius` is at least a quarter more than
    /// that.
    #[must_use]
    pub fn with_taught_goal(self, goal: &TaughtGoal) -> Self {
        let [before, now] = [goal.untaught().r, goal.features().r];
        Self {
            left_behind: self.left_behind * now / before,
            approach_radius: self.approach_radius.max(1.25 * now),
            goal: goal.intervals(&self.goal),
            grip: goal.grip(),
            ..self
        }
    }

    /// Checks what can be known before anything moves.
    pub(crate) fn check(&self) -> Result<(), String> {
        self.limits.check(|joint| self.name(joint))?;
        for (name, count, remedy) in [
            (
                "search_poses",
                self.search_poses.len(),
                "give at least one pose",
            ),
            ("goal", self.goal.len(), "give at least one interval"),
            ("max_cycles", self.max_cycles, "allow at least one move"),
            ("max_views", self.max_views, "allow at least one viewpoint"),
            ("looks", self.looks, "look at least once"),
            ("same_frames", self.same_frames, "give at least 1"),
        ] {
            if count == 0 {
                return Err(format!("{name} is 0 or empty; {remedy}"));
            }
        }
        let mut poses = self.search_poses.iter();
        if let Some(pose) = poses.find(|pose| !self.limits.admit(pose)) {
            return Err(format!(
                "search_poses: {pose} lies outside the working limits"
            ));
        }
        self.goal.iter().try_for_each(GoalInterval::check)?;
        for (name, moves) in [
            ("search_again", &self.search_again),
            ("recovery", &self.recovery),
        ] {
            if !moves.iter().all(is_finite) {
                return Err(format!("{name} has a move that is not finite"));
            }
        }
        for (joint, (low, high)) in Joint::ALL.into_iter().zip(self.limits.0) {
            let turn = self.grip[joint];
            if turn.is_nan() || turn != 0.0 && turn.abs() > high - low {
                return Err(format!(
                    "grip turns {} by {} degrees, farther than its working limits are apart",
                    self.name(joint),
                    turn.to_degrees()
                ));
            }
        }
        let moves = |delta: &JointDelta| *delta != JointDelta::default() && is_finite(delta);
        for (name, delta) in [("lift", self.lift), ("lag_check", self.lag_check)] {
            if !delta.iter().all(moves) {
                return Err(format!(
                    "{name} moves nothing, or is not finite; give a move or None"
                ));
            }
        }
        if !(self.left_behind.is_finite() && self.left_behind >= 0.0) {
            return Err(format!(
                "left_behind is {}; it must be a radius, 0 or above",
                self.left_behind
            ));
        }
        if !self.theta3_zero.is_finite() {
            return Err(format!("theta3_zero is {}; give degrees", self.theta3_zero));
        }
        above_zero("reach_tolerance", self.reach_tolerance)?;
        above_zero("approach_radius", self.approach_radius)?;
        above_zero("approach_growth", self.approach_growth)
    }
}

fn is_finite(delta: &JointDelta) -> bool {
    delta.0.iter().all(|turn| turn.is_finite())
}
