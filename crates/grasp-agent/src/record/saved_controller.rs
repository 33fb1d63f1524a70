//! Controllers as data.

use puma_val2::JointDelta;
use serde::{Deserialize, Serialize};

use crate::controller::Controller;
use crate::controllers::grip_across::GripAcross;
use crate::controllers::hybrid::belief::Belief;
use crate::controllers::hybrid::controller::{Hybrid, HybridSettings};
use crate::controllers::learned::{Learned, OnlineLearning};
use crate::controllers::servo::fuzzy::Fuzzy;
use crate::controllers::servo::image_based::{ImageBased, JacobianAt};
use crate::controllers::servo::look_ahead::LookAhead;
use crate::controllers::servo::position_based::PositionBased;
use crate::controllers::servo::settings::ServoSettings;
use crate::controllers::taught_goal::{Retargeted, TaughtGoal};

/// Controller of a [`SavedRun`](crate::SavedRun), in its state before the run.
///
/// ```
/// use grasp_agent::{Controller, SavedController, ServoSettings};
///
/// let saved = SavedController::Fuzzy { settings: ServoSettings::paper().with_gain(0.7) };
/// assert_eq!(saved.controller().name(), "fuzzy");
/// ```
#[derive(Clone, Debug, Serialize, Deserialize)]
#[non_exhaustive]
pub enum SavedController {
    /// The paper's controller.
    Learned {
        /// Both behaviours and their repetition penalties.
        learned: Box<Learned>,
        /// Settings and seed of learning at work; `None` for frozen behaviours.
        learning: Option<OnlineLearning>,
    },
    /// The [`Hybrid`].
    Hybrid {
        /// Its settings.
        settings: Box<HybridSettings>,
        /// Its belief.
        belief: Belief,
    },
    /// A [`PositionBased`] servo.
    PositionBased {
        /// Its settings.
        settings: ServoSettings,
    },
    /// An [`ImageBased`] servo.
    ImageBased {
        /// Its settings.
        settings: ServoSettings,
        /// Place at which its Jacobian is taken.
        at: JacobianAt,
    },
    /// A [`Fuzzy`] controller.
    Fuzzy {
        /// Its settings.
        settings: ServoSettings,
    },
    /// A [`LookAhead`] controller.
    LookAhead {
        /// Its settings.
        settings: ServoSettings,
    },
    /// A [`Retargeted`] controller.
    Retargeted {
        /// The controller inside.
        controller: Box<SavedController>,
        /// Its goal.
        goal: TaughtGoal,
    },
    /// A [`GripAcross`] controller.
    GripAcross {
        /// The controller inside.
        controller: Box<SavedController>,
        /// Grip used where the controller inside does not aim.
        grip: JointDelta,
    },
}

impl SavedController {
    /// Saves two behaviours, frozen, or learning at work from the seed in `learning`.
    pub fn of_learned(learned: &Learned, learning: Option<OnlineLearning>) -> Self {
        Self::Learned {
            learned: Box::new(learned.clone().frozen()),
            learning,
        }
    }

    /// Saves a hybrid. Its belief changes after a run only, so a replay needs no learning.
    pub fn of_hybrid(hybrid: &Hybrid) -> Self {
        Self::Hybrid {
            settings: Box::new(*hybrid.settings()),
            belief: hybrid.belief().clone(),
        }
    }

    /// Builds the controller; a hybrid is frozen.
    pub fn controller(&self) -> Box<dyn Controller> {
        match self {
            Self::Learned { learned, learning } => {
                let learned = (**learned).clone();
                Box::new(match learning {
                    Some(settings) => learned.learning(*settings),
                    None => learned,
                })
            }
            Self::Hybrid { settings, belief } => {
                // A replay starts from the saved belief as it was, without added uncertainty.
                let settings = HybridSettings {
                    drift: 0.0,
                    ..**settings
                };
                Box::new(Hybrid::with_belief(settings, belief.clone()).frozen())
            }
            Self::PositionBased { settings } => Box::new(PositionBased::new(*settings)),
            Self::ImageBased { settings, at } => Box::new(ImageBased::new(*settings, *at)),
            Self::Fuzzy { settings } => Box::new(Fuzzy::new(*settings)),
            Self::LookAhead { settings } => Box::new(LookAhead::new(*settings)),
            Self::Retargeted { controller, goal } => {
                Box::new(Retargeted::new(controller.controller(), *goal))
            }
            Self::GripAcross { controller, grip } => {
                Box::new(GripAcross::new(controller.controller(), *grip))
            }
        }
    }
}
