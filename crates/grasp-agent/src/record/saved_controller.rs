//! Controllers of this crate, made again from their data.

use crate::controller::{Controller, SavedController};
use crate::controllers::hybrid::belief::Belief;
use crate::controllers::hybrid::controller::Hybrid;
use crate::controllers::hybrid::evidence::Evidence;
use crate::controllers::hybrid::misfit::Misfit;
use crate::controllers::hybrid::settings::HybridSettings;
use crate::controllers::learned::{Learned, OnlineLearning};
use crate::controllers::servo::controller::{Servo, ServoLaw};
use crate::controllers::servo::settings::ServoSettings;
use crate::controllers::taught_goal::TaughtGoal;
use crate::error::BehaviourError;

/// Data of a learned controller: behaviours, learning at work with its draws, and a taught goal.
type LearnedData = (Learned, Option<(OnlineLearning, u64)>, Option<TaughtGoal>);
/// Data of a hybrid: settings, belief, marks, the run before and the number of runs that fitted.
type HybridData = (
    HybridSettings,
    Belief,
    [bool; 2],
    (Evidence, usize, Vec<Misfit>),
);

impl SavedController {
    /// Makes the controller again; a hybrid comes back frozen, as it decides within a run by what
    /// it believed before.
    ///
    /// # Errors
    /// [`BehaviourError::Settings`] for settings that cannot work, [`BehaviourError::Text`] for a
    /// kind that is not one of this crate's controllers.
    pub fn controller(&self) -> Result<Box<dyn Controller>, BehaviourError> {
        match self.kind() {
            "learned" => {
                let (mut learned, learning, goal): LearnedData = self.data()?;
                if let Some((settings, draws)) = learning {
                    learned = learned.resumed(settings, draws)?;
                }
                if let Some(goal) = goal {
                    goal.check()?;
                    learned = learned.shown(&goal);
                }
                Ok(Box::new(learned))
            }
            "servo" => {
                let (law, settings): (ServoLaw, ServoSettings) = self.data()?;
                settings.check()?;
                Ok(Box::new(Servo::new(law, settings)))
            }
            "hybrid" => {
                let (settings, belief, marks, before): HybridData = self.data()?;
                settings.check()?;
                belief.check()?;
                before.0.check()?;
                Ok(Box::new(Hybrid::restored(settings, belief, marks, before)))
            }
            kind => Err(BehaviourError::Text {
                what: format!("{kind:?} is not a kind of controller of this crate"),
            }),
        }
    }
}
