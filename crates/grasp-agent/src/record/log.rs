//! The event log of a run, and its replay.

use std::cell::RefCell;

use hough_heuristic::FrameError;
use hough_heuristic::image::{GrayImage, Luma};
use puma_val2::{ArmError, Gripper, JointDelta, Joints, Manipulator, ProximitySensor};
use serde::{Deserialize, Serialize};

use crate::controller::Controller;
use crate::error::AgentError;
use crate::percept::Sighting;
use crate::run::agent::Agent;
use crate::run::event::{EventKind, RunEvent, RunOutcome};
use crate::run::state_machine::{STOP, jaws_order};
use crate::sight::eye::Eye;

/// Events of a run, in order, without the frames.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EventLog {
    /// The events, oldest first.
    pub events: Vec<RunEvent<'static>>,
}

impl EventLog {
    /// Records an event.
    pub fn note(&mut self, event: &RunEvent<'_>) {
        self.events.push(event.logged());
    }

    /// Repeats the run with a copy of `agent` and the recorded answers of arm, sensors and camera.
    /// Returns the outcome and the new log, which equals this one for an equal controller.
    ///
    /// # Errors
    /// [`AgentError::Replay`] at the first event that differs; otherwise the error that the run
    /// ended with, if any.
    pub fn replay<C: Controller + Clone>(
        &self,
        agent: &Agent<C>,
    ) -> Result<(RunOutcome, Self), AgentError> {
        self.replay_by(agent.clone())
    }

    pub(crate) fn replay_by<C: Controller>(
        &self,
        agent: Agent<C>,
    ) -> Result<(RunOutcome, Self), AgentError> {
        let tape = RefCell::new(Tape {
            events: &self.events,
            next: 0,
            frame: 0,
        });
        let mut log = Self::default();
        let end = agent.having_seen(numbered(0)).run_and_learn(
            &mut Player::new(&tape),
            &mut Player::new(&tape),
            &mut Player::new(&tape),
            &mut |event| log.note(event),
        );
        let events = log.events.len().max(self.events.len());
        let [now, then] = [&log, self].map(|log| move |event: usize| log.events.get(event));
        match (0..events).find(|event| !alike(&now(*event), &then(*event))) {
            Some(event) => Err(AgentError::Replay {
                event,
                then: then(event).cloned().map(Box::new),
                now: now(event).cloned().map(Box::new),
            }),
            None => Ok((end?, log)),
        }
    }
}

/// Compares two values, NaN being equal to NaN: in debug format every other number has a distinct
/// text.
fn alike<T: PartialEq + std::fmt::Debug>(now: &T, then: &T) -> bool {
    now == then || format!("{now:?}") == format!("{then:?}")
}

/// Returns a small frame that is distinct for each number. The log holds no frames, only whether
/// two were equal.
pub(crate) fn numbered(number: u32) -> GrayImage {
    GrayImage::from_fn(4, 1, |x, _| Luma([number.to_le_bytes()[x as usize]]))
}

/// Recorded answers, consumed in order.
struct Tape<'a> {
    events: &'a [RunEvent<'static>],
    next: usize,
    /// Number of the latest frame.
    frame: u32,
}

impl Tape<'_> {
    /// Consumes events up to and including the next answer, and returns it.
    fn answer(&mut self) -> Option<RunEvent<'static>> {
        while let Some(event) = self.events.get(self.next) {
            self.next += 1;
            if is_answer(&event.kind) {
                return Some(event.clone());
            }
        }
        None
    }

    /// Returns the recorded failure of the device whose errors begin with `prefix`, or says that
    /// the record ends.
    fn silence(&self, prefix: &str) -> String {
        let fault = match self.events.last().map(|event| &event.kind) {
            Some(EventKind::Failed(cause)) => cause.strip_prefix(prefix),
            _ => None,
        };
        fault.unwrap_or("the replayed log ends here").to_owned()
    }

    fn unmoved(&self) -> ArmError {
        ArmError::Other(self.silence(ARM))
    }

    fn unseen(&self) -> FrameError {
        let fault = self.silence(CAMERA);
        match fault.split_once(": ") {
            Some((origin, reason)) => FrameError::Failed {
                origin: origin.into(),
                reason: reason.into(),
            },
            None => FrameError::End,
        }
    }

    /// Consumes the next event if it is `kind`, and returns whether it was.
    fn next_if(&mut self, kind: &EventKind) -> bool {
        let next = self
            .events
            .get(self.next)
            .is_some_and(|event| event.kind == *kind);
        self.next += usize::from(next);
        next
    }

    /// Fails if the next event is a failure of the arm: an answer of the proximity sensors makes no
    /// event of its own.
    fn sensors_hold(&self) -> Result<(), ArmError> {
        match self.events.get(self.next).map(|event| &event.kind) {
            Some(EventKind::Failed(cause)) if cause.starts_with(ARM) => Err(self.unmoved()),
            _ => Ok(()),
        }
    }

    /// Fails if the next event says that `order` was not answered. Such an order makes no event
    /// when it succeeds.
    fn answers(&self, order: &str) -> Result<(), ArmError> {
        match self.events.get(self.next).map(|event| &event.kind) {
            Some(EventKind::Unanswered(then)) if then == order => Err(self.unmoved()),
            _ => Ok(()),
        }
    }
}

/// Beginnings of the texts of [`AgentError::Camera`] and [`AgentError::Arm`].
const CAMERA: &str = "the camera failed: ";
const ARM: &str = "the arm failed: ";

/// Returns whether an event records an answer of arm or camera. The others follow from those.
fn is_answer(kind: &EventKind) -> bool {
    !matches!(
        kind,
        EventKind::Searching
            | EventKind::Reaching
            | EventKind::Late(_)
            | EventKind::SameFrame
            | EventKind::Lost
            | EventKind::TooFast
            | EventKind::Misfit(_)
            | EventKind::AtGoal
            | EventKind::Cornered
            | EventKind::Gripped
            | EventKind::Missed
            | EventKind::Grasped
            | EventKind::GaveUp(_)
            | EventKind::Unanswered(_)
            | EventKind::Failed(_)
    )
}

/// Arm, sensors and camera that give the recorded answers.
struct Player<'a, 'b> {
    tape: &'a RefCell<Tape<'b>>,
    frame: GrayImage,
}

impl<'a, 'b> Player<'a, 'b> {
    fn new(tape: &'a RefCell<Tape<'b>>) -> Self {
        Self {
            tape,
            frame: numbered(0),
        }
    }

    fn stand(&self) -> Result<Joints, ArmError> {
        let mut tape = self.tape.borrow_mut();
        let event = tape.answer();
        event
            .map(|event| event.joints)
            .ok_or_else(|| tape.unmoved())
    }
}

impl Manipulator for Player<'_, '_> {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        // The agent asks once, before the first event. An arm that fails later has answered this.
        let tape = self.tape.borrow();
        match tape.events.first() {
            Some(RunEvent { kind, joints, .. })
                if !matches!(kind, EventKind::Failed(_)) || *joints != Joints::default() =>
            {
                Ok(*joints)
            }
            _ => Err(tape.unmoved()),
        }
    }

    fn move_by(&mut self, _delta: JointDelta) -> Result<Joints, ArmError> {
        self.stand()
    }

    fn move_to(&mut self, _target: Joints) -> Result<Joints, ArmError> {
        self.stand()
    }

    fn set_gripper(&mut self, gripper: Gripper) -> Result<(), ArmError> {
        let mut tape = self.tape.borrow_mut();
        tape.answers(jaws_order(gripper))?;
        // Opening the gripper starts the run.
        tape.next_if(&EventKind::Started);
        Ok(())
    }

    fn stop(&mut self) -> Result<(), ArmError> {
        self.tape.borrow().answers(STOP)
    }
}

impl ProximitySensor for Player<'_, '_> {
    fn object_near(&mut self) -> Result<bool, ArmError> {
        let mut tape = self.tape.borrow_mut();
        tape.sensors_hold()?;
        // An arm that could not be stopped made no event for what was too near.
        Ok(tape.next_if(&EventKind::TooNear) || tape.answers(STOP).is_err())
    }
}

impl Eye for Player<'_, '_> {
    fn look(&mut self) -> Result<Option<Sighting>, FrameError> {
        let mut tape = self.tape.borrow_mut();
        let ball = match tape.answer().map(|event| event.kind) {
            Some(EventKind::Seen(ball)) => Some(ball),
            Some(EventKind::NotSeen) => None,
            Some(EventKind::Dropped) => return Ok(None),
            _ => return Err(tape.unseen()),
        };
        if !tape.next_if(&EventKind::SameFrame) {
            tape.frame = tape.frame.wrapping_add(1);
        }
        self.frame = numbered(tape.frame);
        Ok(ball)
    }

    fn frame(&self) -> Option<&GrayImage> {
        Some(&self.frame)
    }
}
