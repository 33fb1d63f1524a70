//! Gripper activation: the hand goes for the ball, the jaws close, and the grip is verified.

use puma_val2::{Gripper, Joint, JointDelta, Joints};

use crate::controller::GaveUp;
use crate::error::AgentError;
use crate::limits::JointLimits;
use crate::percept::Sighting;
use crate::run::config::AgentConfig;
use crate::run::event::EventKind;

/// Number of barred ways to the ball that is too many.
const OFTEN: usize = 3;

/// Least share of the ball's radius, seen from the same pose, of something that can be the ball.
const BALL_SIZED: f64 = 0.6;

/// Second lift, as a share of the first.
const AGAIN: f64 = 1.0 / 3.0;

/// Least share of [`AgentConfig::lift`] from which a ball that was left behind looks displaced.
const LEAST_LIFT: f64 = 0.5;

/// Result of an order to move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Went {
    /// The arm stands where it was sent.
    There,
    /// Something was too near; the arm has gone back to where it came from.
    Back,
}

/// Arm, jaws and camera of a [`GripperActivation`], supervised. The run implements it, and the
/// tests of this module.
pub(crate) trait Hand {
    /// Returns the joint angles that the arm reports.
    fn joints(&self) -> Joints;

    /// Looks for the ball from where the arm stands; `None` if it is not in view.
    ///
    /// # Errors
    /// A camera that fails, or is frozen.
    fn look(&mut self) -> Result<Option<Sighting>, AgentError>;

    /// Moves by `delta` and reports `done`.
    ///
    /// # Errors
    /// An arm that fails.
    fn go_by(&mut self, delta: JointDelta, done: EventKind) -> Result<Went, AgentError>;

    /// Moves to `target` and reports `done`.
    ///
    /// # Errors
    /// An arm that fails.
    fn go_to(&mut self, target: Joints, done: EventKind) -> Result<Went, AgentError>;

    /// Opens or closes the jaws.
    ///
    /// # Errors
    /// A gripper that fails.
    fn set_jaws(&mut self, jaws: Gripper) -> Result<(), AgentError>;

    /// Returns the move that brings the gripper to the ball, if the controller has one.
    fn aim(&mut self, seen: &Sighting) -> Option<JointDelta>;
}

/// Result of an activation of the gripper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum GripEnd {
    /// The jaws hold the ball, verified by the camera only.
    Held(Sighting),
    /// The jaws are closed, and the grip could not be verified for this reason.
    Unknown(Sighting, GaveUp),
    /// The ball was not in the jaws, which have opened again.
    Missed(Sighting),
    /// The ball is not in view any more; nothing was done.
    Unseen,
    /// The ball is in view, in another place; nothing was done.
    Elsewhere(Sighting),
    /// There is no move to the ball, neither the fixed one within the limits nor one of the
    /// controller's; nothing was done.
    NoMove(Sighting),
    /// Something was too near on the way to the ball, and the hand has gone back.
    Barred,
    /// Something was too near for the third time.
    BarredAgain,
}

/// The paper's activation of the gripper (section 2.2: the fifth joint, then the jaws), and a
/// verification of the grip.
///
/// The verification is by exclusion, since the jaws lie outside the camera's view. A ball that is
/// seen in two looks neither in its place nor below the lifted hand counts as held, and so does one
/// that moves with the hand. Any other ball in view counts as missed. A ball that rolled out of
/// both views counts as held.
#[derive(Clone, Debug)]
pub(crate) struct GripperActivation {
    grip: JointDelta,
    lift: Option<JointDelta>,
    left_behind: f64,
    limits: JointLimits,
    /// Barred ways of the gripper to the ball in this run.
    barred: usize,
    /// `true` if the last one was aimed by the controller.
    own: bool,
}

impl GripperActivation {
    /// Creates the module with the settings of `config`, for one run within `limits`.
    pub(crate) fn new(config: &AgentConfig, limits: JointLimits) -> Self {
        Self {
            grip: config.grip,
            lift: config.lift,
            left_behind: config.left_behind,
            limits,
            barred: 0,
            own: false,
        }
    }

    /// Goes for the ball that was just `seen`. Away from the goal this takes a controller that can
    /// aim. `wandered` is `true` if the ball has shown in more than one place of the image; an
    /// object that has not may be part of the camera.
    ///
    /// # Errors
    /// The errors of `hand`.
    pub(crate) fn activate(
        &mut self,
        hand: &mut dyn Hand,
        seen: &Sighting,
        at_goal: bool,
        wandered: bool,
    ) -> Result<GripEnd, AgentError> {
        let from = hand.joints();
        // Require two consecutive sightings before closing, to reject one-frame false positives.
        let Some(ball) = hand.look()? else {
            return Ok(GripEnd::Unseen);
        };
        if !is_same_place(seen, &ball) {
            return Ok(GripEnd::Elsewhere(ball));
        }
        // After a barred aim of the controller, try the fixed grip.
        let admitted = self.limits.admit(&(from + self.grip));
        let fixed = (at_goal && admitted).then_some(self.grip);
        let barred = std::mem::take(&mut self.own) && fixed.is_some();
        let own = if barred { None } else { hand.aim(&ball) };
        let Some(delta) = own.or(fixed) else {
            return Ok(GripEnd::NoMove(ball));
        };
        let [aside, swing] = in_two(&delta);
        for part in [aside, swing] {
            if part != JointDelta::default()
                && hand.go_by(part, EventKind::Gripping(part))? == Went::Back
            {
                self.own = own.is_some();
                self.barred += 1;
                return Ok(if self.barred >= OFTEN {
                    GripEnd::BarredAgain
                } else {
                    GripEnd::Barred
                });
            }
        }
        hand.set_jaws(Gripper::Closed)?;
        let Some(lift) = self.lift else {
            return Ok(GripEnd::Held(ball));
        };
        Ok(
            match self.verify(hand, &ball, [from + aside, from], lift, wandered)? {
                Held::Yes => GripEnd::Held(ball),
                Held::Unknown(reason) => GripEnd::Unknown(ball, reason),
                Held::No => {
                    hand.set_jaws(Gripper::Open)?;
                    GripEnd::Missed(ball)
                }
            },
        )
    }

    /// Verifies that the jaws hold the ball that was seen from the last pose of `back`, the way
    /// back from the grip.
    fn verify(
        &self,
        hand: &mut dyn Hand,
        seen: &Sighting,
        back: [Joints; 2],
        lift: JointDelta,
        wandered: bool,
    ) -> Result<Held, AgentError> {
        // Back the way it came, which was free: only a ball outside the jaws can bar it.
        for pose in back {
            if pose != hand.joints() && hand.go_to(pose, EventKind::Withdrawn)? == Went::Back {
                return Ok(Held::No);
            }
        }
        let there = look_twice(hand)?;
        let [.., from] = back;
        // Lift as far as the limits allow, leaving a third of the first lift for a second.
        let share = share_within(&self.limits, &from, &lift, 1.0 + AGAIN) / (1.0 + AGAIN);
        if share < LEAST_LIFT {
            return Ok(Held::Unknown(GaveUp::NoMoveLeft));
        }
        let up = |lifts: f64| from + JointDelta(lift.0.map(|turn| lifts * share * turn));
        if hand.go_to(up(1.0), EventKind::Lifted)? == Went::Back {
            return Ok(Held::Unknown(GaveUp::Obstructed));
        }
        let (below, least) = (look_twice(hand)?, self.left_behind);
        // Something as large as the ball is the ball: in its place, pushed aside, or in the jaws.
        let there = there.filter(|now| now.features.r > BALL_SIZED * seen.features.r);
        let below = below.filter(|now| now.features.r >= least);
        let Some(ball) = there.or(below) else {
            return Ok(Held::Yes);
        };
        // A ball that moves with the hand is in the jaws, unless it is part of the camera.
        if let (Some(there), Some(below)) = (&there, &below)
            && is_same_place(there, below)
        {
            return Ok(Held::from(wandered));
        }
        if there.is_some_and(|there| is_same_place(seen, &there)) {
            return Ok(Held::No);
        }
        if hand.go_to(up(1.0 + AGAIN), EventKind::Lifted)? == Went::Back {
            return Ok(Held::Unknown(GaveUp::Obstructed));
        }
        let now = hand.look()?;
        Ok(Held::from(
            wandered
                && now.is_some_and(|now| {
                    is_same_place(&ball, &now) || there.is_none() && now.features.r < least
                }),
        ))
    }
}

/// Result of the verification.
#[derive(Clone, Copy, Debug)]
enum Held {
    Yes,
    No,
    /// The hand could not be lifted, for this reason.
    Unknown(GaveUp),
}

impl From<bool> for Held {
    fn from(held: bool) -> Self {
        if held { Self::Yes } else { Self::No }
    }
}

/// Looks twice, and returns the ball if it is seen in the same place.
fn look_twice(hand: &mut dyn Hand) -> Result<Option<Sighting>, AgentError> {
    let Some(first) = hand.look()? else {
        return Ok(None);
    };
    let again = hand.look()?;
    Ok(again.filter(|again| is_same_place(&first, again)))
}

/// Returns the largest share of `delta`, up to `most`, that leads from `from` to a pose within
/// `limits`; 0 from a pose outside them.
fn share_within(limits: &JointLimits, from: &Joints, delta: &JointDelta, most: f64) -> f64 {
    let shares = Joint::ALL.into_iter().map(|joint| {
        let (low, high) = limits.0[joint.index()];
        let turn = delta[joint];
        let way = if turn > 0.0 {
            high - from[joint]
        } else {
            from[joint] - low
        };
        match way / turn.abs() {
            _ if turn == 0.0 => most,
            // `min` turns NaN into a number.
            share if share.is_nan() => 0.0,
            share => share,
        }
    });
    shares.fold(most, f64::min).max(0.0)
}

/// Splits a grip into two moves: first the arm and `JT4`, with the fingers still beside the ball,
/// then the hand, which brings them to both sides of it. Small first moves are left out.
fn in_two(delta: &JointDelta) -> [JointDelta; 2] {
    const HARDLY: f64 = 0.01;
    let mut parts = [JointDelta::default(), *delta];
    if Joint::ALL[..4]
        .iter()
        .any(|joint| delta[*joint].abs() > HARDLY)
    {
        for i in 0..4 {
            (parts[0].0[i], parts[1].0[i]) = (delta.0[i], 0.0);
        }
    }
    parts
}

/// Returns `true` if two sightings from one pose can be of one ball, given the noise of a camera.
pub(crate) fn is_same_place(a: &Sighting, b: &Sighting) -> bool {
    let (a, b) = (a.features, b.features);
    (a.x - b.x).abs() < 10.0 && (a.y - b.y).abs() < 10.0 && (a.r - b.r).abs() < 6.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use hough_heuristic::Features;

    fn ball(x: f64, y: f64, r: f64) -> Sighting {
        Sighting::new(Features { x, y, r })
    }

    /// A hand whose looks and moves come to what is written down.
    struct Script {
        looks: Vec<Option<Sighting>>,
        aims: Option<JointDelta>,
        barred: Option<usize>,
        joints: Joints,
        done: Vec<&'static str>,
    }

    impl Hand for Script {
        fn joints(&self) -> Joints {
            self.joints
        }

        fn look(&mut self) -> Result<Option<Sighting>, AgentError> {
            Ok(if self.looks.is_empty() {
                None
            } else {
                self.looks.remove(0)
            })
        }

        fn go_by(&mut self, delta: JointDelta, done: EventKind) -> Result<Went, AgentError> {
            self.go_to(self.joints + delta, done)
        }

        fn go_to(&mut self, target: Joints, done: EventKind) -> Result<Went, AgentError> {
            self.done.push(done.word());
            if self.barred == Some(self.done.len()) {
                return Ok(Went::Back);
            }
            self.joints = target;
            Ok(Went::There)
        }

        fn set_jaws(&mut self, jaws: Gripper) -> Result<(), AgentError> {
            self.done.push(if jaws == Gripper::Closed {
                "close"
            } else {
                "open"
            });
            Ok(())
        }

        fn aim(&mut self, _seen: &Sighting) -> Option<JointDelta> {
            self.aims
        }
    }

    /// From the goal, with these looks, the first of them before anything is done; the move with
    /// this number is barred.
    fn activated(
        looks: &[Option<Sighting>],
        barred: Option<usize>,
    ) -> (GripEnd, Vec<&'static str>) {
        let joints = Joints::from_degrees([0.0, -100.0, 200.0, 0.0, 45.0, 0.0]);
        let mut hand = Script {
            looks: looks.into(),
            aims: None,
            barred,
            joints,
            done: Vec::new(),
        };
        let config = AgentConfig::paper([joints]);
        let mut activation = GripperActivation::new(&config, config.limits);
        let end = activation
            .activate(&mut hand, &AT_GOAL(), true, true)
            .unwrap();
        (end, hand.done)
    }

    const AT_GOAL: fn() -> Sighting = || ball(103.0, 78.0, 33.0);

    #[test]
    fn a_ball_that_is_seen_no_more_is_held() {
        let (end, done) = activated(&[Some(AT_GOAL())], None);
        assert_eq!(end, GripEnd::Held(AT_GOAL()));
        assert_eq!(done, ["gripping", "close", "withdrawn", "lifted"]);
    }

    #[test]
    fn a_ball_that_is_left_behind_is_missed_and_let_go() {
        let (seen, below) = (Some(AT_GOAL()), Some(ball(100.0, 120.0, 20.0)));
        let (end, done) = activated(&[seen, None, below, below, None], None);
        assert_eq!(end, GripEnd::Missed(AT_GOAL()));
        assert_eq!(
            done,
            ["gripping", "close", "withdrawn", "lifted", "lifted", "open"]
        );
    }

    #[test]
    fn a_ball_that_is_seen_where_it_was_is_missed() {
        let (seen, below) = (Some(AT_GOAL()), Some(ball(100.0, 120.0, 20.0)));
        let (end, done) = activated(&[seen, seen, seen, below, below], None);
        assert_eq!(end, GripEnd::Missed(AT_GOAL()));
        assert_eq!(done, ["gripping", "close", "withdrawn", "lifted", "open"]);
        // One that goes with the hand is in jaws that the camera sees.
        let (end, _) = activated(&[seen; 5], None);
        assert_eq!(end, GripEnd::Held(AT_GOAL()));
    }

    #[test]
    fn the_hand_turns_aside_before_it_swings_in() {
        let [aside, swing] = in_two(&JointDelta::from_degrees([0.0, 0.0, 0.0, 8.0, -18.0, 30.0]));
        assert_eq!(
            aside,
            JointDelta::from_degrees([0.0, 0.0, 0.0, 8.0, 0.0, 0.0])
        );
        assert_eq!(
            swing,
            JointDelta::from_degrees([0.0, 0.0, 0.0, 0.0, -18.0, 30.0])
        );
        let plain = JointDelta::of(Joint::J5, -0.3);
        assert_eq!(in_two(&plain), [JointDelta::default(), plain]);
    }

    #[test]
    fn limits_that_are_no_numbers_leave_no_share_of_a_lift() {
        let (limits, lift) = (JointLimits::paper(), JointDelta::of(Joint::J2, -0.2));
        let at = Joints::from_degrees([0.0, -100.0, 200.0, 0.0, 45.0, 0.0]);
        assert!((share_within(&limits, &at, &lift, 1.0) - 1.0).abs() < 1e-12);
        let mut none = limits;
        none.0[1].0 = f64::NAN;
        assert!(share_within(&none, &at, &lift, 1.0).abs() < 1e-12);
    }

    #[test]
    fn nothing_is_done_about_a_ball_that_does_not_show_twice() {
        assert_eq!(activated(&[None], None), (GripEnd::Unseen, vec![]));
        let aside = ball(80.0, 78.0, 33.0);
        assert_eq!(
            activated(&[Some(aside)], None),
            (GripEnd::Elsewhere(aside), vec![])
        );
    }

    #[test]
    fn a_stopped_hand_grips_nothing_and_verifies_nothing() {
        let seen = [Some(AT_GOAL())];
        assert_eq!(
            activated(&seen, Some(1)),
            (GripEnd::Barred, vec!["gripping"])
        );
        let (end, _) = activated(&seen, Some(4));
        assert_eq!(end, GripEnd::Unknown(AT_GOAL(), GaveUp::Obstructed));
    }
}
