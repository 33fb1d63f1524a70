//! What the controller is told about its cell.

use puma_val2::{Joint, JointDelta, Joints};

use crate::{AgentError, GoalInterval, Input};

/// Settings of an [`Agent`](crate::Agent).
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AgentConfig {
    /// Poses to look around from, at least one (section 2.2 of the paper: six). They are tried nearest first.
    pub search_poses: Vec<Joints>,
    /// Intervals that must hold together before the gripper moves [x 99..108, y 74..82, r 32..34].
    pub goal: Vec<GoalInterval>,
    /// From the goal pose to the grip [`J5` by -18.01 degrees]: the paper's "the fifth joint is activated".
    pub grip: JointDelta,
    /// Where the ball is looked for when it is lost, relative to the pose of the last sighting
    /// [four moves: `J1` +10, -10, `J2` +8, -8 degrees]; tried in order, after that pose itself.
    pub recovery: Vec<JointDelta>,
    /// The range that the controller keeps each joint in, radians (low, high), `JT1` first
    /// [-160..160, -150..-20, 120..215, -110..170, -100..100, -266..266 degrees].
    pub limits: [(f64, f64); 6],
    /// What choosing a centering action again in the same state costs, in units of Q [50]; see
    /// [`Behaviour::choose`](crate::Behaviour::choose). 0 is the plain greedy policy.
    pub centering_kappa: f64,
    /// The same for approaching [20].
    pub approaching_kappa: f64,
    /// Moves after the first sighting before the run is given up [60].
    pub max_cycles: usize,
    /// Frames to look at from one pose before the ball counts as not in view [2]. Sampling can miss a circle once.
    pub looks: usize,
}

impl AgentConfig {
    /// The paper's controller with the given search poses; where the paper gives no number, the ones in the brackets of the
    /// fields.
    pub fn paper(search_poses: impl Into<Vec<Joints>>) -> Self {
        let interval = |input, low, high| GoalInterval { input, low, high };
        let turn = |joint, degrees: f64| JointDelta::of(joint, degrees.to_radians());
        Self {
            search_poses: search_poses.into(),
            goal: vec![
                interval(Input::X, 99.0, 108.0),
                interval(Input::Y, 74.0, 82.0),
                interval(Input::R, 32.0, 34.0),
            ],
            grip: turn(Joint::J5, -18.01),
            recovery: vec![
                turn(Joint::J1, 10.0),
                turn(Joint::J1, -10.0),
                turn(Joint::J2, 8.0),
                turn(Joint::J2, -8.0),
            ],
            limits: [
                (-160.0_f64, 160.0_f64),
                (-150.0, -20.0),
                (120.0, 215.0),
                (-110.0, 170.0),
                (-100.0, 100.0),
                (-266.0, 266.0),
            ]
            .map(|(low, high)| (low.to_radians(), high.to_radians())),
            centering_kappa: 50.0,
            approaching_kappa: 20.0,
            max_cycles: 60,
            looks: 2,
        }
    }

    /// Whether every joint of `joints` is within the working limits.
    pub fn admits(&self, joints: &Joints) -> bool {
        self.limits
            .iter()
            .zip(joints.0)
            .all(|(&(low, high), angle)| (low..=high).contains(&angle))
    }

    /// Checks what can be known before anything moves.
    pub(crate) fn check(&self) -> Result<(), AgentError> {
        if self.search_poses.is_empty() {
            return Err(AgentError::Config(
                "there is no search pose; give at least one".into(),
            ));
        }
        if let Some(pose) = self.search_poses.iter().find(|pose| !self.admits(pose)) {
            return Err(AgentError::Config(format!(
                "the search pose {pose} lies outside the working limits"
            )));
        }
        if self.goal.is_empty() {
            return Err(AgentError::Config(
                "there is no goal; give at least one interval".into(),
            ));
        }
        for (name, kappa) in [
            ("centering_kappa", self.centering_kappa),
            ("approaching_kappa", self.approaching_kappa),
        ] {
            if !kappa.is_finite() || kappa < 0.0 {
                return Err(AgentError::Config(format!(
                    "{name} is {kappa}; it must be finite and at least 0"
                )));
            }
        }
        if self.looks == 0 {
            return Err(AgentError::Config(
                "looks is 0; the agent must look at least once".into(),
            ));
        }
        Ok(())
    }
}
