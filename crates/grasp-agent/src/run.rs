//! A run under way: the phases of the state machine and how one leads to the next.

use hough_heuristic::image::GrayImage;
use puma_val2::{ArmError, Gripper, Joint, JointDelta, Joints, Manipulator, ProximitySensor};

use crate::watch::Watch;
use crate::{
    AgentConfig, AgentError, Consequence, Controller, Event, EventKind, Eye, GaveUp, Look, Outcome, Percept,
    Sighting, Situation,
};

mod gripping;

use gripping::{Grips, is_same_place};

/// So many moves that were taken back are too many.
const OFTEN: usize = 3;

/// Where the state machine stands.
#[derive(Clone, Copy, Debug)]
enum Phase {
    /// Looking around from the search poses.
    Search,
    /// The ball is in view.
    Reach(Sighting),
    /// The ball was in view from this pose and is not any more.
    Recover(Joints),
    /// The ball is where it should be, or as near to that as can be.
    Grip { seen: Sighting, at_goal: bool },
    /// Over, without a grip where there is a reason.
    End(Option<GaveUp>),
}

/// What an order to move came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Went {
    /// The arm stands where it should.
    There,
    /// Something was too near; the arm has gone back to where it came from.
    Back,
}

pub(crate) struct Run<'a> {
    config: &'a AgentConfig,
    controller: &'a mut dyn Controller,
    eye: &'a mut dyn Eye,
    arm: &'a mut dyn Manipulator,
    proximity: &'a mut dyn ProximitySensor,
    observe: &'a mut dyn FnMut(&Event<'_>),
    joints: Joints,
    cycles: usize,
    losses: usize,
    last_seen: Option<Sighting>,
    watch: &'a mut Watch,
    /// Moves in a row that were taken back.
    taken_back: usize,
    /// All of them since the search.
    barred: usize,
    grips: Grips,
    /// Whether what is seen has shown in more than one place of the image since the search began.
    wandered: bool,
}

impl<'a> Run<'a> {
    pub(crate) fn new(
        config: &'a AgentConfig,
        controller: &'a mut dyn Controller,
        watch: &'a mut Watch,
        eye: &'a mut dyn Eye,
        arm: &'a mut dyn Manipulator,
        proximity: &'a mut dyn ProximitySensor,
        observe: &'a mut dyn FnMut(&Event<'_>),
    ) -> Self {
        Self {
            config,
            controller,
            watch,
            eye,
            arm,
            proximity,
            observe,
            joints: Joints::default(),
            cycles: 0,
            losses: 0,
            last_seen: None,
            taken_back: 0,
            barred: 0,
            grips: Grips::default(),
            wandered: false,
        }
    }

    pub(crate) fn until_done(mut self) -> Result<Outcome, AgentError> {
        let result = self.phases();
        if let Err(error) = &result {
            // The first error is the one to report; stopping is all that can still be done.
            let _ = self.arm.stop();
            self.tell(EventKind::Failed(error.to_string()), None);
        }
        result
    }

    fn phases(&mut self) -> Result<Outcome, AgentError> {
        let joints = self.arm.joints()?;
        self.stand_at(joints);
        self.arm.set_gripper(Gripper::Open)?;
        self.tell(EventKind::Started, None);
        let mut phase = Phase::Search;
        loop {
            phase = match phase {
                Phase::Search => self.search()?,
                Phase::Reach(sighting) => self.reach(sighting)?,
                Phase::Recover(last) => self.recover(last)?,
                Phase::Grip { seen, at_goal } => self.grip(seen, at_goal)?,
                Phase::End(gave_up) => {
                    if let Some(reason) = gave_up {
                        self.tell(EventKind::GaveUp(reason), None);
                    }
                    return Ok(Outcome {
                        gave_up,
                        cycles: self.cycles,
                        losses: self.losses,
                        last_seen: self.last_seen,
                        joints: self.joints,
                    });
                }
            };
        }
    }

    /// Looks around from the search poses, the nearest pan angle first; then from beside them.
    fn search(&mut self) -> Result<Phase, AgentError> {
        let config = self.config;
        self.tell(EventKind::Searching, None);
        (self.wandered, self.barred) = (false, 0);
        let rounds = std::iter::once(JointDelta::default()).chain(config.search_again.iter().copied());
        for (round, beside) in rounds.enumerate() {
            for pose in nearest_first(&config.search_poses, &self.joints) {
                let target = config.limits.nearest(&(config.search_poses[pose] + beside));
                let number = round * config.search_poses.len() + pose;
                if self.go_to(target, EventKind::AtSearchPose(number))? == Went::Back {
                    continue;
                }
                if let Some(sighting) = self.look()? {
                    return Ok(Phase::Reach(sighting));
                }
            }
        }
        Ok(Phase::End(Some(GaveUp::NotFound)))
    }

    /// One control cycle: sighting, decision, one joint move, next sighting.
    fn reach(&mut self, sighting: Sighting) -> Result<Phase, AgentError> {
        let now = self.situation(&sighting);
        let percept = Percept::new(sighting.features, &self.joints);
        if self.config.goal.iter().all(|interval| interval.holds(&percept)) {
            // What is shown from two poses alike is not what is there: no reason to grip.
            if self.watch.same() > 0 {
                return Err(self.frozen());
            }
            self.tell(EventKind::AtGoal, None);
            return Ok(Phase::Grip {
                seen: sighting,
                at_goal: true,
            });
        }
        if self.cycles >= self.config.max_cycles {
            return Ok(Phase::End(Some(GaveUp::OutOfCycles)));
        }
        let (limits, from) = (&self.config.limits, self.joints);
        let delta = match self.controller.decide(&now, limits) {
            // A controller may be anyone's: what leads out of the limits is not done.
            Ok(delta) if limits.admit(&(from + delta)) => delta,
            Ok(_) => return Ok(Phase::End(Some(GaveUp::NoMoveLeft))),
            Err(reason) => return Ok(Phase::End(Some(reason))),
        };

        self.cycles += 1;
        if self.go_by(delta, EventKind::Moved(delta))? == Went::Back {
            return self.after_taking_back(from);
        }
        let Some(after) = self.look()? else {
            self.controller.judge(&Consequence::Lost);
            return Ok(self.lose(from));
        };
        if self
            .config
            .approach
            .exceeded(sighting.features.r, after.features.r)
        {
            self.tell(EventKind::TooFast, None);
            self.take_back(from)?;
            return self.after_taking_back(from);
        }
        self.taken_back = 0;
        let then = self.situation(&after);
        self.controller.judge(&Consequence::Seen(then));
        Ok(Phase::Reach(after))
    }

    /// Looks again from where the last move began. Where moves come to nothing again and again, what is too near may be the ball itself, and a
    /// controller that can aim at it from here does; where they do so in a row and it cannot, whatever is seen is not to be had, and the search
    /// begins anew.
    fn after_taking_back(&mut self, from: Joints) -> Result<Phase, AgentError> {
        self.controller.judge(&Consequence::TakenBack);
        self.taken_back += 1;
        self.barred += 1;
        let Some(seen) = self.look()? else {
            return Ok(self.lose(from));
        };
        Ok(if self.barred.is_multiple_of(OFTEN) || self.taken_back >= OFTEN {
            Phase::Grip { seen, at_goal: false }
        } else {
            Phase::Reach(seen)
        })
    }

    fn lose(&mut self, from: Joints) -> Phase {
        self.losses += 1;
        self.tell(EventKind::Lost, None);
        Phase::Recover(from)
    }

    /// Back to where the ball was last seen, then the recovery moves around that pose, then a new search.
    fn recover(&mut self, last: Joints) -> Result<Phase, AgentError> {
        let config = self.config;
        let around = config.recovery.iter().map(|delta| last + *delta);
        for (attempt, pose) in std::iter::once(last).chain(around).enumerate() {
            if self.cycles >= config.max_cycles {
                return Ok(Phase::End(Some(GaveUp::OutOfCycles)));
            }
            let pose = config.limits.nearest(&pose);
            self.cycles += 1;
            let went = self.go_to(pose, EventKind::Recovering(attempt))?;
            if went == Went::There
                && let Some(sighting) = self.look()?
            {
                return Ok(Phase::Reach(sighting));
            }
        }
        Ok(Phase::Search)
    }

    fn situation(&self, sighting: &Sighting) -> Situation {
        Situation {
            features: sighting.features,
            joints: self.joints,
        }
    }

    /// Moves to `target` and tells `done`; goes back if something is too near there.
    fn go_to(&mut self, target: Joints, done: EventKind) -> Result<Went, AgentError> {
        let ordered = self.arm.move_to(target);
        self.arrive(target, ordered, done)
    }

    /// The same for a relative move.
    fn go_by(&mut self, delta: JointDelta, done: EventKind) -> Result<Went, AgentError> {
        let target = self.joints + delta;
        let ordered = self.arm.move_by(delta);
        self.arrive(target, ordered, done)
    }

    fn arrive(
        &mut self,
        target: Joints,
        ordered: Result<Joints, ArmError>,
        done: EventKind,
    ) -> Result<Went, AgentError> {
        let from = self.joints;
        let (reached, halted, fault) = match ordered {
            Ok(joints) => (joints, false, None),
            Err(ArmError::ProximityStop { joints, .. }) => (joints, true, None),
            // An arm that something else has stopped stands somewhere on the way; its sensors may say what.
            Err(error @ ArmError::NotReached { .. }) => (self.arm.joints()?, false, Some(error)),
            Err(error) => return Err(error.into()),
        };
        self.stand_at(reached);
        self.tell(done, None);
        if self.too_near(halted)? {
            self.take_back(from)?;
            return Ok(Went::Back);
        }
        match fault {
            Some(error) => Err(error.into()),
            None => self.check_reached(&target).map(|()| Went::There),
        }
    }

    /// Whether something is too near to the hand: the arm has been halted by its own guard, or is stopped now.
    fn too_near(&mut self, halted: bool) -> Result<bool, AgentError> {
        if !halted {
            if !self.proximity.object_near()? {
                return Ok(false);
            }
            self.arm.stop()?;
        }
        self.tell(EventKind::TooNear, None);
        Ok(true)
    }

    /// Goes back the way the arm came. Where that is barred too, the arm stands where it is.
    fn take_back(&mut self, from: Joints) -> Result<(), AgentError> {
        let (reached, halted) = match self.arm.move_to(from) {
            Ok(joints) => (joints, false),
            Err(ArmError::ProximityStop { joints, .. }) => (joints, true),
            Err(error) => return Err(error.into()),
        };
        self.stand_at(reached);
        self.tell(EventKind::TakenBack, None);
        if self.too_near(halted)? {
            return Ok(());
        }
        self.check_reached(&from)
    }

    fn stand_at(&mut self, joints: Joints) {
        self.joints = joints;
        self.controller.arm_at(&joints);
    }

    /// Whether the arm is where it was sent; an arm that says it has moved and has not is stuck.
    fn check_reached(&self, target: &Joints) -> Result<(), AgentError> {
        let off = |joint: Joint| (self.joints[joint] - target[joint]).abs();
        let stuck = Joint::ALL
            .into_iter()
            .find(|joint| off(*joint).is_nan() || off(*joint) > self.config.reach_tolerance);
        match stuck {
            None => Ok(()),
            Some(joint) => Err(ArmError::NotReached {
                port: "the arm".into(),
                joint,
                wanted_degrees: target[joint].to_degrees(),
                reported_degrees: self.joints[joint].to_degrees(),
            }
            .into()),
        }
    }

    /// Looks, a few times if need be, for the ball from where the arm stands.
    fn look(&mut self) -> Result<Option<Sighting>, AgentError> {
        for _ in 0..self.config.looks {
            let Look { frame, ball } = self.eye.look()?;
            let ball = ball.filter(is_finite);
            let kind = ball.map_or(EventKind::NotSeen, EventKind::Seen);
            self.tell(kind, frame.as_ref());
            if self.watch.looked(&self.joints, frame, ball.as_ref()) {
                self.tell(EventKind::SameFrame, None);
            }
            if self.watch.same() >= self.config.same_frames {
                return Err(self.frozen());
            }
            if let Some(sighting) = ball {
                self.wandered |= self
                    .last_seen
                    .is_some_and(|last| !is_same_place(&last, &sighting));
                self.last_seen = Some(sighting);
                return Ok(Some(sighting));
            }
        }
        Ok(None)
    }

    fn frozen(&self) -> AgentError {
        AgentError::FrozenCamera {
            looks: self.watch.same() + 1,
        }
    }

    fn tell(&mut self, kind: EventKind, frame: Option<&GrayImage>) {
        (self.observe)(&Event {
            cycle: self.cycles,
            kind,
            joints: self.joints,
            frame,
        });
    }
}

/// A detector may be anyone's: what is not a number is no ball.
fn is_finite(sighting: &Sighting) -> bool {
    let f = sighting.features;
    f.x.is_finite() && f.y.is_finite() && f.r.is_finite() && f.r > 0.0
}

/// Indices of `poses`, the one whose first joint is nearest to that of `joints` first.
fn nearest_first(poses: &[Joints], joints: &Joints) -> Vec<usize> {
    let mut order: Vec<usize> = (0..poses.len()).collect();
    order.sort_by(|&a, &b| {
        let pan = |pose: usize| (poses[pose].0[0] - joints.0[0]).abs();
        pan(a).total_cmp(&pan(b))
    });
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn search_begins_at_the_nearest_pan_angle() {
        let poses: Vec<Joints> = [-75.0, -50.0, -25.0, 0.0, 25.0, 50.0]
            .map(|p| Joints::from_degrees([p, 0.0, 0.0, 0.0, 0.0, 0.0]))
            .into();
        let at = Joints::from_degrees([20.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(nearest_first(&poses, &at), [4, 3, 5, 2, 1, 0]);
    }
}
