//! The trait of everything that decides how the arm moves while the ball is in view.

use puma_val2::{JointDelta, Joints};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::controllers::hybrid::misfit::Misfit;
use crate::error::BehaviourError;
use crate::limits::JointLimits;
use crate::percept::Sighting;

/// Question of an agent to its controller, beside the ball that is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Request {
    /// Joint angles that the arm reports.
    pub joints: Joints,
    /// Working limits that every move must stay within.
    pub limits: JointLimits,
    /// `false`: asks for a move toward the goal. `true`: asks for the move that brings the gripper
    /// to the ball.
    pub grip: bool,
}

/// Answer of a controller to a [`Request`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Decision {
    /// Move the arm by this, which may be nothing.
    Move(JointDelta),
    /// Bring the gripper to the ball by this move.
    Grip(JointDelta),
}

/// Things that a controller is told between two decisions, in the order in which they happen.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Feedback {
    /// A run begins. Knowledge of the place of the previous run's ball is void.
    Begin,
    /// The arm reports these joint angles: at the beginning of a run, and after each move, whoever
    /// ordered it.
    Arm(Joints),
    /// The move decided on last was made, and the ball is in view from the pose `joints`.
    Seen {
        /// The ball.
        ball: Sighting,
        /// Joint angles that the arm reports.
        joints: Joints,
    },
    /// The move decided on last was made, and the ball has left the view.
    Lost,
    /// Supervision has taken the move decided on last back: something was too near, or the approach
    /// too fast.
    TakenBack,
    /// The jaws closed at this pose, and the check of the grip has found the ball in them.
    Held(Joints),
    /// The gripper was stopped on its way to the ball, or missed it. The ball may have moved.
    Missed,
    /// The run is over.
    End,
}

/// Decides how the arm moves while the ball is in view.
///
/// [`Agent`](crate::Agent) calls [`decide`](Controller::decide) whenever the ball is in view; it
/// searches, recovers a lost ball, grips and supervises by itself.
///
/// ```
/// use grasp_agent::puma_val2::{Joint, JointDelta};
/// use grasp_agent::{Controller, Decision, GaveUp, Request, Sighting};
///
/// /// Turns the first joint until the ball is in the middle of the image.
/// struct Turn;
///
/// impl Controller for Turn {
///     fn decide(&mut self, ball: &Sighting, request: &Request) -> Result<Decision, GaveUp> {
///         let turn = JointDelta::of(Joint::J1, 0.001 * (96.0 - ball.features.x));
///         if request.limits.admit(&(request.joints + turn)) {
///             Ok(Decision::Move(turn))
///         } else {
///             Err(GaveUp::NoMoveLeft)
///         }
///     }
///
///     fn describe(&self) -> &str {
///         "turn"
///     }
/// }
/// ```
pub trait Controller {
    /// Decides what to do about the `ball` that is seen.
    ///
    /// Asked for a grip ([`Request::grip`]), a controller without an aim of its own returns an
    /// error or any [`Decision::Move`]: the agent then uses
    /// [`AgentConfig::grip`](crate::AgentConfig::grip), or reaches on. Asked for a move, it may
    /// answer [`Decision::Grip`]; the agent then looks once more and asks for the grip.
    ///
    /// # Errors
    /// The reason to give up, [`GaveUp::NoMoveLeft`] in particular.
    fn decide(&mut self, ball: &Sighting, request: &Request) -> Result<Decision, GaveUp>;

    /// Takes note of what happened since the last decision.
    fn notice(&mut self, feedback: &Feedback) {
        let _ = feedback;
    }

    /// Returns the controller's name, for tables and logs.
    fn describe(&self) -> &str;

    /// Returns the cause if the controller's model does not fit what was seen in this run; `None`
    /// for controllers without a model.
    fn misfit(&self) -> Option<Misfit> {
        None
    }

    /// Returns the controller as data, from which a [`SavedRun`](crate::SavedRun) makes it again;
    /// `None` for controllers that cannot be saved.
    fn save(&self) -> Option<SavedController> {
        None
    }
}

impl<C: Controller + ?Sized> Controller for Box<C> {
    fn decide(&mut self, ball: &Sighting, request: &Request) -> Result<Decision, GaveUp> {
        (**self).decide(ball, request)
    }

    fn notice(&mut self, feedback: &Feedback) {
        (**self).notice(feedback);
    }

    fn describe(&self) -> &str {
        (**self).describe()
    }

    fn misfit(&self) -> Option<Misfit> {
        (**self).misfit()
    }

    fn save(&self) -> Option<SavedController> {
        (**self).save()
    }
}

/// Reason why a run ended without a grip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[non_exhaustive]
pub enum GaveUp {
    /// The ball is in view from none of the search poses, or of the first
    /// [`AgentConfig::max_views`](crate::AgentConfig::max_views) of them.
    NotFound,
    /// The goal was not reached within
    /// [`AgentConfig::max_cycles`](crate::AgentConfig::max_cycles) moves, for none of the reasons
    /// below.
    OutOfCycles,
    /// The moves ran out, and the ball left the view again and again.
    KeptLosing,
    /// The moves ran out, and the jaws closed beside the ball again and again.
    KeptMissing,
    /// The moves ran out, and two looks from one pose differed again and again.
    Unsteady,
    /// The moves ran out, and the ball had long kept its place in the image, away from the goal.
    NoProgress,
    /// Every move that the controller could make leads out of the working limits, or the grip or
    /// the lift does.
    NoMoveLeft,
    /// Something was too near to the hand: on three ways to the ball, when the closed hand was
    /// lifted, or on the way to every viewpoint of a search.
    Obstructed,
    /// Three moves or more toward the goal ended too near to something before the ball showed
    /// there, and from no pose could the jaws reach it: the hand itself may stand where the ball
    /// shows at the goal. Show the goal on the arm
    /// ([`Hybrid::shown`](crate::Hybrid::shown)), or mount the camera elsewhere.
    GoalBarred,
    /// The goal was not reached, or the ball not found or gripped, and the controller's model does
    /// not fit what was seen.
    Misfit(Misfit),
}

impl std::fmt::Display for GaveUp {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::NotFound => "the ball is in view from no search pose",
            Self::OutOfCycles => "the goal was not reached within the allowed number of moves",
            Self::KeptLosing => "the ball left the view again and again until the moves ran out",
            Self::KeptMissing => "the jaws closed beside the ball until the moves ran out",
            Self::Unsteady => "looks from one pose differed until the moves ran out",
            Self::NoProgress => "the ball came no nearer to the goal until the moves ran out",
            Self::NoMoveLeft => "every move leads out of the working limits",
            Self::Obstructed => {
                "something was too near to the hand on the way to every search pose, to the ball, \
                 or when the hand was lifted"
            }
            Self::GoalBarred => {
                "the hand came too near to something, perhaps the ball itself, before the ball \
                 showed at the goal: show the goal on the arm"
            }
            Self::Misfit(cause) => return write!(f, "the model does not fit: {cause}"),
        })
    }
}

/// A controller as data: its kind, and the settings and knowledge of that kind.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SavedController {
    kind: String,
    data: serde_json::Value,
}

impl SavedController {
    /// Creates the data of a controller of this `kind`; `None` for data that JSON cannot hold, such
    /// as maps whose keys are no text.
    pub fn new(kind: &str, data: impl Serialize) -> Option<Self> {
        Some(Self {
            kind: kind.into(),
            data: serde_json::to_value(data).ok()?,
        })
    }

    /// Returns the kind.
    pub fn kind(&self) -> &str {
        &self.kind
    }

    /// Reads the data.
    ///
    /// # Errors
    /// [`BehaviourError::Text`] for data of another type, or that the type refuses.
    pub fn data<T: DeserializeOwned>(&self) -> Result<T, BehaviourError> {
        T::deserialize(&self.data).map_err(|error| BehaviourError::Text {
            what: format!("controller of kind {:?}: {error}", self.kind),
        })
    }
}
