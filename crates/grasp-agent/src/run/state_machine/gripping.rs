//! Gripper activation: the hand goes for the ball, the jaws close, and the grip is verified.

use puma_val2::{Gripper, JointDelta, Joints};

use crate::controller::{Feedback, GaveUp};
use crate::error::AgentError;
use crate::percept::Sighting;
use crate::run::event::EventKind;
use crate::run::state_machine::acting::Went;
use crate::run::state_machine::{OFTEN, Run, State, is_same_place, lost};

/// Least share of the ball's radius, seen from the same pose, of something that can be the ball.
const BALL_SIZED: f64 = 0.6;

/// Second lift, as a share of the first.
const AGAIN: f64 = 1.0 / 3.0;

/// Least share of [`AgentConfig::lift`](crate::AgentConfig::lift) from which a ball that was left
/// behind looks displaced.
const LEAST_LIFT: f64 = 0.5;

impl Run<'_> {
    /// Goes for the ball that was just `seen`, closes the jaws and verifies the grip: the paper's
    /// activation of the gripper (section 2.2: the fifth joint, then the jaws). Away from the goal
    /// this takes a controller that can aim.
    pub(super) fn grip(&mut self, seen: &Sighting, at_goal: bool) -> Result<State, AgentError> {
        let (from, wandered) = (self.joints, self.wandered);
        // Require two consecutive sightings before closing, to reject one-frame false positives.
        let Some(ball) = self.look()? else {
            self.cycles += 1;
            return Ok(lost(*seen, self.joints));
        };
        if !is_same_place(seen, &ball) {
            // Costs a cycle: both looks can be at the goal, and no move is made between them.
            self.cycles += 1;
            self.unsteady += 1;
            return Ok(if self.cycles >= self.config.max_cycles {
                State::End(Some(GaveUp::OutOfCycles))
            } else {
                State::Reach(ball)
            });
        }
        // After a barred aim of the controller, try the fixed grip.
        let grip = self.config.grip;
        let admitted = self.modules.supervision.limits().admit(&(from + grip));
        let fixed = (at_goal && admitted).then_some(grip);
        let barred = std::mem::take(&mut self.own_barred) && fixed.is_some();
        let own = if barred { None } else { self.aim(&ball) };
        let Some(delta) = own.or(fixed) else {
            return Ok(if at_goal {
                State::End(Some(GaveUp::NoMoveLeft))
            } else if std::mem::take(&mut self.taken_back) >= OFTEN {
                State::Search
            } else {
                State::Reach(ball)
            });
        };
        self.taken_back = 0;
        let [aside, swing] = in_two(&delta);
        for part in [aside, swing] {
            if part != JointDelta::default()
                && self.go_by(part, EventKind::Gripping(part))? == Went::Back
            {
                self.own_barred = own.is_some();
                return self.after_barred_grip(seen);
            }
        }
        self.set_jaws(Gripper::Closed)?;
        let closed_at = self.joints;
        let held = match self.config.lift {
            Some(lift) => self.verify(&ball, [from + aside, from], lift, wandered)?,
            None => Ok(true),
        };
        if held == Ok(true) && self.config.lift.is_some() {
            self.controller.notice(&Feedback::Held(closed_at));
        }
        // Sightings in the meantime were not of the ball in its place.
        self.last_seen = Some(ball);
        Ok(match held {
            Ok(true) => State::End(None),
            Err(reason) => State::End(Some(reason)),
            Ok(false) => {
                self.set_jaws(Gripper::Open)?;
                self.controller.notice(&Feedback::Missed);
                State::Recover {
                    ball,
                    from,
                    missed: true,
                }
            }
        })
    }

    /// Looks again after a barred way to the ball. The third one ends the run.
    fn after_barred_grip(&mut self, seen: &Sighting) -> Result<State, AgentError> {
        self.controller.notice(&Feedback::Missed);
        self.cycles += 1;
        self.barred_grips += 1;
        if self.barred_grips >= OFTEN {
            let reason = match self.short_of_goal >= OFTEN {
                true => GaveUp::GoalBarred,
                false => GaveUp::Obstructed,
            };
            return Ok(State::End(Some(reason)));
        }
        let ball = self.look()?;
        Ok(ball.map_or(lost(*seen, self.joints), State::Reach))
    }

    /// Verifies that the jaws hold the ball that was seen from the last pose of `back`, the way
    /// back from the grip; an error is the reason why that could not be verified.
    ///
    /// The verification is by exclusion, since the jaws lie outside the camera's view. A ball that
    /// is seen in two looks neither in its place nor below the lifted hand counts as held, and so
    /// does one that moves with the hand, unless it has not `wandered`: an object that has shown in
    /// one place of the image only may be part of the camera. Any other ball in view counts as
    /// missed. A ball that rolled out of both views counts as held.
    fn verify(
        &mut self,
        seen: &Sighting,
        back: [Joints; 2],
        lift: JointDelta,
        wandered: bool,
    ) -> Result<Result<bool, GaveUp>, AgentError> {
        // Back the way it came, which was free: only a ball outside the jaws can bar it.
        for pose in back {
            if pose != self.joints && self.go_to(pose, EventKind::Withdrawn)? == Went::Back {
                return Ok(Ok(false));
            }
        }
        let there = self.look_twice()?;
        let [.., from] = back;
        // Lift as far as the limits allow, leaving a third of the first lift for a second.
        let limits = self.modules.supervision.limits();
        let share = limits.share_within(&from, &lift, 1.0 + AGAIN) / (1.0 + AGAIN);
        if share < LEAST_LIFT {
            return Ok(Err(GaveUp::NoMoveLeft));
        }
        let up = |lifts: f64| from + JointDelta(lift.0.map(|turn| lifts * share * turn));
        if self.go_to(up(1.0), EventKind::Lifted)? == Went::Back {
            return Ok(Err(GaveUp::Obstructed));
        }
        let (below, least) = (self.look_twice()?, self.config.left_behind);
        // Something as large as the ball is the ball: in its place, pushed aside, or in the jaws.
        let there = there.filter(|now| now.features.r > BALL_SIZED * seen.features.r);
        let below = below.filter(|now| now.features.r >= least);
        let Some(ball) = there.or(below) else {
            return Ok(Ok(true));
        };
        // A ball that moves with the hand is in the jaws.
        if let (Some(there), Some(below)) = (&there, &below)
            && is_same_place(there, below)
        {
            return Ok(Ok(wandered));
        }
        if there.is_some_and(|there| is_same_place(seen, &there)) {
            return Ok(Ok(false));
        }
        if self.go_to(up(1.0 + AGAIN), EventKind::Lifted)? == Went::Back {
            return Ok(Err(GaveUp::Obstructed));
        }
        let now = self.look()?;
        let with_hand = now.is_some_and(|now| {
            is_same_place(&ball, &now) || there.is_none() && now.features.r < least
        });
        Ok(Ok(wandered && with_hand))
    }

    /// Looks twice, and returns the ball if it is seen in the same place.
    fn look_twice(&mut self) -> Result<Option<Sighting>, AgentError> {
        let Some(first) = self.look()? else {
            return Ok(None);
        };
        let again = self.look()?;
        Ok(again.filter(|again| is_same_place(&first, again)))
    }
}

/// Splits a grip into two moves: first the arm and `JT4`, with the fingers still beside the ball,
/// then the hand, which brings them to both sides of it. Small first moves are left out. Of an arm
/// that grips without the last two joints, `JT4` is the hand.
fn in_two(delta: &JointDelta) -> [JointDelta; 2] {
    const HARDLY: f64 = 0.01;
    let mut parts = [JointDelta::default(), *delta];
    let arm = if delta.0[4..].iter().all(|turn| *turn == 0.0) {
        3
    } else {
        4
    };
    if delta.0[..arm].iter().any(|turn| turn.abs() > HARDLY) {
        for i in 0..arm {
            (parts[0].0[i], parts[1].0[i]) = (delta.0[i], 0.0);
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use puma_val2::Joint;

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
        let both = in_two(&JointDelta::from_degrees([0.0, 3.0, 0.0, -9.0, 0.0, 0.0]));
        assert!(
            both[0][Joint::J2] > 0.0 && both[1] == JointDelta::of(Joint::J4, both[1][Joint::J4])
        );
    }
}
