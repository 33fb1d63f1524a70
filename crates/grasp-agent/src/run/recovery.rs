//! Recovery: where to look for a ball that was in view a moment ago.

use puma_val2::{JointDelta, Joints};

use crate::controller::Situation;
use crate::run::search::{LastLook, Viewpoint};

/// The paper's recovery of a lost target (section 2.2): says from where to look next, until the
/// ball is in view again.
///
/// It moves nothing itself. [`Agent::recovering_by`](crate::Agent::recovering_by) puts another one
/// in the place of [`RecoveryMoves`].
///
/// ```
/// use grasp_agent::puma_val2::Joints;
/// use grasp_agent::{Agent, AgentConfig, LastLook, PositionBased, Recovery, ServoSettings, Situation, Viewpoint};
///
/// /// Does nothing: a ball that is lost is searched for at once.
/// #[derive(Clone, Debug)]
/// struct SearchAtOnce;
///
/// impl Recovery for SearchAtOnce {
///     fn next_view(&mut self, _seen: &Situation, _at: &Joints, _last: LastLook) -> Option<Viewpoint> {
///         None
///     }
///
///     fn boxed(&self) -> Box<dyn Recovery> {
///         Box::new(self.clone())
///     }
/// }
///
/// let config = AgentConfig::paper([Joints::from_degrees([0.0, -110.0, 210.0, 0.0, 45.0, 0.0])]);
/// let agent = Agent::with_controller(config, PositionBased::new(ServoSettings::paper()))?.recovering_by(SearchAtOnce);
/// # let _ = agent;
/// # Ok::<(), grasp_agent::AgentError>(())
/// ```
pub trait Recovery: std::fmt::Debug + Send + Sync {
    /// Where to look from next for a ball that was last `seen` so, with the arm at `at`, after what
    /// came of the last viewpoint; [`LastLook::None`] begins a new recovery. `None` to leave it to
    /// the search. Each viewpoint costs a cycle of
    /// [`AgentConfig::max_cycles`](crate::AgentConfig::max_cycles); it is not asked when none is
    /// left.
    fn next_view(&mut self, seen: &Situation, at: &Joints, last: LastLook) -> Option<Viewpoint>;

    /// A copy, for the copies of an agent: `Box::new(self.clone())`.
    fn boxed(&self) -> Box<dyn Recovery>;
}

impl Clone for Box<dyn Recovery> {
    fn clone(&self) -> Self {
        (**self).boxed()
    }
}

/// The paper's recovery: back to the pose of the last sighting (viewpoint 0), then fixed moves from
/// there.
#[derive(Clone, Debug)]
pub struct RecoveryMoves {
    moves: Vec<JointDelta>,
    tried: usize,
}

impl RecoveryMoves {
    /// A recovery by `moves`, all relative to the pose of the last sighting.
    pub fn new(moves: impl Into<Vec<JointDelta>>) -> Self {
        Self {
            moves: moves.into(),
            tried: 0,
        }
    }
}

impl Recovery for RecoveryMoves {
    fn next_view(&mut self, seen: &Situation, _at: &Joints, last: LastLook) -> Option<Viewpoint> {
        self.tried = if last == LastLook::None {
            0
        } else {
            self.tried + 1
        };
        let pose = match self.tried {
            0 => seen.joints,
            tried => seen.joints + *self.moves.get(tried - 1)?,
        };
        Some(Viewpoint {
            number: self.tried,
            pose,
        })
    }

    fn boxed(&self) -> Box<dyn Recovery> {
        Box::new(self.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hough_heuristic::Features;

    #[test]
    fn back_to_the_last_sighting_and_then_the_moves_from_there() {
        let turn = |degrees: f64| JointDelta::from_degrees([degrees, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let mut recovery = RecoveryMoves::new([turn(15.0), turn(-15.0)]);
        let features = Features {
            x: 96.0,
            y: 72.0,
            r: 20.0,
        };
        let joints = Joints::from_degrees([30.0, -100.0, 200.0, 0.0, 45.0, 0.0]);
        let seen = Situation {
            features,
            joints,
            long_axis: None,
        };
        for _ in 0..2 {
            // Wherever the arm has got to.
            let mut next = |last| recovery.next_view(&seen, &Joints::default(), last);
            let poses = [LastLook::None, LastLook::Nothing, LastLook::Barred]
                .map(|last| next(last).unwrap());
            assert_eq!(poses.map(|view| view.number), [0, 1, 2]);
            let expected = [joints, joints + turn(15.0), joints + turn(-15.0)];
            assert_eq!(poses.map(|view| view.pose), expected);
            assert_eq!(next(LastLook::Nothing), None);
        }
    }
}
