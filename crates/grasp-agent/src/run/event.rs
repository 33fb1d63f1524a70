//! The events of a run, as they happen.

use hough_heuristic::image::GrayImage;
use puma_val2::{JointDelta, Joints};

use crate::controller::GaveUp;
use crate::percept::Sighting;

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

/// Where the state machine of a run stands; it is drawn on the [front
/// page](crate#the-state-machine).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Phase {
    /// Looking around in the workspace ([`Search`](crate::Search)).
    Search,
    /// The ball is in view, and the controller moves the hand to it
    /// ([`Controller`](crate::Controller)).
    Reach,
    /// Looking around where the ball was in view a moment ago ([`Recovery`](crate::Recovery)).
    Recover,
    /// The gripper goes for the ball ([`GripperActivation`](crate::GripperActivation)).
    Grip,
    /// The run is over.
    End,
}

/// What the arm is told to do.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Order {
    /// To turn its joints by this.
    MoveBy(JointDelta),
    /// To go to this pose.
    MoveTo(Joints),
    /// To close the jaws, or to open them.
    Jaws {
        /// Whether to close them.
        close: bool,
    },
    /// To stop.
    Stop,
}

/// What can happen in a run.
///
/// Every order to the arm, every answer of arm, sensor and camera and every transition of the state
/// machine ([`EventKind::enters`]) makes an event, in the order in which they happen, so that the
/// events determine the run: see [`EventLog::replay`](crate::EventLog::replay). An order that is
/// carried out makes the event that says so, one that ends in nothing but an error makes
/// [`EventKind::Unanswered`].
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum EventKind {
    /// The run begins with the arm here and the gripper open.
    Started,
    /// A search of the workspace begins.
    Searching,
    /// The ball has come into view, and the controller begins to reach for it.
    Reaching,
    /// The arm stands at the search pose with this index and is about to look, or is on its way
    /// there if [`EventKind::TooNear`] follows. Indices go on counting when the poses are tried
    /// again with a displacement.
    AtSearchPose(usize),
    /// The ball is in the frame.
    Seen(Sighting),
    /// No ball is in the frame.
    NotSeen,
    /// What was just looked at is the same, to the last pixel, as from the pose before: the camera
    /// may have stopped.
    SameFrame,
    /// The controller chose this move and the arm has made it, or a part of it if
    /// [`EventKind::TooNear`] follows.
    Moved(JointDelta),
    /// The ball has left the frame, and its recovery begins.
    Lost,
    /// The arm has gone back to the pose from which the ball was last seen (0), or made the
    /// recovery move with this number; or it is on its way there if [`EventKind::TooNear`] follows.
    Recovering(usize),
    /// Something is too near to the hand; the arm has been stopped, on its way to the pose of the
    /// event before or there.
    TooNear,
    /// The ball came nearer too fast.
    TooFast,
    /// The arm has gone back by one move, or, if [`EventKind::TooNear`] follows, a part of the way.
    TakenBack,
    /// Centre and radius are at the goal, and the activation of the gripper begins.
    AtGoal,
    /// Moves have been taken back again and again: what is too near may be the ball itself. The
    /// activation of the gripper begins from here, for a controller that can aim.
    Cornered,
    /// The gripper has been brought to the ball by this move, the last one of two where the arm has
    /// to be moved first.
    Gripping(JointDelta),
    /// The gripper has closed.
    Gripped,
    /// The hand, closed, has gone back by a move of the grip, the last one to where the ball was
    /// last seen from.
    Withdrawn,
    /// The arm has lifted what it gripped.
    Lifted,
    /// The ball was not in the jaws, which have opened again; its recovery begins.
    Missed,
    /// The run is over, with the ball in the jaws as far as can be told.
    Grasped,
    /// The run is over without a grip.
    GaveUp(GaveUp),
    /// This order was given, and the arm has failed to say what came of it; [`EventKind::Failed`]
    /// follows.
    Unanswered(Order),
    /// Arm or camera failed, for this reason; the arm has been told to stop. The run is over.
    Failed(String),
}

impl EventKind {
    /// One word for tables and logs.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Started => "started",
            Self::Searching => "searching",
            Self::Reaching => "reaching",
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

    /// The phase that begins with this event, if one does. Every transition of the state machine
    /// has exactly one such event.
    pub fn enters(&self) -> Option<Phase> {
        match self {
            Self::Searching => Some(Phase::Search),
            Self::Reaching => Some(Phase::Reach),
            Self::Lost | Self::Missed => Some(Phase::Recover),
            Self::AtGoal | Self::Cornered => Some(Phase::Grip),
            Self::Grasped | Self::GaveUp(_) | Self::Failed(_) => Some(Phase::End),
            _ => None,
        }
    }
}

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// `None` when the gripper has closed at the goal and, unless [`AgentConfig::lift`] is `None`,
    /// what was seen there has been lifted; otherwise why not. What is lifted is known from the
    /// camera alone, see there.
    pub gave_up: Option<GaveUp>,
    /// Moves after the first sighting, recovery moves included, the grip not; and one for each grip
    /// that failed, or was not begun because two looks at the goal differed.
    pub cycles: usize,
    /// How often the ball was lost.
    pub losses: usize,
    /// The ball as it was last seen.
    pub last_seen: Option<Sighting>,
    /// Where the arm stands.
    pub joints: Joints,
}
