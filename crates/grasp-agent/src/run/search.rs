//! Target search: where to look for a ball that is nowhere in view.

use puma_val2::{JointDelta, Joints};

/// A pose to look from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewpoint {
    /// Its number, for the event log.
    pub number: usize,
    /// The pose. What lies outside the working limits is replaced by the nearest pose that does
    /// not; what is not finite ends the run with
    /// [`AgentError::Viewpoint`](crate::AgentError::Viewpoint).
    pub pose: Joints,
}

/// What came of the viewpoint that was named last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LastLook {
    /// There was none: the looking around begins.
    None,
    /// The ball was not in view from there.
    Nothing,
    /// Something too near kept the hand from getting there; nothing was looked at.
    Barred,
}

/// The paper's target search module (section 2.2): says from where to look next, until the ball is
/// in view.
///
/// It moves nothing itself. [`Agent::searching_by`](crate::Agent::searching_by) puts another one in
/// the place of [`PoseSearch`].
///
/// ```
/// use grasp_agent::puma_val2::Joints;
/// use grasp_agent::{Agent, AgentConfig, LastLook, PositionBased, Search, ServoSettings, Viewpoint};
///
/// /// Turns round once, 30 degrees at a time.
/// #[derive(Clone, Debug, Default)]
/// struct Panorama {
///     seen: usize,
/// }
///
/// impl Search for Panorama {
///     fn next_view(&mut self, _at: &Joints, last: LastLook) -> Option<Viewpoint> {
///         self.seen = if last == LastLook::None { 0 } else { self.seen + 1 };
///         let pan = -150.0 + 30.0 * self.seen as f64;
///         let pose = Joints::from_degrees([pan, -110.0, 210.0, 0.0, 45.0, 0.0]);
///         (self.seen <= 10).then_some(Viewpoint { number: self.seen, pose })
///     }
///
///     fn boxed(&self) -> Box<dyn Search> {
///         Box::new(self.clone())
///     }
/// }
///
/// // Alone:
/// let mut panorama = Panorama::default();
/// let first = panorama.next_view(&Joints::default(), LastLook::None).unwrap();
/// assert!((first.pose.degrees()[0] + 150.0).abs() < 1e-9);
/// // In an agent:
/// let config = AgentConfig::paper([first.pose]);
/// let agent = Agent::with_controller(config, PositionBased::new(ServoSettings::paper()))?.searching_by(panorama);
/// # let _ = agent;
/// # Ok::<(), grasp_agent::AgentError>(())
/// ```
pub trait Search: std::fmt::Debug + Send + Sync {
    /// Where to look from next, with the arm at `at`, after what came of the last viewpoint;
    /// [`LastLook::None`] begins a new search. `None` when there is nowhere left to look from: the
    /// run ends with [`GaveUp::NotFound`](crate::GaveUp::NotFound), or with
    /// [`GaveUp::Obstructed`](crate::GaveUp::Obstructed) where every viewpoint was barred. A search
    /// that never says so ends in the same way after
    /// [`AgentConfig::max_views`](crate::AgentConfig::max_views) viewpoints.
    fn next_view(&mut self, at: &Joints, last: LastLook) -> Option<Viewpoint>;

    /// A copy, for the copies of an agent: `Box::new(self.clone())`.
    fn boxed(&self) -> Box<dyn Search>;
}

impl Clone for Box<dyn Search> {
    fn clone(&self) -> Self {
        (**self).boxed()
    }
}

/// The paper's search: from fixed poses, the one with the nearest pan angle first; then from beside
/// them.
#[derive(Clone, Debug)]
pub struct PoseSearch {
    poses: Vec<Joints>,
    again: Vec<JointDelta>,
    round: usize,
    /// Indices of the poses still to be tried in this round, the next one last.
    left: Vec<usize>,
}

impl PoseSearch {
    /// A search from `poses` and then, for each displacement of `again` in turn, from all of them
    /// displaced by that. Viewpoints are numbered on from round to round.
    pub fn new(poses: impl Into<Vec<Joints>>, again: impl Into<Vec<JointDelta>>) -> Self {
        Self {
            poses: poses.into(),
            again: again.into(),
            round: 0,
            left: Vec::new(),
        }
    }

    /// The indices of all poses, the one whose first joint is nearest to that of `at` last.
    fn nearest_last(&self, at: &Joints) -> Vec<usize> {
        let pan = |pose: usize| (self.poses[pose].0[0] - at.0[0]).abs();
        let mut order: Vec<usize> = (0..self.poses.len()).collect();
        order.sort_by(|&a, &b| pan(a).total_cmp(&pan(b)));
        order.reverse();
        order
    }
}

impl Search for PoseSearch {
    fn next_view(&mut self, at: &Joints, last: LastLook) -> Option<Viewpoint> {
        if last == LastLook::None {
            self.round = 0;
            self.left = self.nearest_last(at);
        } else if self.left.is_empty() && self.round < self.again.len() {
            self.round += 1;
            self.left = self.nearest_last(at);
        }
        let pose = self.left.pop()?;
        let beside = match self.round {
            0 => JointDelta::default(),
            round => self.again[round - 1],
        };
        Some(Viewpoint {
            number: self.round * self.poses.len() + pose,
            pose: self.poses[pose] + beside,
        })
    }

    fn boxed(&self) -> Box<dyn Search> {
        Box::new(self.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pan(degrees: f64) -> Joints {
        Joints::from_degrees([degrees, 0.0, 0.0, 0.0, 0.0, 0.0])
    }

    /// The numbers of all viewpoints of a search that finds nothing, from an arm that goes where it
    /// is sent.
    fn all(search: &mut PoseSearch, mut at: Joints) -> Vec<usize> {
        let mut last = LastLook::None;
        let mut numbers = Vec::new();
        while let Some(view) = search.next_view(&at, last) {
            (at, last) = (view.pose, LastLook::Nothing);
            numbers.push(view.number);
        }
        numbers
    }

    #[test]
    fn the_nearest_pan_angle_comes_first_in_every_round_and_in_every_search() {
        let poses = [-75.0, -50.0, -25.0, 0.0, 25.0, 50.0].map(pan);
        let mut search = PoseSearch::new(
            poses,
            [JointDelta::from_degrees([12.5, 0.0, 0.0, 0.0, 0.0, 0.0])],
        );
        // The second round begins where the first one ended, at the left.
        let expected = [4, 3, 5, 2, 1, 0, 6, 7, 8, 9, 10, 11];
        assert_eq!(all(&mut search, pan(20.0)), expected);
        assert_eq!(all(&mut search, pan(20.0)), expected);
        // One that is broken off begins anew as well.
        search.next_view(&pan(20.0), LastLook::None);
        assert_eq!(
            search
                .next_view(&pan(-80.0), LastLook::None)
                .unwrap()
                .number,
            0
        );
    }

    #[test]
    fn a_viewpoint_beside_a_pose_is_displaced() {
        let beside = JointDelta::from_degrees([12.5, 6.0, 0.0, 0.0, 0.0, 0.0]);
        let mut search = PoseSearch::new([pan(10.0)], [beside]);
        search.next_view(&pan(0.0), LastLook::None);
        let second = search.next_view(&pan(10.0), LastLook::Barred).unwrap();
        assert_eq!((second.number, second.pose), (1, pan(10.0) + beside));
        assert_eq!(search.next_view(&second.pose, LastLook::Nothing), None);
    }

    #[test]
    fn without_poses_there_is_nowhere_to_look_from() {
        assert!(all(&mut PoseSearch::new([], [JointDelta::default()]), pan(0.0)).is_empty());
    }
}
