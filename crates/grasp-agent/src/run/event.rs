//! Events of a run, in the order in which they happen, and its outcome.

use hough_heuristic::image::GrayImage;
use puma_val2::{JointDelta, Joints};
use serde::{Deserialize, Serialize};

use crate::controller::GaveUp;
use crate::controllers::hybrid::misfit::Misfit;
use crate::percept::Sighting;

/// One event of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunEvent<'a> {
    /// Moves made since the ball was first seen.
    pub cycle: usize,
    /// Kind of the event, with its data.
    pub kind: EventKind,
    /// Joint angles that the arm reports.
    #[serde(with = "null_for_nan")]
    pub joints: Joints,
    /// Frame of a look, for [`EventKind::Seen`] and [`EventKind::NotSeen`]; logs do not keep it.
    #[serde(skip)]
    pub frame: Option<&'a GrayImage>,
}

/// Joint angles in JSON, which has no NaN: an angle that is not finite becomes `null`.
mod null_for_nan {
    use puma_val2::Joints;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(super) fn serialize<S: Serializer>(joints: &Joints, to: S) -> Result<S::Ok, S::Error> {
        let angles = joints.0.map(|angle| angle.is_finite().then_some(angle));
        angles.serialize(to)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Joints, D::Error> {
        let angles = <[Option<f64>; 6]>::deserialize(from)?;
        Ok(Joints(angles.map(|angle| angle.unwrap_or(f64::NAN))))
    }
}

impl RunEvent<'_> {
    /// Returns the event without its frame, for logs.
    pub(crate) fn logged(&self) -> RunEvent<'static> {
        RunEvent {
            cycle: self.cycle,
            kind: self.kind.clone(),
            joints: self.joints,
            frame: None,
        }
    }
}

/// Kinds of events.
///
/// Every order to the arm, every answer of arm, sensor and camera and every transition of the
/// [state machine](crate#the-state-machine) makes an event, so that the events determine the run
/// ([`EventLog::replay`](crate::EventLog::replay)). An order that was carried out makes the event
/// that says so, one that was answered by an error makes [`EventKind::Unanswered`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum EventKind {
    /// The run begins. The gripper is open.
    Started,
    /// A search of the workspace begins.
    Searching,
    /// The ball has come into view, and the controller begins to reach for it.
    Reaching,
    /// The arm stands at the search pose with this number, or is on its way there if
    /// [`EventKind::TooNear`] follows. The numbering continues when the poses are tried again with
    /// a displacement.
    AtSearchPose(usize),
    /// An image was dropped that may show an earlier pose ([`AgentConfig::lag_check`]).
    ///
    /// [`AgentConfig::lag_check`]: crate::AgentConfig::lag_check
    Dropped,
    /// An image is late by so many looks, as a small move has shown.
    Late(usize),
    /// The ball is in the frame.
    Seen(Sighting),
    /// No ball is in the frame.
    NotSeen,
    /// The arm has moved and the image has not changed, to the last pixel: the camera may have
    /// frozen.
    SameFrame,
    /// The arm has made this move of the controller, or a part of it if [`EventKind::TooNear`]
    /// follows.
    Moved(JointDelta),
    /// The ball has left the frame. Its recovery begins.
    Lost,
    /// The arm has gone back to the pose of the last sighting (0), or made the recovery move with
    /// this number, or a part of it if [`EventKind::TooNear`] follows.
    Recovering(usize),
    /// Something is too near to the hand. The arm has been stopped at the pose of the preceding
    /// event, or on its way there.
    TooNear,
    /// The ball came nearer too fast.
    TooFast,
    /// A joint has not made a small move: it has turned back, or has then gone all the way, to
    /// overcome its friction.
    Freed,
    /// The arm has gone back by one move, or by a part of it if [`EventKind::TooNear`] follows.
    TakenBack,
    /// The controller's model does not fit what was seen in this run, for this cause.
    Misfit(Misfit),
    /// Centre and radius of the ball are at the goal. The gripper activation begins.
    AtGoal,
    /// The gripper activation begins away from the goal: moves were taken back again and again, so
    /// that the thing too near may be the ball itself, or the controller asked for the grip.
    Cornered,
    /// The gripper was brought to the ball by this move, the last of two if the arm has to be moved
    /// first.
    Gripping(JointDelta),
    /// The gripper has closed.
    Gripped,
    /// The closed hand has gone back by one of the moves of the grip. After the last of them it is
    /// at the pose from which the ball was last seen.
    Withdrawn,
    /// The arm has lifted the closed hand.
    Lifted,
    /// The ball was not in the jaws, which have opened again. Its recovery begins.
    Missed,
    /// The run is over. The ball is grasped, verified by the camera only.
    Grasped,
    /// The run is over without a grip.
    GaveUp(GaveUp),
    /// The arm answered this order with an error; [`EventKind::Failed`] follows.
    Unanswered(String),
    /// The run is over. Arm or camera failed for this reason, and the arm was told to stop.
    Failed(String),
}

impl EventKind {
    /// Returns one word for tables and logs.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Started => "started",
            Self::Searching => "searching",
            Self::Reaching => "reaching",
            Self::AtSearchPose(_) => "search",
            Self::Dropped => "dropped",
            Self::Late(_) => "late",
            Self::Seen(_) => "seen",
            Self::NotSeen => "not-seen",
            Self::SameFrame => "same-frame",
            Self::Moved(_) => "moved",
            Self::Lost => "lost",
            Self::Recovering(_) => "recover",
            Self::TooNear => "too-near",
            Self::TooFast => "too-fast",
            Self::Freed => "freed",
            Self::TakenBack => "taken-back",
            Self::Misfit(_) => "misfit",
            Self::AtGoal => "at-goal",
            Self::Cornered => "cornered",
            Self::Gripping(_) => "gripping",
            Self::Gripped => "gripped",
            Self::Withdrawn => "withdrawn",
            Self::Lifted => "lifted",
            Self::Missed => "missed",
            Self::Grasped => "grasped",
            Self::Unanswered(_) => "unanswered",
            Self::GaveUp(_) => "gave-up",
            Self::Failed(_) => "failed",
        }
    }
}

/// Result of a run that was not broken off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunOutcome {
    /// Reason why nothing was gripped. `None` if the gripper has closed on the ball and the grip
    /// was verified; a grip without [`AgentConfig::lift`](crate::AgentConfig::lift) is not verified
    /// and counts too.
    pub gave_up: Option<GaveUp>,
    /// Number of moves after the first sighting, including those of a recovery and without those of
    /// a grip. Each grip that failed, or was not begun because two looks at the goal differed, adds
    /// one.
    pub cycles: usize,
    /// Number of times the ball was lost.
    pub losses: usize,
    /// Last sighting of the ball.
    pub last_seen: Option<Sighting>,
    /// Joint angles at the end.
    pub joints: Joints,
}
