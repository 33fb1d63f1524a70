//! What the controller is told about its cell.

use puma_val2::{Joint, JointDelta, Joints};

use crate::behaviour::spec::GoalInterval;
use crate::checked::{above_zero, checked};
use crate::controllers::taught_goal::TaughtGoal;
use crate::error::AgentError;
use crate::limits::JointLimits;
use crate::percept::Input;

/// Settings of an [`Agent`](crate::Agent).
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(remote = "Self")
)]
pub struct AgentConfig {
    /// Poses to look around from, at least one (section 2.2 of the paper: six). They are tried
    /// nearest first.
    pub search_poses: Vec<Joints>,
    /// When the ball is in view from none of them: displacements with which they are tried once
    /// more, in turn [`J1` +12.5 with `J2` +6, then `J1` +12.5 with `J2` -6 degrees\]. A ball at
    /// the border of one view is in the middle of another.
    pub search_again: Vec<JointDelta>,
    /// Intervals that must hold together before the gripper moves \[x 99..108, y 74..82, r
    /// 32..34\].
    pub goal: Vec<GoalInterval>,
    /// From the goal pose to the grip [`J5` by -18.01 degrees\]: the paper's "the fifth joint is
    /// activated". Where it would lead out of the limits, and the controller has no grip of its
    /// own, the run ends with [`GaveUp::NoMoveLeft`](crate::GaveUp::NoMoveLeft).
    pub grip: JointDelta,
    /// Where the ball is looked for when it is lost, relative to the pose of the last sighting
    /// \[four moves: `J2` by -20 degrees, which draws the hand back and shows more, the same with
    /// `J1` by +15 and by -15, and `J2` by +12\]; tried in order, after that pose itself.
    pub recovery: Vec<JointDelta>,
    /// The range that each joint is kept in, finite [[`JointLimits::paper`]].
    pub limits: JointLimits,
    /// Moves after the first sighting before the run is given up \[60\]; two looks at the goal that
    /// show the ball at different places count as one, and so does a ball there that the second
    /// look does not show. At least 1.
    pub max_cycles: usize,
    /// Viewpoints of one search before it counts as one that found nothing \[1000\]; at least 1.
    /// The search of the paper's poses has 18, another one might never end. With `max_cycles`,
    /// which bounds the moves between two searches and their number, it bounds the run.
    #[cfg_attr(feature = "serde", serde(default = "many_views"))]
    pub max_views: usize,
    /// Frames to look at from one pose before the ball counts as not in view \[2\]. Sampling can
    /// miss a circle once.
    pub looks: usize,
    /// How fast the hand may come nearer to the ball.
    pub approach: ApproachLimit,
    /// After the jaws have closed the hand goes back to where the ball was last seen from, and
    /// looks whether it is still there; then it is lifted by this move and looks whether a ball was
    /// left behind \[`J2` by -15 degrees\]. One that keeps its place in the image as the hand goes
    /// up is in the jaws. A ball that is not is reached for again; a hand that is stopped has not
    /// succeeded, nor has one that its limits keep from half of this move
    /// ([`GaveUp::NoMoveLeft`](crate::GaveUp::NoMoveLeft)). `None`: closing the jaws at the goal is
    /// success, whatever is between them.
    ///
    /// The check is by exclusion. The jaws lie outside the camera's view, so a ball in them is not
    /// seen: no ball where it was and none below the lifted hand, in two looks each, counts as
    /// held. A ball that is seen where it was has been missed. A ball that left both views in
    /// another way, rolled off or knocked aside, passes for one that is held, and so does one that
    /// the detector misses each time. Only a sensor in the jaws could tell.
    pub lift: Option<JointDelta>,
    /// Least radius of a ball that was left behind, seen from the lifted hand, feature units \[9\]:
    /// smaller circles are something else, the end of what the ball stood on for example.
    pub left_behind: f64,
    /// How far a joint may stand from where it was sent, radians, before the arm counts as stuck
    /// \[1 degree\].
    pub reach_tolerance: f64,
    /// Frames in a row, each from another pose, that may be the same as the one before, or show the
    /// ball at exactly the same place, before the camera counts as frozen \[2\]; at least 1.
    /// Nothing is gripped after a single one of them, and after one no grip is verified: with the
    /// jaws closed, one is enough.
    pub same_frames: usize,
}

/// Of settings that were saved before they had such a number: far more than any search that ends
/// needs.
fn many_views() -> usize {
    1000
}

/// What is too rapid an approach (section 2.2 of the paper: one "that could damage the camera").
///
/// Of a ball of known size the radius is a measure of the distance: the product of both is
/// constant. A move that ends with the ball at a radius beyond `radius`, more than `growth` times
/// what it was, is taken back.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(remote = "Self")
)]
pub struct ApproachLimit {
    /// Radius up to which any approach is slow enough, feature units \[62\].
    pub radius: f64,
    /// Greatest growth of the radius in one move beyond that \[1.5\]; finite, as an infinite number
    /// cannot be saved.
    pub growth: f64,
}

checked!(ApproachLimit);

impl ApproachLimit {
    /// Whether it is one; if not, why.
    fn check(&self) -> Result<(), String> {
        let Self { radius, growth } = *self;
        above_zero("approach.radius", radius)?;
        above_zero("approach.growth", growth)
    }

    /// Whether a move that took the radius from `before` to `after` units was too rapid.
    pub fn exceeded(&self, before: f64, after: f64) -> bool {
        after > self.radius && after > self.growth * before
    }
}

checked!(AgentConfig);

impl AgentConfig {
    /// The paper's controller with the given search poses; where the paper gives no number, the
    /// ones in the brackets of the fields.
    pub fn paper(search_poses: impl Into<Vec<Joints>>) -> Self {
        let interval = |input, low, high| GoalInterval { input, low, high };
        let turn = |joint, degrees: f64| JointDelta::of(joint, degrees.to_radians());
        Self {
            search_poses: search_poses.into(),
            search_again: [6.0, -6.0]
                .map(|j2| JointDelta::from_degrees([12.5, j2, 0.0, 0.0, 0.0, 0.0]))
                .into(),
            goal: vec![
                interval(Input::X, 99.0, 108.0),
                interval(Input::Y, 74.0, 82.0),
                interval(Input::R, 32.0, 34.0),
            ],
            grip: turn(Joint::J5, -18.01),
            recovery: [(0.0, -20.0), (15.0, -20.0), (-15.0, -20.0), (0.0, 12.0)]
                .map(|(j1, j2)| JointDelta::from_degrees([j1, j2, 0.0, 0.0, 0.0, 0.0]))
                .into(),
            limits: JointLimits::paper(),
            max_cycles: 60,
            max_views: many_views(),
            looks: 2,
            approach: ApproachLimit {
                radius: 62.0,
                growth: 1.5,
            },
            lift: Some(turn(Joint::J2, -15.0)),
            left_behind: 9.0,
            reach_tolerance: 1_f64.to_radians(),
            same_frames: 2,
        }
    }

    /// Checks what can be known before anything moves.
    pub(crate) fn check(&self) -> Result<(), AgentError> {
        if self.search_poses.is_empty() {
            return Err(AgentError::Config(
                "there is no search pose; give at least one".into(),
            ));
        }
        self.check_numbers().map_err(AgentError::Config)?;
        if let Some(pose) = self
            .search_poses
            .iter()
            .find(|pose| !self.limits.admit(pose))
        {
            return Err(AgentError::Config(format!(
                "the search pose {pose} lies outside the working limits"
            )));
        }
        if self.goal.is_empty() {
            return Err(AgentError::Config(
                "there is no goal; give at least one interval".into(),
            ));
        }
        let (limits, zero) = (&self.limits.0, JointDelta::default());
        let beyond = |joint: &Joint| {
            let (low, high) = limits[joint.index()];
            self.grip[*joint].is_nan() || self.grip[*joint].abs() > high - low
        };
        if let Some(joint) = Joint::ALL
            .iter()
            .find(|joint| self.grip[**joint] != 0.0 && beyond(joint))
        {
            return Err(AgentError::Config(format!(
                "the grip turns {joint} by {} degrees, farther than its working limits are apart",
                self.grip[*joint].to_degrees()
            )));
        }
        if self
            .lift
            .is_some_and(|lift| lift == zero || !lift.0.iter().all(|turn| turn.is_finite()))
        {
            return Err(AgentError::Config(
                "the lift moves nothing, or is not finite; give a move, or None for no lift".into(),
            ));
        }
        if !(self.left_behind.is_finite() && self.left_behind >= 0.0) {
            return Err(AgentError::Config(format!(
                "left_behind is {}; it must be a radius, 0 or above",
                self.left_behind
            )));
        }
        if self.same_frames == 0 {
            return Err(AgentError::Config(
                "same_frames is 0; every camera would count as frozen, give at least 1".into(),
            ));
        }
        if self.max_views == 0 {
            return Err(AgentError::Config(
                "max_views is 0; the search could look from nowhere, give at least 1".into(),
            ));
        }
        if self.looks == 0 {
            return Err(AgentError::Config(
                "looks is 0; the agent must look at least once".into(),
            ));
        }
        Ok(())
    }

    /// What must be a number, and of which size.
    fn check_numbers(&self) -> Result<(), String> {
        self.limits.check()?;
        self.goal.iter().try_for_each(GoalInterval::check)?;
        for (name, moves) in [
            ("search_again", &self.search_again),
            ("recovery", &self.recovery),
        ] {
            if moves
                .iter()
                .flat_map(|delta| delta.0)
                .any(|turn| !turn.is_finite())
            {
                return Err(format!("{name} has a displacement that is not finite"));
            }
        }
        above_zero("reach_tolerance", self.reach_tolerance)?;
        self.approach.check()?;
        if self.max_cycles == 0 {
            return Err("max_cycles is 0; no move could be made, give at least 1".into());
        }
        Ok(())
    }
}

impl TaughtGoal {
    /// `config` with this goal and its grip.
    #[must_use]
    pub fn applied_to(&self, config: AgentConfig) -> AgentConfig {
        AgentConfig {
            goal: self.intervals(&config.goal),
            grip: self.grip(),
            ..config
        }
    }
}
