//! Controllers of this crate, made again from their data.

use crate::controller::{Controller, SavedController};
use crate::controllers::hybrid::belief::Belief;
use crate::controllers::hybrid::controller::Hybrid;
use crate::controllers::hybrid::settings::HybridSettings;
use crate::controllers::learned::Learned;
use crate::controllers::servo::controller::Servo;
use crate::controllers::taught_goal::{Retargeted, TaughtGoal};
use crate::error::BehaviourError;

impl SavedController {
    /// Makes the controller again; a hybrid comes back frozen, as it decides within a run by what
    /// it believed before.
    ///
    /// # Errors
    /// [`BehaviourError::Text`] for settings that cannot work, and for a kind that is not one of
    /// this crate's controllers.
    pub fn controller(&self) -> Result<Box<dyn Controller>, BehaviourError> {
        Ok(match self.kind() {
            "learned" => {
                let (learned, learning): (Learned, Option<_>) = self.data()?;
                Box::new(match learning {
                    Some(learning) => learned.resumed(learning),
                    None => learned,
                })
            }
            "servo" => {
                let (law, settings) = self.data()?;
                Box::new(Servo::new(law, settings))
            }
            "hybrid" => {
                let (settings, belief): (HybridSettings, Belief) = self.data()?;
                // The belief is held as firmly as it was.
                let settings = HybridSettings {
                    drift: 0.0,
                    ..settings
                };
                Box::new(Hybrid::with_belief(settings, belief).frozen())
            }
            "retargeted" => {
                let (controller, goal): (Self, TaughtGoal) = self.data()?;
                Box::new(Retargeted::new(controller.controller()?, goal))
            }
            kind => {
                return Err(BehaviourError::Text {
                    what: format!("{kind:?} is not a kind of controller of this crate"),
                });
            }
        })
    }
}
