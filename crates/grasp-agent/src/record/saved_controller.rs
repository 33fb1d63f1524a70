//! A controller as data: what it takes to have it again.

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
use crate::error::BehaviourError;
use crate::limits::JointLimits;
use crate::record::export::bad;
use crate::record::export_policy::Policy;

/// The controller of a [`SavedRun`](crate::SavedRun), as it was before the run.
///
/// ```
/// use grasp_agent::{Controller, SavedController, ServoSettings};
///
/// let saved = SavedController::Fuzzy { settings: ServoSettings::paper().with_gain(0.7) };
/// assert_eq!(saved.controller().name(), "fuzzy");
/// ```
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum SavedController {
    /// The paper's.
    Learned {
        /// The two behaviours, with their loop breakers.
        learned: Box<Learned>,
        /// How learning went on in the run, from this seed on; `None` for behaviours that were
        /// frozen.
        learning: Option<OnlineLearning>,
    },
    /// The hybrid.
    Hybrid {
        /// Its settings.
        settings: Box<HybridSettings>,
        /// What it believed.
        belief: Belief,
    },
    /// [`PositionBased`].
    PositionBased {
        /// Its settings.
        settings: ServoSettings,
    },
    /// [`ImageBased`].
    ImageBased {
        /// Its settings.
        settings: ServoSettings,
        /// Where its Jacobian is taken.
        at: JacobianAt,
    },
    /// [`Fuzzy`].
    Fuzzy {
        /// Its settings.
        settings: ServoSettings,
    },
    /// [`LookAhead`].
    LookAhead {
        /// Its settings.
        settings: ServoSettings,
    },
    /// [`Retargeted`].
    Retargeted {
        /// The controller by itself.
        controller: Box<SavedController>,
        /// The goal that it was given.
        goal: TaughtGoal,
    },
    /// [`GripAcross`].
    GripAcross {
        /// The controller by itself.
        controller: Box<SavedController>,
        /// The grip of what it has no aim at.
        grip: JointDelta,
    },
}

impl SavedController {
    /// Two behaviours, frozen, or learning on from the seed of `learning`.
    pub fn of_learned(learned: &Learned, learning: Option<OnlineLearning>) -> Self {
        Self::Learned {
            learned: Box::new(learned.clone().frozen()),
            learning,
        }
    }

    /// A hybrid. Within a run it goes by what it believed before, whether it learns from that or
    /// not.
    pub fn of_hybrid(hybrid: &Hybrid) -> Self {
        Self::Hybrid {
            settings: Box::new(*hybrid.settings()),
            belief: hybrid.belief().clone(),
        }
    }

    /// The controller as it was; a hybrid frozen.
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
                // What was believed then is believed as firmly now.
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

/// The same as it is written.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) enum ControllerText {
    Learned {
        policy: Box<Policy>,
        learning: Option<OnlineLearning>,
    },
    Hybrid {
        settings: Box<HybridSettings>,
        belief: Belief,
    },
    PositionBased {
        settings: Box<ServoSettings>,
    },
    ImageBased {
        settings: Box<ServoSettings>,
        at: JacobianAt,
    },
    Fuzzy {
        settings: Box<ServoSettings>,
    },
    LookAhead {
        settings: Box<ServoSettings>,
    },
    Retargeted {
        controller: Box<ControllerText>,
        goal: TaughtGoal,
    },
    GripAcross {
        controller: Box<ControllerText>,
        grip: JointDelta,
    },
}

impl ControllerText {
    /// `limits` go with a policy.
    pub(crate) fn of(saved: &SavedController, limits: &JointLimits) -> Self {
        use SavedController as Saved;
        match saved.clone() {
            Saved::Learned { learned, learning } => Self::Learned {
                policy: Box::new(Policy::of(&learned, limits)),
                learning,
            },
            Saved::Hybrid { settings, belief } => Self::Hybrid { settings, belief },
            Saved::PositionBased { settings } => Self::PositionBased {
                settings: Box::new(settings),
            },
            Saved::ImageBased { settings, at } => Self::ImageBased {
                settings: Box::new(settings),
                at,
            },
            Saved::Fuzzy { settings } => Self::Fuzzy {
                settings: Box::new(settings),
            },
            Saved::LookAhead { settings } => Self::LookAhead {
                settings: Box::new(settings),
            },
            Saved::Retargeted { controller, goal } => Self::Retargeted {
                controller: Box::new(Self::of(&controller, limits)),
                goal,
            },
            Saved::GripAcross { controller, grip } => Self::GripAcross {
                controller: Box::new(Self::of(&controller, limits)),
                grip,
            },
        }
    }

    pub(crate) fn into_controller(self) -> Result<SavedController, BehaviourError> {
        use SavedController as Saved;
        Ok(match self {
            Self::Learned { policy, learning } => Saved::Learned {
                learned: Box::new(policy.into_learned()?.0),
                learning,
            },
            Self::Hybrid { settings, belief } => Saved::Hybrid { settings, belief },
            Self::PositionBased { settings } => Saved::PositionBased {
                settings: *settings,
            },
            Self::ImageBased { settings, at } => Saved::ImageBased {
                settings: *settings,
                at,
            },
            Self::Fuzzy { settings } => Saved::Fuzzy {
                settings: *settings,
            },
            Self::LookAhead { settings } => Saved::LookAhead {
                settings: *settings,
            },
            Self::Retargeted { controller, goal } => Saved::Retargeted {
                controller: Box::new(controller.into_controller()?),
                goal,
            },
            Self::GripAcross { controller, grip } => {
                if !grip.0.iter().all(|turn| turn.is_finite()) {
                    return Err(bad("the grip of its controller is not finite"));
                }
                Saved::GripAcross {
                    controller: Box::new(controller.into_controller()?),
                    grip,
                }
            }
        })
    }
}
