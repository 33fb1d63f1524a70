//! The controller of the paper: circles into joint moves.
//!
//! A ball of known size lies somewhere in reach of a PUMA 560 with a camera on its hand. Two
//! behaviours, learned separately by Q-learning, bring the hand to it: **centering** turns the
//! first joint by what it sees of the ball's x and radius, **approaching** turns the second and
//! third by y, radius and the elbow angle. Around them stand a search from fixed poses, a recovery
//! for when the ball leaves the image, the activation of the gripper, a look at whether it holds
//! the ball, and a stop when something comes too near.
//!
//! * A [`BehaviourSpec`] is a behaviour as data: intervals, angle steps, goal and [`Reward`]. A
//!   [`BehaviourPair`] is both together: [`paper_literal`](BehaviourPair::paper_literal),
//!   [`paper_mended`](BehaviourPair::paper_mended), [`fine`](BehaviourPair::fine).
//! * A [`BehaviourTask`] turns a specification and any simulator into an environment in which
//!   [`qtable`] learns it.
//! * A [`Behaviour`] is a specification with its learned table; it can be saved, loaded and asked
//!   what to do.
//! * An [`Agent`] links the modules of section 2.2, each of which can be replaced or used alone,
//!   and runs them on an [`Eye`] ([`CameraEye`]: camera, and an object described by
//!   [`ObjectFeatures`]) and a [`Manipulator`](puma_val2::Manipulator). It tells every [`Event`] as
//!   it happens; an [`EventLog`] keeps them, and a `SavedRun` what else it takes to make the run
//!   again.
//! * [`Learned`], the two behaviours side by side, is the paper's controller. Beside it stand those
//!   that the paper names as alternatives, [`PositionBased`], [`ImageBased`], [`Fuzzy`] and
//!   [`LookAhead`], which believe in a [`CameraModel`], and the [`Hybrid`], which begins with such
//!   a model and learns what is wrong with it. [`Retargeted`] gives one of them a goal that was
//!   shown on the arm, [`GripAcross`] a grip that turns the hand by how the object lies.
//!
//! # The state machine
//!
//! | module of section 2.2 | here | says | moves the arm itself |
//! |---|---|---|---|
//! | rotation, reaching | [`Controller`] ([`Learned`]: two [`Behaviour`]s) | the next joint move, from what is seen | no |
//! | target search | [`Search`] ([`PoseSearch`]) | the next pose to look from | no |
//! | recovery of a lost target | [`Recovery`] ([`RecoveryMoves`]) | the next pose to look from | no |
//! | gripper activation | [`GripperActivation`] | whether the jaws hold the ball | through a [`Hand`] |
//! | constant control of the approach | [`Supervision`] ([`Guard`]) | whether what came of a move may go on | no |
//!
//! They know nothing of each other. An [`Agent`] is in one [`Phase`] at a time, and every
//! transition is an [`Event`], named at the arrows:
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
//! [`EventKind::Moved`], ...), what was looked at ([`EventKind::Seen`], [`EventKind::NotSeen`],
//! [`EventKind::SameFrame`]) and what supervision did ([`EventKind::TooNear`],
//! [`EventKind::TooFast`], [`EventKind::TakenBack`]).
//!
//! The crate knows no simulator, no renderer and no particular detector, arm or camera: they meet
//! it through the traits of `hough-heuristic` and `puma-val2` and through plain closures.
//!
//! # Learning a behaviour
//!
//! The simulator of this example is one line: a degree of the first joint moves the ball by four
//! units.
//!
//! ```
//! use grasp_agent::{BehaviourSpec, Percept, learn, schedule};
//! use hough_heuristic::Features;
//! use puma_val2::{Joint, JointDelta};
//! use qtable::rand::{Rng, RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};
//!
//! fn main() -> Result<(), Box<dyn std::error::Error>> {
//!     let simulate = |percept: &Percept, delta: &JointDelta| {
//!         let mut next = *percept;
//!         next.features.x += 4.0 * delta[Joint::J1].to_degrees();
//!         (0.0..192.0).contains(&next.features.x).then_some(next)
//!     };
//!     let start = |rng: &mut dyn Rng| Percept {
//!         features: Features { x: rng.random_range(0.0..192.0), y: 72.0, r: 33.0 },
//!         theta3: 0.0,
//!     };
//!     let spec = BehaviourSpec::centering();
//!     let settings = schedule(20_000)?;
//!     let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
//!     let lesson = learn(spec, simulate, start, &[], &settings, &mut rng, &mut |_| ())?;
//!     assert!(lesson.curve.last().is_some_and(|record| record.success_share > Some(0.9)));
//!     Ok(())
//! }
//! ```

mod behaviour;
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

pub use behaviour::learning::{LearnError, LearningSettings, Lesson, learn, schedule};
pub use behaviour::policy::{Behaviour, Episode};
pub use behaviour::preset::BehaviourPair;
pub use behaviour::reward::{Reward, RewardTerm};
pub use behaviour::spec::{BehaviourSpec, GoalInterval, JointSteps};
pub use behaviour::task::BehaviourTask;
#[cfg(feature = "serde")]
pub use controller::SavedController;
pub use controller::{Controller, Decision, Feedback, GaveUp, Request};
pub use controllers::hybrid::belief::{Belief, Prior};
pub use controllers::hybrid::controller::{Hybrid, HybridSettings};
pub use controllers::learned::{Learned, OnlineLearning};
pub use controllers::servo::controller::{Servo, ServoLaw};
pub use controllers::servo::settings::ServoSettings;
pub use controllers::taught_goal::{Retargeted, TaughtGoal};
pub use error::{AgentError, BehaviourError};
pub use limits::JointLimits;
pub use percept::{Input, Percept, Sighting};
pub use record::log::EventLog;
#[cfg(feature = "serde")]
pub use record::saved_run::{Replayed, SavedRun};
pub use run::agent::Agent;
pub use run::config::AgentConfig;
pub use run::event::{EventKind, Order, Phase, RunEvent, RunOutcome};
pub use run::search::{PoseSearch, RecoveryMoves, Search, Viewpoint};
pub use run::supervision::{Guard, Supervision, Verdict};
pub use sight::arm_plane::ArmPlane;
pub use sight::camera_model::CameraModel;
pub use sight::eye::{CameraEye, Eye};
pub use sight::target::{EggTarget, Target};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
