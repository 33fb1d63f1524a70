//! How a run acts: orders to the arm, judged by supervision, and looks, judged by the watch over
//! the camera.

use puma_val2::{ArmError, Gripper, JointDelta, Joints};

use super::Run;
use crate::error::AgentError;
use crate::percept::Sighting;
use crate::run::event::{EventKind, Order};
use crate::run::gripper::{Hand, Went};
use crate::run::supervision::{Arrival, Verdict};
use crate::sight::eye::Look;

impl Hand for Run<'_> {
    fn joints(&self) -> Joints {
        self.joints
    }

    /// Looks, a few times if need be, for the ball from where the arm stands.
    fn look(&mut self) -> Result<Option<Sighting>, AgentError> {
        for _ in 0..self.config.looks {
            let Look { frame, ball } = self.devices.eye.look()?;
            let ball = ball.filter(is_finite);
            let kind = ball.map_or(EventKind::NotSeen, EventKind::Seen);
            self.tell(kind, frame.as_ref());
            if self.watch.looked(&self.joints, frame, ball.as_ref()) {
                self.tell(EventKind::SameFrame, None);
            }
            // By a picture that is as it was from another pose no grip is verified.
            let most = if self.closed {
                1
            } else {
                self.config.same_frames
            };
            if self.watch.same() >= most {
                return Err(self.frozen());
            }
            if let Some(sighting) = ball {
                self.saw(sighting);
                return Ok(Some(sighting));
            }
        }
        Ok(None)
    }

    fn go_by(&mut self, delta: JointDelta, done: EventKind) -> Result<Went, AgentError> {
        let from = self.joints;
        let answer = self.devices.arm.move_by(delta);
        let went = self.arrive(Order::MoveBy(delta), answer, from + delta, done)?;
        self.back_if_near(went, from)
    }

    fn go_to(&mut self, target: Joints, done: EventKind) -> Result<Went, AgentError> {
        let from = self.joints;
        let answer = self.devices.arm.move_to(target);
        let went = self.arrive(Order::MoveTo(target), answer, target, done)?;
        self.back_if_near(went, from)
    }

    fn set_jaws(&mut self, jaws: Gripper) -> Result<(), AgentError> {
        let done = self.devices.arm.set_gripper(jaws);
        self.answered(
            Order::Jaws {
                close: jaws == Gripper::Closed,
            },
            done,
        )?;
        self.closed = jaws == Gripper::Closed;
        if self.closed {
            self.tell(EventKind::Gripped, None);
        }
        Ok(())
    }

    fn aim(&mut self, seen: &Sighting) -> Option<JointDelta> {
        let now = self.situation(seen);
        let limits = self.modules.supervision.limits();
        let delta = self.controller.grip(&now, limits)?;
        limits.admit(&(self.joints + delta)).then_some(delta)
    }
}

impl Run<'_> {
    /// Takes down where the arm says it stands. An arm may be anyone's: from where no number says
    /// it is, nothing can be decided.
    pub(super) fn stand_at(&mut self, joints: Joints) -> Result<(), AgentError> {
        self.joints = joints;
        match joints.non_finite() {
            Some(joint) => Err(AgentError::Pose { joint }),
            None => {
                self.controller.arm_at(&joints);
                Ok(())
            }
        }
    }

    /// Goes back the way the arm came. Where that is barred too, the arm stands where it is.
    pub(super) fn take_back(&mut self, from: Joints) -> Result<(), AgentError> {
        let answer = self.devices.arm.move_to(from);
        self.arrive(Order::MoveTo(from), answer, from, EventKind::TakenBack)
            .map(drop)
    }

    fn back_if_near(&mut self, went: Went, from: Joints) -> Result<Went, AgentError> {
        if went == Went::Back {
            self.take_back(from)?;
        }
        Ok(went)
    }

    /// Tells `done`, or that the order was not answered, and has supervision judge where the arm
    /// stands. If something is too near it is stopped.
    fn arrive(
        &mut self,
        order: Order,
        answer: Result<Joints, ArmError>,
        target: Joints,
        done: EventKind,
    ) -> Result<Went, AgentError> {
        let answer = match answer {
            Ok(reached) => Ok((reached, false, None)),
            Err(ArmError::ProximityStop { joints, .. }) => Ok((joints, true, None)),
            // An arm that something else has stopped stands somewhere on the way; its sensors may
            // say what.
            Err(error @ ArmError::NotReached { .. }) => {
                let stands = self.devices.arm.joints();
                stands.map(|reached| (reached, false, Some(error)))
            }
            Err(error) => Err(error),
        };
        let (reached, halted, fault) = self.answered(order, answer)?;
        let stands = self.stand_at(reached);
        self.tell(done, None);
        stands?;
        let near = halted || self.devices.proximity.object_near()?;
        let arrival = Arrival {
            target,
            reached,
            near,
        };
        match (self.modules.supervision.judge_move(&arrival), fault) {
            (Verdict::TooNear, _) => {
                if !halted {
                    let stopped = self.devices.arm.stop();
                    self.answered(Order::Stop, stopped)?;
                }
                self.tell(EventKind::TooNear, None);
                Ok(Went::Back)
            }
            (_, Some(error)) => Err(error.into()),
            (Verdict::There, None) => Ok(Went::There),
            (Verdict::Stuck(joint), None) => Err(ArmError::NotReached {
                port: "the arm".into(),
                joint,
                wanted_degrees: target[joint].to_degrees(),
                reported_degrees: reached[joint].to_degrees(),
            }
            .into()),
        }
    }

    /// Passes on what came of `order`, and tells of it if that is nothing but an error.
    fn answered<T>(&mut self, order: Order, answer: Result<T, ArmError>) -> Result<T, AgentError> {
        if answer.is_err() {
            self.tell(EventKind::Unanswered(order), None);
        }
        Ok(answer?)
    }
}

/// Returns whether every number of a sighting is usable. User-supplied detectors may report NaN.
fn is_finite(sighting: &Sighting) -> bool {
    let Sighting {
        detection,
        features: f,
        long_axis,
    } = sighting;
    let c = detection.circle;
    let numbers = [f.x, f.y, f.r, c.x, c.y, c.radius, detection.score];
    numbers.into_iter().chain(*long_axis).all(f64::is_finite) && f.r > 0.0
}
