//! The door of everything that decides how the arm moves while the ball is in view.

use hough_heuristic::Features;
use puma_val2::{JointDelta, Joints};

use crate::limits::JointLimits;
use crate::percept::Percept;

/// What a [`Controller`] decides by: the ball in the image, and the pose it is seen from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Situation {
    /// Centre and radius of the ball's outline, feature units (192x144).
    pub features: Features,
    /// The joint angles that the arm reports.
    pub joints: Joints,
    /// [`Sighting::long_axis`](crate::Sighting::long_axis) of what is seen.
    pub long_axis: Option<f64>,
}

impl Situation {
    /// Whether every number of it is one.
    pub(crate) fn is_finite(&self) -> bool {
        let Features { x, y, r } = self.features;
        [x, y, r]
            .iter()
            .chain(&self.joints.0)
            .all(|v| v.is_finite())
    }

    /// The part of it that the paper's behaviours look at.
    pub fn percept(&self) -> Percept {
        Percept::new(self.features, &self.joints)
    }
}

/// What came of a move that a [`Controller`] decided on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Consequence {
    /// The ball is in view, here.
    Seen(Situation),
    /// The ball has left the view.
    Lost,
    /// Supervision has taken the arm back to where it was: something was too near, or the approach
    /// too fast.
    TakenBack,
    /// It was not a move decided on: the gripper went for the ball, and was stopped or missed it.
    /// The ball may lie elsewhere now.
    Missed,
}

/// Decides, from one sighting of the ball to the next, how the arm moves.
///
/// [`Agent`](crate::Agent) calls [`decide`](Controller::decide) whenever the ball is in view and
/// not yet at the goal; searching, recovering a lost ball, gripping and supervision are the
/// agent's. The other methods tell what happens in between and may be left out.
pub trait Controller {
    /// What it is called, in tables and logs.
    fn name(&self) -> &str;

    /// How the arm should move now. The move must stay within `limits`, and it may be none.
    ///
    /// # Errors
    /// The reason for giving up, [`GaveUp::NoMoveLeft`] in particular.
    fn decide(&mut self, now: &Situation, limits: &JointLimits) -> Result<JointDelta, GaveUp>;

    /// What came of the move decided on last.
    fn judge(&mut self, consequence: &Consequence) {
        let _ = consequence;
    }

    /// The arm stands at `joints`: at the beginning of a run, and after each move, whoever ordered
    /// it.
    fn arm_at(&mut self, joints: &Joints) {
        let _ = joints;
    }

    /// The move that brings the gripper to the ball, seen at the goal; `None` to leave it to the
    /// agent's settings.
    fn grip(&mut self, now: &Situation, limits: &JointLimits) -> Option<JointDelta> {
        let _ = (now, limits);
        None
    }

    /// A run begins: whatever was remembered of the last one's ball is void.
    fn begin(&mut self) {}

    /// The run is over.
    fn end(&mut self) {}
}

impl<C: Controller + ?Sized> Controller for Box<C> {
    fn name(&self) -> &str {
        (**self).name()
    }

    fn decide(&mut self, now: &Situation, limits: &JointLimits) -> Result<JointDelta, GaveUp> {
        (**self).decide(now, limits)
    }

    fn judge(&mut self, consequence: &Consequence) {
        (**self).judge(consequence);
    }

    fn arm_at(&mut self, joints: &Joints) {
        (**self).arm_at(joints);
    }

    fn grip(&mut self, now: &Situation, limits: &JointLimits) -> Option<JointDelta> {
        (**self).grip(now, limits)
    }

    fn begin(&mut self) {
        (**self).begin();
    }

    fn end(&mut self) {
        (**self).end();
    }
}

/// Why a run ended without a grip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum GaveUp {
    /// The ball is in view from none of the search poses, or of the first
    /// [`AgentConfig::max_views`](crate::AgentConfig::max_views) of them.
    NotFound,
    /// The goal was not reached within the allowed number of moves.
    OutOfCycles,
    /// Every move that the controller could make leads out of the working limits, or the grip at
    /// the goal does, or the lift after it.
    NoMoveLeft,
    /// Something was too near to the hand on its last way to the ball, again and again, or when
    /// what it had gripped was lifted; or on the way to every viewpoint of a search, so that there
    /// was no look at all.
    Obstructed,
}

impl std::fmt::Display for GaveUp {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::NotFound => "the ball is in view from no search pose",
            Self::OutOfCycles => "the goal was not reached within the allowed number of moves",
            Self::NoMoveLeft => "every move leads out of the working limits",
            Self::Obstructed => "something was too near to the hand: on its way to every search pose, or as it went for the ball or lifted it",
        })
    }
}
