//! The activation of the gripper, and whether it holds the ball.

use puma_val2::{Gripper, Joint, JointDelta, Joints};

use super::{OFTEN, Phase, Run, Went};
use crate::{AgentError, Consequence, EventKind, GaveUp, JointLimits, Sighting};

/// Ways of the gripper to the ball that were taken back.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Grips {
    taken_back: usize,
    /// Whether the last one was aimed by the controller.
    own: bool,
}

/// Seen from where the ball was at the goal, what has less than this share of its radius is something smaller.
const BALL_SIZED: f64 = 0.6;

/// The second lift, as a share of the first.
const AGAIN: f64 = 1.0 / 3.0;

/// Least share of [`AgentConfig::lift`](crate::AgentConfig::lift) from which a ball that was left behind looks displaced.
const LEAST_LIFT: f64 = 0.5;

/// Whether the jaws hold the ball.
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

impl Run<'_> {
    /// The paper's activation of the gripper: the fifth joint, then the jaws, and a look at what was left behind. Away from the goal only a
    /// controller that can aim from there goes for the ball.
    pub(super) fn grip(&mut self, seen: Sighting, at_goal: bool) -> Result<Phase, AgentError> {
        let from = self.joints;
        // What shows for a moment only is no ball, and the jaws do not close on it.
        let Some(sighting) = self.look()? else {
            return Ok(self.lose(from));
        };
        if !is_same_place(&seen, &sighting) {
            // Two looks that differ cost a cycle: both can be at the goal, and no move is made between them.
            self.cycles += 1;
            return Ok(if self.cycles >= self.config.max_cycles {
                Phase::End(Some(GaveUp::OutOfCycles))
            } else {
                Phase::Reach(sighting)
            });
        }
        // Where the controller's aim has just been barred, the settings' is tried.
        let admitted = self.config.limits.admit(&(from + self.config.grip));
        let fixed = (at_goal && admitted).then_some(self.config.grip);
        let barred = std::mem::take(&mut self.grips.own) && fixed.is_some();
        let own = if barred { None } else { self.aimed(&sighting) };
        let Some(delta) = own.or(fixed) else {
            if at_goal {
                return Ok(Phase::End(Some(GaveUp::NoMoveLeft)));
            }
            let often = std::mem::take(&mut self.taken_back) >= OFTEN;
            return Ok(if often {
                Phase::Search
            } else {
                Phase::Reach(sighting)
            });
        };
        self.taken_back = 0;
        let [aside, swing] = in_two(&delta);
        for part in [aside, swing] {
            if part != JointDelta::default() && self.go_by(part, EventKind::Gripping(part))? == Went::Back {
                self.grips.own = own.is_some();
                return self.after_a_barred_grip();
            }
        }
        self.arm.set_gripper(Gripper::Closed)?;
        self.tell(EventKind::Gripped, None);
        let Some(lift) = self.config.lift else {
            return Ok(Phase::End(None));
        };
        let held = self.is_held(&sighting, [from + aside, from], lift)?;
        // What was seen meanwhile was not the ball in its place.
        self.last_seen = Some(sighting);
        Ok(match held {
            Held::Unknown(reason) => Phase::End(Some(reason)),
            Held::Yes => Phase::End(None),
            Held::No => {
                self.arm.set_gripper(Gripper::Open)?;
                self.tell(EventKind::Missed, None);
                self.controller.judge(&Consequence::Missed);
                self.cycles += 1;
                Phase::Recover(from)
            }
        })
    }

    /// The move that brings the gripper to the ball, where the controller has one of its own.
    fn aimed(&mut self, sighting: &Sighting) -> Option<JointDelta> {
        let (now, limits) = (self.situation(sighting), &self.config.limits);
        let delta = self.controller.grip(&now, limits)?;
        limits.admit(&(self.joints + delta)).then_some(delta)
    }

    fn after_a_barred_grip(&mut self) -> Result<Phase, AgentError> {
        self.controller.judge(&Consequence::Missed);
        self.grips.taken_back += 1;
        self.cycles += 1;
        if self.grips.taken_back >= OFTEN {
            return Ok(Phase::End(Some(GaveUp::Obstructed)));
        }
        Ok(match self.look()? {
            Some(sighting) => Phase::Reach(sighting),
            None => self.lose(self.joints),
        })
    }

    /// Whether the jaws hold the ball that was seen from the last pose of `back`.
    ///
    /// A ball in the jaws is out of the camera's view, so the evidence for it is that none is seen any more: neither where it was, nor
    /// from the lifted hand, in two looks each. A ball that has left the view in another way is taken for one in the jaws.
    fn is_held(&mut self, seen: &Sighting, back: [Joints; 2], lift: JointDelta) -> Result<Held, AgentError> {
        let wandered = self.wandered;
        // Back the way it came, which was free: nothing but a ball that is not in the jaws can be in it.
        for pose in back {
            if pose != self.joints && self.go_to(pose, EventKind::Withdrawn)? == Went::Back {
                return Ok(Held::No);
            }
        }
        let there = self.look_twice()?;
        let [.., from] = back;
        // As far as the limits let the hand go, with a third of the first lift kept for a second one.
        let share = share_within(&self.config.limits, &from, &lift, 1.0 + AGAIN) / (1.0 + AGAIN);
        if share < LEAST_LIFT {
            return Ok(Held::Unknown(GaveUp::NoMoveLeft));
        }
        let up = |lifts: f64| from + JointDelta(lift.0.map(|turn| lifts * share * turn));
        if self.go_to(up(1.0), EventKind::Lifted)? == Went::Back {
            return Ok(Held::Unknown(GaveUp::Obstructed));
        }
        let (below, least) = (self.look_twice()?, self.config.left_behind);
        // What is as large as the ball is the ball: where it was, pushed aside, or in the jaws.
        let there = there.filter(|now| now.features.r > BALL_SIZED * seen.features.r);
        let below = below.filter(|now| now.features.r >= least);
        let Some(ball) = there.or(below) else {
            return Ok(Held::Yes);
        };
        // What goes where the hand goes is in the jaws, unless it has been in the camera from the beginning.
        if let (Some(there), Some(below)) = (&there, &below)
            && is_same_place(there, below)
        {
            return Ok(Held::from(wandered));
        }
        if self.go_to(up(1.0 + AGAIN), EventKind::Lifted)? == Went::Back {
            return Ok(Held::Unknown(GaveUp::Obstructed));
        }
        let now = self.look()?;
        Ok(Held::from(
            wandered
                && now.is_some_and(|now| {
                    is_same_place(&ball, &now) || there.is_none() && now.features.r < least
                }),
        ))
    }

    /// What is in view in two looks at the same place.
    fn look_twice(&mut self) -> Result<Option<Sighting>, AgentError> {
        let Some(first) = self.look()? else {
            return Ok(None);
        };
        let again = self.look()?;
        Ok(again.filter(|again| is_same_place(&first, again)))
    }
}

/// The largest share of `delta`, up to `most`, that leads from `from` to a pose within `limits`; 0 from a pose that is not in them.
fn share_within(limits: &JointLimits, from: &Joints, delta: &JointDelta, most: f64) -> f64 {
    let shares = Joint::ALL.into_iter().map(|joint| {
        let (low, high) = limits.0[joint.index()];
        let turn = delta[joint];
        let room = if turn > 0.0 {
            high - from[joint]
        } else {
            from[joint] - low
        };
        if turn == 0.0 { most } else { room / turn.abs() }
    });
    shares.fold(most, f64::min).max(0.0)
}

/// A grip in two parts: first the arm, with the fingers still beside the ball, then the hand, which brings them to both sides of it. An arm that
/// hardly moves need not go first.
fn in_two(delta: &JointDelta) -> [JointDelta; 2] {
    const HARDLY: f64 = 0.01;
    let mut parts = [JointDelta::default(), *delta];
    if Joint::ALL[..3].iter().any(|joint| delta[*joint].abs() > HARDLY) {
        for i in 0..3 {
            (parts[0].0[i], parts[1].0[i]) = (delta.0[i], 0.0);
        }
    }
    parts
}

/// Whether two sightings from one pose can be of one ball: the noise of any camera that can be worked with is less than this.
pub(super) fn is_same_place(a: &Sighting, b: &Sighting) -> bool {
    let (a, b) = (a.features, b.features);
    (a.x - b.x).abs() < 10.0 && (a.y - b.y).abs() < 10.0 && (a.r - b.r).abs() < 6.0
}
