//! Goals that were shown on the arm.

use hough_heuristic::Features;
use puma_val2::{JointDelta, Joints};
use serde::{Deserialize, Serialize};

use crate::behaviour::spec::GoalInterval;
use crate::percept::{Input, Sighting};

/// A goal that was shown once on the arm: the features of the ball in the pose from which the grip
/// brings the jaws around it.
///
/// The paper's goal intervals (x 99..108, y 74..82, r 32..34) hold for its camera; another camera,
/// or another mount, shows something else there. To teach the goal, put the ball between the open
/// jaws, turn the arm back by the grip, and take a sighting. This needs no knowledge of the camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TaughtGoal {
    untaught: Features,
    taught: Features,
    from: Joints,
    grip: JointDelta,
}

impl TaughtGoal {
    /// Creates the goal that shows as `seen` with the arm at `from`, from where `grip` brings the
    /// jaws around the ball. It replaces the goal in the middle of `intervals`.
    ///
    /// `None` if the intervals lack x, y or r, for a radius that is not above 0, and for a pose or
    /// a grip that is not finite.
    pub fn new(
        intervals: &[GoalInterval],
        seen: Features,
        from: Joints,
        grip: JointDelta,
    ) -> Option<Self> {
        let middle = |input: Input| {
            let interval = intervals.iter().find(|interval| interval.input == input)?;
            Some(0.5 * (interval.low + interval.high))
        };
        let untaught = Features::new(middle(Input::X)?, middle(Input::Y)?, middle(Input::R)?);
        let goal = Self {
            untaught,
            taught: seen,
            from,
            grip,
        };
        goal.check().is_ok().then_some(goal)
    }

    pub(crate) fn check(&self) -> Result<(), String> {
        let sound = [self.untaught, self.taught]
            .iter()
            .all(|f| f.x.is_finite() && f.y.is_finite() && f.r.is_finite() && f.r > 0.0);
        let mut angles = self.from.0.iter().chain(&self.grip.0);
        if sound && angles.all(|angle| angle.is_finite()) {
            return Ok(());
        }
        Err("a taught goal needs a radius above 0, and finite angles and features".into())
    }

    /// Returns the features of the ball at the goal.
    pub fn features(&self) -> Features {
        self.taught
    }

    /// Returns the features at the goal that this one replaces.
    pub(crate) fn untaught(&self) -> Features {
        self.untaught
    }

    /// Returns the pose that they were seen from.
    pub fn seen_from(&self) -> Joints {
        self.from
    }

    /// Returns the move from [`seen_from`](Self::seen_from) that brings the jaws around the ball.
    pub fn grip(&self) -> JointDelta {
        self.grip
    }

    /// Moves the intervals of x and y and scales that of r so that they lie about this goal.
    pub(crate) fn intervals(&self, intervals: &[GoalInterval]) -> Vec<GoalInterval> {
        let Self {
            untaught, taught, ..
        } = self;
        let moved = |interval: &GoalInterval| {
            let at = |value: f64| match interval.input {
                Input::X => value + taught.x - untaught.x,
                Input::Y => value + taught.y - untaught.y,
                Input::R => value * taught.r / untaught.r,
                Input::Theta3 => value,
            };
            GoalInterval {
                input: interval.input,
                low: at(interval.low),
                high: at(interval.high),
            }
        };
        intervals.iter().map(moved).collect()
    }

    /// Moves what is seen so that this goal shows where the one that it replaces was: for a
    /// controller whose goal is part of its learned knowledge.
    pub fn as_untaught(&self, ball: &Sighting) -> Sighting {
        let Self {
            untaught, taught, ..
        } = self;
        let seen = ball.features;
        Sighting {
            features: Features::new(
                seen.x + untaught.x - taught.x,
                seen.y + untaught.y - taught.y,
                seen.r * untaught.r / taught.r,
            ),
            ..*ball
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::percept::Percept;
    use crate::run::config::AgentConfig;

    #[test]
    fn intervals_and_sightings_move_with_the_goal() {
        let paper = AgentConfig::paper([Joints::default()]);
        let (intervals, grip) = (paper.goal.clone(), paper.grip);
        let seen = Features::new(90.0, 95.0, 36.0);
        let new = |intervals: &[_], seen| TaughtGoal::new(intervals, seen, Joints::default(), grip);
        let goal = new(&intervals, seen).unwrap();
        let moved = goal.intervals(&intervals);
        let holds = |intervals: &[GoalInterval], ball: &Sighting| {
            let percept = Percept::new(ball.features, &Joints::default());
            intervals.iter().all(|interval| interval.holds(&percept))
        };
        assert!(holds(&moved, &Sighting::new(seen)) && !holds(&intervals, &Sighting::new(seen)));
        // Inside and outside agree, at every end of every interval.
        for (dx, dy, dr) in [
            (4.4, 3.9, 1.05),
            (4.6, 0.0, 0.0),
            (0.0, -4.1, 0.0),
            (0.0, 0.0, -1.2),
        ] {
            let features = Features::new(seen.x + dx, seen.y + dy, seen.r + dr);
            let there = Sighting::new(features);
            assert_eq!(
                holds(&moved, &there),
                holds(&intervals, &goal.as_untaught(&there)),
                "{features:?}"
            );
        }
        assert!(new(&intervals[..2], seen).is_none());
        assert!(new(&intervals, Features { r: 0.0, ..seen }).is_none());
        let of = |from, grip| TaughtGoal::new(&intervals, seen, from, grip);
        assert!(of(Joints([f64::NAN; 6]), grip).is_none());
        assert!(of(Joints::default(), JointDelta([f64::INFINITY; 6])).is_none());
    }
}
