//! Target search and recovery: poses to look from for a ball that is not in view.

use puma_val2::{JointDelta, Joints};

use crate::percept::Sighting;

/// A module that names poses to look from, until the ball is in view: the paper's target search and
/// its recovery of a lost target (section 2.2).
///
/// It moves nothing itself. By default an agent searches from
/// [`AgentConfig::search_poses`](crate::AgentConfig::search_poses) and recovers by the moves of
/// [`AgentConfig::recovery`](crate::AgentConfig::recovery).
/// [`Agent::searching_by`](crate::Agent::searching_by) and
/// [`Agent::recovering_by`](crate::Agent::recovering_by) install other modules.
///
/// ```
/// use grasp_agent::puma_val2::Joints;
/// use grasp_agent::{Search, Sighting};
///
/// /// Turns round once, 30 degrees at a time.
/// #[derive(Clone, Debug, Default)]
/// struct Panorama {
///     seen: usize,
/// }
///
/// impl Search for Panorama {
///     fn begin(&mut self, _at: &Joints, _lost: Option<(&Sighting, &Joints)>) {
///         self.seen = 0;
///     }
///
///     fn next_view(&mut self, _at: &Joints, _barred: bool) -> Option<(usize, Joints)> {
///         let pan = -150.0 + 30.0 * self.seen as f64;
///         let pose = Joints::from_degrees([pan, -110.0, 210.0, 0.0, 45.0, 0.0]);
///         self.seen += 1;
///         (self.seen <= 11).then_some((self.seen - 1, pose))
///     }
///
///     fn boxed(&self) -> Box<dyn Search> {
///         Box::new(self.clone())
///     }
/// }
///
/// let mut panorama = Panorama::default();
/// panorama.begin(&Joints::default(), None);
/// let (number, pose) = panorama.next_view(&Joints::default(), false).unwrap();
/// assert!(number == 0 && (pose.degrees()[0] + 150.0).abs() < 1e-9);
/// ```
pub trait Search: std::fmt::Debug + Send + Sync {
    /// Begins anew with the arm at `at`. For a recovery, `lost` is the last sighting of the ball
    /// and the pose it was seen from.
    fn begin(&mut self, at: &Joints, lost: Option<(&Sighting, &Joints)>);

    /// Returns the next pose to look from, with the arm at `at`, and its number for the event log.
    /// `barred` is `true` if something too near kept the hand from getting to the pose before, so
    /// that there was no look. A pose outside the working limits is replaced by the nearest one
    /// within; one that is not finite ends the run with
    /// [`AgentError::Viewpoint`](crate::AgentError::Viewpoint).
    ///
    /// `None` ends a search with [`GaveUp::NotFound`](crate::GaveUp::NotFound), or with
    /// [`GaveUp::Obstructed`](crate::GaveUp::Obstructed) if every way was barred, and leaves a
    /// recovery to the search. A search that never returns `None` ends after
    /// [`AgentConfig::max_views`](crate::AgentConfig::max_views) viewpoints. Each viewpoint of a
    /// recovery costs a cycle of [`AgentConfig::max_cycles`](crate::AgentConfig::max_cycles).
    fn next_view(&mut self, at: &Joints, barred: bool) -> Option<(usize, Joints)>;

    /// Returns a copy, for copies of an agent: `Box::new(self.clone())`.
    fn boxed(&self) -> Box<dyn Search>;
}

impl Clone for Box<dyn Search> {
    fn clone(&self) -> Self {
        (**self).boxed()
    }
}

/// The paper's search: from fixed poses, the one with the nearest pan angle first, and then from
/// beside them.
#[derive(Clone, Debug)]
pub(crate) struct PoseSearch {
    poses: Vec<Joints>,
    again: Vec<JointDelta>,
    round: usize,
    /// Indices of the poses still to be tried in this round, the next one last.
    left: Vec<usize>,
}

impl PoseSearch {
    /// Creates a search from `poses` and then, for each displacement of `again` in turn, from all
    /// of them displaced by that.
    pub(crate) fn new(poses: impl Into<Vec<Joints>>, again: impl Into<Vec<JointDelta>>) -> Self {
        Self {
            poses: poses.into(),
            again: again.into(),
            round: 0,
            left: Vec::new(),
        }
    }

    /// Returns the indices of all poses, the one whose first joint is nearest to that of `at` last.
    fn nearest_last(&self, at: &Joints) -> Vec<usize> {
        let pan = |pose: usize| (self.poses[pose].0[0] - at.0[0]).abs();
        let mut order: Vec<usize> = (0..self.poses.len()).collect();
        order.sort_by(|&a, &b| pan(a).total_cmp(&pan(b)));
        order.reverse();
        order
    }
}

impl Search for PoseSearch {
    fn begin(&mut self, at: &Joints, _lost: Option<(&Sighting, &Joints)>) {
        self.round = 0;
        self.left = self.nearest_last(at);
    }

    fn next_view(&mut self, at: &Joints, _barred: bool) -> Option<(usize, Joints)> {
        if self.left.is_empty() && self.round < self.again.len() {
            self.round += 1;
            self.left = self.nearest_last(at);
        }
        let pose = self.left.pop()?;
        let beside = match self.round {
            0 => JointDelta::default(),
            round => self.again[round - 1],
        };
        Some((
            self.round * self.poses.len() + pose,
            self.poses[pose] + beside,
        ))
    }

    fn boxed(&self) -> Box<dyn Search> {
        Box::new(self.clone())
    }
}

/// The paper's recovery: back to the pose of the last sighting (viewpoint 0), then fixed moves from
/// there.
#[derive(Clone, Debug)]
pub(crate) struct RecoveryMoves {
    moves: Vec<JointDelta>,
    from: Joints,
    next: usize,
}

impl RecoveryMoves {
    /// Creates a recovery by `moves`, all relative to the pose of the last sighting.
    pub(crate) fn new(moves: impl Into<Vec<JointDelta>>) -> Self {
        Self {
            moves: moves.into(),
            from: Joints::default(),
            next: 0,
        }
    }
}

impl Search for RecoveryMoves {
    fn begin(&mut self, at: &Joints, lost: Option<(&Sighting, &Joints)>) {
        self.from = lost.map_or(*at, |(_, from)| *from);
        self.next = 0;
    }

    fn next_view(&mut self, _at: &Joints, _barred: bool) -> Option<(usize, Joints)> {
        let number = self.next;
        self.next += 1;
        let pose = match number {
            0 => self.from,
            number => self.from + *self.moves.get(number - 1)?,
        };
        Some((number, pose))
    }

    fn boxed(&self) -> Box<dyn Search> {
        Box::new(self.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hough_heuristic::Features;

    fn pan(degrees: f64) -> Joints {
        Joints::from_degrees([degrees, 0.0, 0.0, 0.0, 0.0, 0.0])
    }

    /// The numbers of all viewpoints of a search that finds nothing, from an arm that goes where it
    /// is sent.
    fn all(search: &mut PoseSearch, mut at: Joints) -> Vec<usize> {
        search.begin(&at, None);
        let mut numbers = Vec::new();
        while let Some((number, pose)) = search.next_view(&at, false) {
            at = pose;
            numbers.push(number);
        }
        numbers
    }

    #[test]
    fn the_nearest_pan_angle_comes_first_in_every_round() {
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
        search.begin(&pan(20.0), None);
        search.next_view(&pan(20.0), false);
        search.begin(&pan(-80.0), None);
        assert_eq!(search.next_view(&pan(-80.0), false).unwrap().0, 0);
    }

    #[test]
    fn a_viewpoint_beside_a_pose_is_displaced() {
        let beside = JointDelta::from_degrees([12.5, 6.0, 0.0, 0.0, 0.0, 0.0]);
        let mut search = PoseSearch::new([pan(10.0)], [beside]);
        search.begin(&pan(0.0), None);
        search.next_view(&pan(0.0), false);
        let second = search.next_view(&pan(10.0), true).unwrap();
        assert_eq!(second, (1, pan(10.0) + beside));
        assert_eq!(search.next_view(&second.1, false), None);
    }

    #[test]
    fn without_poses_there_is_nowhere_to_look_from() {
        assert!(all(&mut PoseSearch::new([], [JointDelta::default()]), pan(0.0)).is_empty());
    }

    #[test]
    fn recovery_goes_back_to_the_last_sighting_and_moves_from_there() {
        let turn = |degrees: f64| JointDelta::from_degrees([degrees, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let mut recovery = RecoveryMoves::new([turn(15.0), turn(-15.0)]);
        let ball = Sighting::new(Features::new(96.0, 72.0, 20.0));
        let joints = Joints::from_degrees([30.0, -100.0, 200.0, 0.0, 45.0, 0.0]);
        for _ in 0..2 {
            // Wherever the arm has got to.
            recovery.begin(&Joints::default(), Some((&ball, &joints)));
            let mut next = |barred| recovery.next_view(&Joints::default(), barred);
            let views = [false, false, true].map(|barred| next(barred).unwrap());
            assert_eq!(views.map(|view| view.0), [0, 1, 2]);
            let expected = [joints, joints + turn(15.0), joints + turn(-15.0)];
            assert_eq!(views.map(|view| view.1), expected);
            assert_eq!(next(false), None);
        }
    }
}
