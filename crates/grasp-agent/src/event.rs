//! The events of a run, as they happen.

use hough_heuristic::image::GrayImage;
use puma_val2::{JointDelta, Joints};

use crate::Sighting;

/// One thing that happened.
#[derive(Clone, Debug)]
pub struct Event<'a> {
    /// How many moves have been made since the ball was first seen.
    pub cycle: usize,
    /// What happened.
    pub kind: EventKind,
    /// Where the arm stands, as it reports.
    pub joints: Joints,
    /// The frame, for events that come of one.
    pub frame: Option<&'a GrayImage>,
}

/// What can happen in a run.
///
/// Every answer of arm, sensor and camera makes an event, in the order of the answers, so that the events determine the
/// run: see [`EventLog::replay`](crate::EventLog::replay).
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum EventKind {
    /// The run begins with the arm here and the gripper open.
    Started,
    /// A search of the workspace begins.
    Searching,
    /// The arm stands at the search pose with this index, and is about to look. Indices go on counting when the poses are tried again
    /// with a displacement.
    AtSearchPose(usize),
    /// The ball is in the frame.
    Seen(Sighting),
    /// No ball is in the frame.
    NotSeen,
    /// What was just looked at is the same, to the last pixel, as from the pose before: the camera may have stopped.
    SameFrame,
    /// The controller chose this move and the arm has made it, or a part of it if [`EventKind::TooNear`] follows.
    Moved(JointDelta),
    /// The ball has left the frame during the last move.
    Lost,
    /// The arm has gone back to the pose from which the ball was last seen (0), or made the recovery move with this number.
    Recovering(usize),
    /// Something is too near to the hand; the arm has been stopped, on its way to the pose of the event before or there.
    TooNear,
    /// The ball came nearer too fast.
    TooFast,
    /// The arm has gone back by one move, or, if [`EventKind::TooNear`] follows, a part of the way.
    TakenBack,
    /// Centre and radius are at the goal.
    AtGoal,
    /// The gripper has been brought to the ball by this move, the last one of two where the arm has to be moved first.
    Gripping(JointDelta),
    /// The gripper has closed.
    Gripped,
    /// The hand, closed, has gone back by a move of the grip, the last one to where the ball was last seen from.
    Withdrawn,
    /// The arm has lifted what it gripped.
    Lifted,
    /// The ball was not in the jaws, which have opened again.
    Missed,
    /// The run is over without a grip.
    GaveUp(GaveUp),
    /// Arm or camera failed, for this reason; the arm has been told to stop.
    Failed(String),
}

impl EventKind {
    /// One word for tables and logs.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Started => "started",
            Self::Searching => "searching",
            Self::AtSearchPose(_) => "search",
            Self::Seen(_) => "seen",
            Self::NotSeen => "not-seen",
            Self::SameFrame => "same-frame",
            Self::Moved(_) => "moved",
            Self::Lost => "lost",
            Self::Recovering(_) => "recover",
            Self::TooNear => "too-near",
            Self::TooFast => "too-fast",
            Self::TakenBack => "taken-back",
            Self::AtGoal => "at-goal",
            Self::Gripping(_) => "gripping",
            Self::Gripped => "gripped",
            Self::Withdrawn => "withdrawn",
            Self::Lifted => "lifted",
            Self::Missed => "missed",
            Self::GaveUp(_) => "gave-up",
            Self::Failed(_) => "failed",
        }
    }
}

/// Why a run ended without a grip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum GaveUp {
    /// The ball is in view from none of the search poses.
    NotFound,
    /// The goal was not reached within the allowed number of moves.
    OutOfCycles,
    /// Every move that the controller could make leads out of the working limits, or the grip at the goal does, or the lift after it.
    NoMoveLeft,
    /// Something was too near to the hand on its last way to the ball, again and again, or when what it had gripped was lifted.
    Obstructed,
}

impl std::fmt::Display for GaveUp {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::NotFound => "the ball is in view from no search pose",
            Self::OutOfCycles => "the goal was not reached within the allowed number of moves",
            Self::NoMoveLeft => "every move leads out of the working limits",
            Self::Obstructed => "something was too near to the hand as it went for the ball or lifted it",
        })
    }
}
