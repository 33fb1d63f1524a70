//! The controller of the paper: circles into joint moves. *The paper* is C. Distante, A. Anglani
//! and F. Taurisano, "Target Reaching by Using Visual Information and Q-learning Controllers",
//! Autonomous Robots 9 (2000), 41-50.
//!
//! A ball of known size lies somewhere in reach of a PUMA 560 with a camera on its hand. Two
//! behaviours, learned separately by Q-learning, bring the hand to it: *centering* turns the first
//! joint by the ball's x and radius in the image, *approaching* turns the second and third by y,
//! radius and the elbow angle. Around them stand a search from fixed poses, a recovery of a lost
//! ball, the activation of the gripper with a check of the grip, and a supervision that stops the
//! arm when something comes too near.
//!
//! * A [`BehaviourSpec`] is a behaviour as data: intervals, angle steps, goal and [`Reward`].
//!   [`BehaviourSpec::learn`] learns its table in any simulator; a [`Behaviour`] is both together.
//!   [`BehaviourTask`] is the environment for learners of your own. A [`BehaviourPair`] holds the
//!   specifications of centering and approaching.
//! * A [`Controller`] decides on joint moves: [`Learned`] (the paper's two behaviours), [`Servo`]
//!   (the alternatives that the paper names), [`Hybrid`] (a servo that calibrates its own
//!   [`CameraModel`]), or one of your own. A [`TaughtGoal`] is a goal that was shown on the arm.
//! * An [`Agent`] runs a controller and the modules around it on an [`Eye`] (a camera and a
//!   [`Target`]) and a [`Manipulator`](puma_val2::Manipulator). It reports every [`RunEvent`]; an
//!   [`EventLog`] keeps them, and a [`SavedRun`] can be replayed from its text alone.
//! * A [`HandEye`] calibrates camera, lens, ball and joint zeros by looks at a resting ball. Its
//!   [`Calibration`] gives each quantity with a standard error.
//!
//! # The state machine
//!
//! | module of section 2.2 | here | result | moves the arm itself |
//! |---|---|---|---|
//! | rotation, reaching | [`Controller`] | next joint move | no |
//! | target search | [`Search`] | next pose to look from | no |
//! | recovery of a lost target | [`Search`] | next pose to look from | no |
//! | gripper activation | inside the agent | ball in the jaws or not | yes |
//! | constant control of the approach | [`Supervision`] | move accepted or not | no |
//!
//! The modules do not know each other. An [`Agent`] is in one phase at a time, and every transition
//! is a [`RunEvent`], named at the arrows:
//!
//! ```text
//!              Reaching             AtGoal, Cornered            Grasped
//!   +--------+ --------> +-------+ -----------------> +------+ ---------> +-----+
//!   | Search |           | Reach |                    | Grip |            | End |
//!   +--------+           +-------+ <----------------- +------+            +-----+
//!     ^    ^              |     ^      Reaching        |    |
//!     |    |         Lost |     | Reaching             |    |
//!     |    |              v     |                      |    |
//!     |    | Searching  +---------+     Lost, Missed   |    |
//!     |    +----------- | Recover | <------------------+    |
//!     |                 +---------+                         |
//!     +-----------------------------------------------------+
//!                           Searching
//!
//!   It begins with Started and Searching. Every phase can lead to End: GaveUp, or Failed.
//! ```
//!
//! Within a phase the events are the orders that were carried out ([`EventKind::AtSearchPose`],
//! [`EventKind::Moved`], ...), the results of looking at a frame ([`EventKind::Seen`],
//! [`EventKind::NotSeen`], [`EventKind::SameFrame`]) and the interventions of supervision
//! ([`EventKind::TooNear`], [`EventKind::TooFast`], [`EventKind::TakenBack`]).
//!
//! The crate contains no simulator, renderer, detector, arm or camera: they come in through the
//! traits of `hough-heuristic` and `puma-val2`, and through closures.

mod behaviour;
mod calibration;
mod checked;
mod controller;
mod controllers;
mod error;
mod limits;
mod percept;
mod record;
mod run;
mod sight;

pub use hough_heuristic;
pub use nalgebra;
pub use puma_val2;
pub use qtable;

pub use behaviour::learning::{LearningSettings, Lesson};
pub use behaviour::policy::Behaviour;
pub use behaviour::preset::BehaviourPair;
pub use behaviour::reward::{Reward, RewardTerm};
pub use behaviour::space::StateSpace;
pub use behaviour::spec::{BehaviourSpec, GoalInterval, JointSteps};
pub use behaviour::task::BehaviourTask;
pub use calibration::hand_eye::{Calibration, Estimate, HandEye};
pub use controller::SavedController;
pub use controller::{Controller, Decision, Feedback, GaveUp, Request};
pub use controllers::hybrid::belief::{Belief, Prior};
pub use controllers::hybrid::controller::Hybrid;
pub use controllers::hybrid::misfit::Misfit;
pub use controllers::hybrid::settings::HybridSettings;
pub use controllers::learned::{Learned, OnlineLearning};
pub use controllers::servo::controller::{Servo, ServoLaw};
pub use controllers::servo::settings::ServoSettings;
pub use controllers::taught_goal::TaughtGoal;
pub use error::{AgentError, BehaviourError};
pub use limits::JointLimits;
pub use percept::{Input, Percept, Sighting};
pub use record::log::EventLog;
pub use record::saved_run::SavedRun;
pub use run::agent::Agent;
pub use run::config::AgentConfig;
pub use run::event::{EventKind, RunEvent, RunOutcome};
pub use run::search::Search;
pub use run::supervision::Supervision;
pub use sight::camera_model::CameraModel;
pub use sight::eye::{CameraEye, Eye};
pub use sight::target::{EggTarget, Target};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
