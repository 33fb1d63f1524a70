//! Goals that were shown on the arm.

use hough_heuristic::Features;
use puma_val2::{JointDelta, Joints};

use crate::behaviour::spec::GoalInterval;
#[cfg(feature = "serde")]
use crate::controller::SavedController;
use crate::controller::{Controller, Decision, Feedback, GaveUp, Request};
use crate::percept::{Input, Sighting};

/// A goal that was shown once on the arm: the features of the ball in the pose from which the grip
/// brings the jaws around it.
///
/// The paper's goal intervals (x 99..108, y 74..82, r 32..34) hold for its camera; another camera,
/// or another mount, shows something else there. To teach the goal, put the ball between the open
/// jaws, take the grip's turn back, and look. This needs no knowledge of the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "Read")
)]
pub struct TaughtGoal {
    untaught: Features,
    taught: Features,
    from: Joints,
    grip: JointDelta,
}

/// A [`TaughtGoal`] as it is read.
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct Read {
    untaught: Features,
    taught: Features,
    from: Joints,
    grip: JointDelta,
}

#[cfg(feature = "serde")]
impl TryFrom<Read> for TaughtGoal {
    type Error = &'static str;

    fn try_from(
        Read {
            untaught,
            taught,
            from,
            grip,
        }: Read,
    ) -> Result<Self, Self::Error> {
        let goal = Self {
            untaught,
            taught,
            from,
            grip,
        };
        goal.checked()
            .ok_or("a taught goal needs a radius above 0, and finite angles and features")
    }
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
        let untaught = Features {
            x: middle(Input::X)?,
            y: middle(Input::Y)?,
            r: middle(Input::R)?,
        };
        Self {
            untaught,
            taught: seen,
            from,
            grip,
        }
        .checked()
    }

    fn checked(self) -> Option<Self> {
        let Self {
            untaught,
            taught,
            from,
            grip,
        } = self;
        let shows =
            |f: Features| f.x.is_finite() && f.y.is_finite() && f.r.is_finite() && f.r > 0.0;
        let finite = from.0.iter().chain(&grip.0).all(|angle| angle.is_finite());
        (finite && shows(untaught) && shows(taught)).then_some(self)
    }

    /// Returns the features of the ball at the goal.
    pub fn features(&self) -> Features {
        self.taught
    }

    /// Returns the pose that they were seen from.
    pub fn seen_from(&self) -> Joints {
        self.from
    }

    /// Returns the move from there that brings the jaws around the ball.
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

    /// Moves what is seen so that this goal shows where the other one was.
    fn as_untaught(&self, ball: &Sighting) -> Sighting {
        let Self {
            untaught, taught, ..
        } = self;
        let seen = ball.features;
        Sighting {
            features: Features {
                x: seen.x + untaught.x - taught.x,
                y: seen.y + untaught.y - taught.y,
                r: seen.r * untaught.r / taught.r,
            },
            ..*ball
        }
    }
}

/// A controller whose goal is part of its learned knowledge, at work with a [`TaughtGoal`]: the
/// features that it sees are moved so that the taught goal shows where its own was.
#[derive(Clone, Debug)]
pub struct Retargeted<C> {
    controller: C,
    goal: TaughtGoal,
}

impl<C> Retargeted<C> {
    /// Wraps a controller that was made for the goal that `goal` replaces.
    pub fn new(controller: C, goal: TaughtGoal) -> Self {
        Self { controller, goal }
    }
}

impl<C: Controller> Controller for Retargeted<C> {
    fn decide(&mut self, ball: &Sighting, request: &Request) -> Result<Decision, GaveUp> {
        self.controller
            .decide(&self.goal.as_untaught(ball), request)
    }

    fn notice(&mut self, feedback: &Feedback) {
        self.controller.notice(&match feedback {
            Feedback::Seen { ball, joints } => Feedback::Seen {
                ball: self.goal.as_untaught(ball),
                joints: *joints,
            },
            other => *other,
        });
    }

    fn describe(&self) -> &str {
        self.controller.describe()
    }

    #[cfg(feature = "serde")]
    fn save(&self) -> Option<SavedController> {
        let data = (self.controller.save()?, self.goal);
        Some(SavedController::new("retargeted", data))
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
        let seen = Features {
            x: 90.0,
            y: 95.0,
            r: 36.0,
        };
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
            let features = Features {
                x: seen.x + dx,
                y: seen.y + dy,
                r: seen.r + dr,
            };
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

    #[cfg(feature = "serde")]
    #[test]
    fn a_goal_is_validated_on_deserialization() {
        let paper = AgentConfig::paper([Joints::default()]);
        let seen = Features {
            x: 90.0,
            y: 95.0,
            r: 36.0,
        };
        let goal = TaughtGoal::new(&paper.goal, seen, Joints::default(), paper.grip).unwrap();
        let text = serde_json::to_string(&goal).unwrap();
        assert_eq!(serde_json::from_str::<TaughtGoal>(&text).unwrap(), goal);
        for radius in ["0.0", "-36.0"] {
            let changed = text.replace("36.0", radius);
            assert_ne!(changed, text);
            let refused = serde_json::from_str::<TaughtGoal>(&changed).unwrap_err();
            assert!(refused.to_string().contains("radius"), "{refused}");
        }
    }
}
