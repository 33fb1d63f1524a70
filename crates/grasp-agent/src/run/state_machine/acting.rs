//! Acting of a run: orders to the arm, judged by supervision, and looks, checked for a frozen
//! camera.

use std::f64::consts::{FRAC_PI_2, PI};

use puma_val2::{ArmError, Gripper, Joint, JointDelta, Joints};

use crate::controller::{Decision, Feedback};
use crate::error::AgentError;
use crate::percept::Sighting;
use crate::run::event::{EventKind, RunEvent};
use crate::run::state_machine::Run;

/// Result of an order to move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Went {
    /// The arm stands where it was sent.
    There,
    /// Something was too near; the arm has gone back to where it came from.
    Back,
}

impl Run<'_> {
    /// Looks for the ball from where the arm stands, a few times if need be.
    pub(super) fn look(&mut self) -> Result<Option<Sighting>, AgentError> {
        self.drop_late_images()?;
        for _ in 0..self.config.looks {
            let ball = self.look_once()?;
            let frame = self.devices.eye.frame();
            if self.camera.looked(&self.joints, frame, ball.as_ref()) {
                self.tell(EventKind::SameFrame);
            }
            // No grip is verified by a frame that has not changed. A ball that is held may show the
            // same features from everywhere.
            let most = if self.closed && self.devices.eye.frame().is_some() {
                1
            } else {
                self.config.same_frames
            };
            if self.camera.same() >= most {
                return Err(self.frozen());
            }
            if let Some(ball) = ball {
                self.saw(ball);
                return Ok(Some(ball));
            }
        }
        Ok(None)
    }

    /// Takes one image as it comes, and reports what is in it.
    pub(super) fn look_once(&mut self) -> Result<Option<Sighting>, AgentError> {
        let ball = self.devices.eye.look()?;
        // A user-supplied detector might find anything.
        let ball = ball.filter(|ball| ball.is_finite() && ball.features.r > 0.0);
        (self.observe)(&RunEvent {
            cycle: self.cycles,
            kind: ball.map_or(EventKind::NotSeen, EventKind::Seen),
            joints: self.joints,
            frame: self.devices.eye.frame(),
        });
        Ok(ball)
    }

    pub(super) fn go_by(&mut self, delta: JointDelta, done: EventKind) -> Result<Went, AgentError> {
        let from = self.joints;
        let answer = self.devices.arm.move_by(delta);
        let went = self.arrive(answer, from + delta, done)?;
        self.back_if_near(went, from)
    }

    pub(super) fn go_to(&mut self, target: Joints, done: EventKind) -> Result<Went, AgentError> {
        let from = self.joints;
        let answer = self.devices.arm.move_to(target);
        let went = self.arrive(answer, target, done)?;
        self.back_if_near(went, from)
    }

    pub(super) fn set_jaws(&mut self, jaws: Gripper) -> Result<(), AgentError> {
        let done = self.devices.arm.set_gripper(jaws);
        self.answered(jaws_order(jaws), done)?;
        self.closed = jaws == Gripper::Closed;
        if self.closed {
            self.tell(EventKind::Gripped);
        }
        Ok(())
    }

    pub(super) fn aim(&mut self, seen: &Sighting) -> Option<JointDelta> {
        let request = self.request(true);
        let own = match self.controller.decide(seen, &request) {
            Ok(Decision::Grip(delta)) => Some(delta),
            _ => None,
        };
        let across = seen
            .long_axis
            .filter(|axis| self.config.grip_across && axis.is_finite());
        let delta = match across {
            Some(long_axis) => across_axis(own.unwrap_or(self.config.grip), long_axis),
            None => own?,
        };
        let admitted = request.limits.admit(&(self.joints + delta));
        admitted.then_some(delta)
    }
}

/// Order to stop, in [`EventKind::Unanswered`].
pub(crate) const STOP: &str = "stop";

/// Returns the order to the jaws, in [`EventKind::Unanswered`].
pub(crate) fn jaws_order(jaws: Gripper) -> &'static str {
    match jaws {
        Gripper::Closed => "close the jaws",
        Gripper::Open => "open the jaws",
    }
}

/// Turns the hand of a grip so that the jaws close across `long_axis`, by the shorter turn.
fn across_axis(mut grip: JointDelta, long_axis: f64) -> JointDelta {
    let turn = match (long_axis + FRAC_PI_2).rem_euclid(PI) {
        turn if turn > FRAC_PI_2 => turn - PI,
        turn => turn,
    };
    grip.0[Joint::J6.index()] += turn;
    grip
}

impl Run<'_> {
    /// Records the joint angles that the arm reports.
    ///
    /// # Errors
    /// [`AgentError::Pose`] for an angle that is not finite: nothing can be decided from there.
    pub(super) fn stand_at(&mut self, joints: Joints) -> Result<(), AgentError> {
        self.joints = joints;
        self.moved = true;
        match joints.non_finite() {
            Some(joint) => Err(AgentError::Pose {
                joint,
                name: self.config.name(joint),
            }),
            None => {
                self.controller.notice(&Feedback::Arm(joints));
                Ok(())
            }
        }
    }

    /// Goes back the way the arm came. If that is barred too, the arm stays where it is.
    pub(super) fn take_back(&mut self, from: Joints) -> Result<(), AgentError> {
        let answer = self.devices.arm.move_to(from);
        self.arrive(answer, from, EventKind::TakenBack).map(drop)
    }

    fn back_if_near(&mut self, went: Went, from: Joints) -> Result<Went, AgentError> {
        if went == Went::Back {
            self.take_back(from)?;
        }
        Ok(went)
    }

    /// Reports `done`, or that the order was not answered, and has supervision judge the move.
    /// Stops the arm if something is too near.
    fn arrive(
        &mut self,
        answer: Result<Joints, ArmError>,
        target: Joints,
        done: EventKind,
    ) -> Result<Went, AgentError> {
        let from = self.joints;
        let answer = match answer {
            Ok(reached) => Ok((reached, false, None)),
            Err(ArmError::ProximityStop { joints, .. }) => Ok((joints, true, None)),
            // An arm that something else has stopped stands somewhere on its way; sensors may know
            // the reason.
            Err(error @ ArmError::NotReached { .. }) => {
                let stands = self.devices.arm.joints();
                stands.map(|reached| (reached, false, Some(error)))
            }
            Err(error) => Err(error),
        };
        let (reached, halted, fault) = self.answered(&format!("move to {target}"), answer)?;
        let stands = self.stand_at(reached);
        self.tell(done);
        stands?;
        let near = halted || self.devices.proximity.object_near()?;
        let supervision = &mut self.modules.supervision;
        if supervision.is_too_near(&reached, near) {
            if !halted {
                let stopped = self.devices.arm.stop();
                self.answered(STOP, stopped)?;
            }
            self.tell(EventKind::TooNear);
            return Ok(Went::Back);
        }
        if self.freeing {
            return Ok(Went::There);
        }
        let rests = fault
            .is_none()
            .then(|| self.resting(&from, &target, &reached));
        if let Some(rests) = rests.filter(|rests| rests.contains(&true)) {
            return self.free(rests, target);
        }
        self.judge_arrival(fault, target, reached)
    }

    /// Fails with `fault`, or if supervision finds a joint that has not arrived.
    fn judge_arrival(
        &mut self,
        fault: Option<ArmError>,
        target: Joints,
        reached: Joints,
    ) -> Result<Went, AgentError> {
        let supervision = &mut self.modules.supervision;
        let fault = fault.or_else(|| {
            let joint = supervision.stuck(&target, &reached)?;
            let name = self.config.name(joint);
            Some(ArmError::NotReached {
                port: "the arm".into(),
                joint,
                name,
                wanted_degrees: target[joint].to_degrees(),
                reported_degrees: reached[joint].to_degrees(),
            })
        });
        fault.map_or(Ok(Went::There), |fault| Err(fault.into()))
    }

    /// Returns the joints that have not begun a small move: static friction holds them.
    fn resting(&self, from: &Joints, target: &Joints, reached: &Joints) -> [bool; 6] {
        /// Largest turn that friction is tried for, radians.
        const SMALL: f64 = 0.06;
        /// Least one, as a share of the tolerance.
        const LEAST: f64 = 0.1;
        let least = LEAST * self.config.reach_tolerance;
        std::array::from_fn(|i| {
            let (wanted, made) = (target.0[i] - from.0[i], reached.0[i] - from.0[i]);
            (least..SMALL).contains(&wanted.abs()) && made.abs() < 0.2 * wanted.abs()
        })
    }

    /// Overcomes static friction: turns the resting joints back, then all the way. At a limit they
    /// go past the target instead.
    fn free(&mut self, rests: [bool; 6], target: Joints) -> Result<Went, AgentError> {
        /// Turns back that are tried, radians.
        const BACK: [f64; 3] = [0.02, 0.04, 0.08];
        let from = self.joints;
        for back in BACK {
            let limits = *self.modules.supervision.limits();
            let mut aside = self.joints;
            for i in (0..6).filter(|i| rests[*i]) {
                let turn = back.copysign(target.0[i] - from.0[i]);
                let (low, high) = limits.0[i];
                let behind = from.0[i] - turn;
                let free = (low..=high).contains(&behind);
                aside.0[i] = if free { behind } else { target.0[i] + turn };
            }
            self.freeing = true;
            for pose in [limits.nearest(&aside), target] {
                let answer = self.devices.arm.move_to(pose);
                let went = self.arrive(answer, pose, EventKind::Freed);
                if !matches!(went, Ok(Went::There)) {
                    self.freeing = false;
                    return went;
                }
            }
            self.freeing = false;
            if !self.resting(&from, &target, &self.joints).contains(&true) {
                break;
            }
        }
        self.judge_arrival(None, target, self.joints)
    }

    /// Passes the answer to `order` on, and reports [`EventKind::Unanswered`] for an error.
    fn answered<T>(&mut self, order: &str, answer: Result<T, ArmError>) -> Result<T, AgentError> {
        if answer.is_err() {
            self.tell(EventKind::Unanswered(order.into()));
        }
        Ok(answer?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_jaws_close_across_the_longer_axis_by_the_shorter_turn() {
        let grip = JointDelta::from_degrees([0.0, 0.0, 0.0, 0.0, -18.01, 0.0]);
        for (axis, expected) in [
            (0.0, 90.0),
            (10.0, -80.0),
            (-30.0, 60.0),
            (80.0, -10.0),
            (-90.0, 0.0),
        ] {
            let [.., j5, j6] = across_axis(grip, f64::to_radians(axis)).degrees();
            let close = (j6 - expected).abs() < 1e-9 && (j5 + 18.01).abs() < 1e-9;
            assert!(close, "{axis}: {j6}");
        }
    }
}
