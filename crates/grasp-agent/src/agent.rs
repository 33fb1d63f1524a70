//! The controller: search, reach, recover, grip, as one explicit state machine.

use hough_heuristic::image::GrayImage;
use puma_val2::{Gripper, JointDelta, Joints, Manipulator, ProximitySensor};
use qtable::{Action, State};

use crate::behaviour::Episode;
use crate::{AgentConfig, AgentError, Behaviour, Event, EventKind, Eye, GaveUp, Percept, Sighting};

/// The controller of the paper (section 2.2): two learned behaviours and the modules around them.
#[derive(Clone, Debug)]
pub struct Agent {
    config: AgentConfig,
    centering: Behaviour,
    approaching: Behaviour,
}

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// `None` when the gripper has closed at the goal; otherwise why it has not.
    pub gave_up: Option<GaveUp>,
    /// Moves after the first sighting, recovery moves included, the grip not.
    pub cycles: usize,
    /// How often the ball was lost.
    pub losses: usize,
    /// The ball as it was last seen.
    pub last_seen: Option<Sighting>,
    /// Where the arm stands.
    pub joints: Joints,
}

/// Where the state machine stands.
#[derive(Clone, Copy, Debug)]
enum Phase {
    /// Looking around from the search poses.
    Search,
    /// The ball is in view.
    Reach(Sighting),
    /// The ball was in view from this pose and is not any more.
    Recover(Joints),
    /// The ball is where it should be.
    Grip,
    /// Over, without a grip where there is a reason.
    End(Option<GaveUp>),
}

impl Agent {
    /// A controller with two learned behaviours.
    ///
    /// # Errors
    /// [`AgentError::Config`] for settings that cannot work.
    pub fn new(
        config: AgentConfig,
        centering: Behaviour,
        approaching: Behaviour,
    ) -> Result<Self, AgentError> {
        config.check()?;
        Ok(Self {
            config,
            centering,
            approaching,
        })
    }

    /// The settings.
    pub fn config(&self) -> &AgentConfig {
        &self.config
    }

    /// Searches the ball, reaches it and closes the gripper on it.
    ///
    /// Every event goes to `observe` as it happens. The gripper is opened first.
    ///
    /// # Errors
    /// The camera or the arm failing. The arm is told to stop before the error is returned.
    pub fn run(
        &self,
        eye: &mut dyn Eye,
        arm: &mut dyn Manipulator,
        proximity: &mut dyn ProximitySensor,
        observe: &mut dyn FnMut(&Event<'_>),
    ) -> Result<Outcome, AgentError> {
        let mut run = Run {
            config: &self.config,
            centering: Memory::new(&self.centering),
            approaching: Memory::new(&self.approaching),
            eye,
            proximity,
            observe,
            joints: Joints::default(),
            cycles: 0,
            losses: 0,
            last_seen: None,
            arm,
        };
        let result = run.until_done();
        if result.is_err() {
            // The first error is the one to report; stopping is all that can still be done.
            let _ = run.arm.stop();
        }
        result
    }
}

/// One behaviour during one run.
struct Memory<'a> {
    behaviour: &'a Behaviour,
    episode: Episode,
    chosen: Option<(State, Action)>,
}

impl<'a> Memory<'a> {
    fn new(behaviour: &'a Behaviour) -> Self {
        Self {
            behaviour,
            episode: Episode::new(behaviour),
            chosen: None,
        }
    }

    /// The move that the behaviour wants, none at its goal; `Err` when every move is barred.
    fn choose(
        &mut self,
        percept: &Percept,
        kappa: f64,
        admitted: impl Fn(JointDelta) -> bool,
    ) -> Result<JointDelta, GaveUp> {
        self.chosen = None;
        let spec = self.behaviour.spec();
        if spec.at_goal(percept) {
            return Ok(JointDelta::default());
        }
        let choice = spec.state(percept).ok().and_then(|state| {
            let allowed = |action| admitted(spec.delta(action));
            Some((
                state,
                self.behaviour.choose(state, &self.episode, kappa, allowed)?,
            ))
        });
        let (state, action) = choice.ok_or(GaveUp::NoMoveLeft)?;
        self.chosen = Some((state, action));
        self.episode.chose(state, action);
        Ok(spec.delta(action))
    }

    fn lost(&mut self) {
        if let Some((state, action)) = self.chosen {
            self.episode.lost_by(state, action);
        }
    }
}

/// A run under way.
struct Run<'a> {
    config: &'a AgentConfig,
    centering: Memory<'a>,
    approaching: Memory<'a>,
    eye: &'a mut dyn Eye,
    arm: &'a mut dyn Manipulator,
    proximity: &'a mut dyn ProximitySensor,
    observe: &'a mut dyn FnMut(&Event<'_>),
    joints: Joints,
    cycles: usize,
    losses: usize,
    last_seen: Option<Sighting>,
}

impl Run<'_> {
    fn until_done(&mut self) -> Result<Outcome, AgentError> {
        self.joints = self.arm.joints()?;
        self.arm.set_gripper(Gripper::Open)?;
        let mut phase = Phase::Search;
        loop {
            phase = match phase {
                Phase::Search => self.search()?,
                Phase::Reach(sighting) => self.reach(sighting)?,
                Phase::Recover(last) => self.recover(last)?,
                Phase::Grip => self.grip()?,
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

    /// Looks around from the search poses, the nearest pan angle first.
    fn search(&mut self) -> Result<Phase, AgentError> {
        for pose in nearest_first(&self.config.search_poses, &self.joints) {
            if !self.go_to(self.config.search_poses[pose])? {
                continue;
            }
            self.tell(EventKind::AtSearchPose(pose), None);
            if let Some(sighting) = self.look()? {
                return Ok(Phase::Reach(sighting));
            }
        }
        Ok(Phase::End(Some(GaveUp::NotFound)))
    }

    /// One control cycle: percept, both behaviours, one joint move, next percept.
    fn reach(&mut self, sighting: Sighting) -> Result<Phase, AgentError> {
        let percept = Percept::new(sighting.features, &self.joints);
        if self.config.goal.iter().all(|interval| interval.holds(&percept)) {
            self.tell(EventKind::AtGoal, None);
            return Ok(Phase::Grip);
        }
        if self.cycles >= self.config.max_cycles {
            return Ok(Phase::End(Some(GaveUp::OutOfCycles)));
        }
        let (config, from) = (self.config, self.joints);
        let admitted = |delta: JointDelta| config.admits(&(from + delta));
        let turn = self.centering.choose(&percept, config.centering_kappa, admitted);
        let reach = self
            .approaching
            .choose(&percept, config.approaching_kappa, admitted);
        let delta = match (turn, reach) {
            (Ok(turn), Ok(reach)) => JointDelta(std::array::from_fn(|i| turn.0[i] + reach.0[i])),
            (Err(reason), _) | (_, Err(reason)) => return Ok(Phase::End(Some(reason))),
        };

        self.cycles += 1;
        self.joints = self.arm.move_by(delta)?;
        self.tell(EventKind::Moved(delta), None);
        if !self.clear_or_back(from)? {
            self.centering.lost();
            self.approaching.lost();
        }
        if let Some(sighting) = self.look()? {
            return Ok(Phase::Reach(sighting));
        }
        self.losses += 1;
        self.centering.lost();
        self.approaching.lost();
        self.tell(EventKind::Lost, None);
        Ok(Phase::Recover(from))
    }

    /// Back to where the ball was last seen, then the recovery moves around that pose, then a new search.
    fn recover(&mut self, last: Joints) -> Result<Phase, AgentError> {
        let around = self.config.recovery.iter().map(|delta| last + *delta);
        for (attempt, pose) in std::iter::once(last).chain(around).enumerate() {
            if self.cycles >= self.config.max_cycles {
                return Ok(Phase::End(Some(GaveUp::OutOfCycles)));
            }
            if !self.config.admits(&pose) {
                continue;
            }
            self.cycles += 1;
            let clear = self.go_to(pose)?;
            self.tell(EventKind::Recovering(attempt), None);
            if clear && let Some(sighting) = self.look()? {
                return Ok(Phase::Reach(sighting));
            }
        }
        Ok(Phase::Search)
    }

    /// The paper's activation of the gripper: the fifth joint, then the jaws.
    fn grip(&mut self) -> Result<Phase, AgentError> {
        let from = self.joints;
        self.joints = self.arm.move_by(self.config.grip)?;
        if !self.clear_or_back(from)? {
            return Ok(Phase::End(Some(GaveUp::Obstructed)));
        }
        self.arm.set_gripper(Gripper::Closed)?;
        self.tell(EventKind::Gripped, None);
        Ok(Phase::End(None))
    }

    /// Moves to `target`; false when something came too near there, and the arm has gone back.
    fn go_to(&mut self, target: Joints) -> Result<bool, AgentError> {
        let from = self.joints;
        self.joints = self.arm.move_to(target)?;
        self.clear_or_back(from)
    }

    /// Whether nothing is too near; otherwise the arm stops and goes back to `from`.
    fn clear_or_back(&mut self, from: Joints) -> Result<bool, AgentError> {
        if !self.proximity.object_near()? {
            return Ok(true);
        }
        self.arm.stop()?;
        self.joints = self.arm.move_to(from)?;
        self.tell(EventKind::TooNear, None);
        Ok(false)
    }

    /// Looks, a few times if need be, for the ball from where the arm stands.
    fn look(&mut self) -> Result<Option<Sighting>, AgentError> {
        for _ in 0..self.config.looks {
            let look = self.eye.look()?;
            if let Some(sighting) = look.ball {
                self.last_seen = Some(sighting);
                self.tell(EventKind::Seen(sighting), look.frame.as_ref());
                return Ok(Some(sighting));
            }
            self.tell(EventKind::NotSeen, look.frame.as_ref());
        }
        Ok(None)
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
