//! The event log: what happened in a run, kept, and run again.

use std::cell::RefCell;

use hough_heuristic::FrameError;
use puma_val2::{ArmError, Gripper, JointDelta, Joints, Manipulator, ProximitySensor};

use crate::{Agent, AgentError, Controller, Event, EventKind, Eye, Look, Outcome};

/// An [`Event`] without its frame.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LoggedEvent {
    /// How many moves had been made since the ball was first seen.
    pub cycle: usize,
    /// What happened.
    pub kind: EventKind,
    /// Where the arm stood, as it reported.
    pub joints: Joints,
}

/// Every event of a run, in order.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EventLog {
    /// The events, the first one first.
    pub events: Vec<LoggedEvent>,
}

impl EventLog {
    /// Takes down an event.
    pub fn note(&mut self, event: &Event<'_>) {
        self.events.push(LoggedEvent {
            cycle: event.cycle,
            kind: event.kind.clone(),
            joints: event.joints,
        });
    }

    /// Lets `agent` make the run again, with the arm, the sensors and the eye answering as they did then, and returns the log of
    /// that. The same controller with the same knowledge makes the same log.
    ///
    /// # Errors
    /// [`AgentError::Replay`] when the agent does something else than was done then; otherwise what the run ended with, if it ended
    /// with an error.
    pub fn replay<C: Controller + Clone>(&self, agent: &Agent<C>) -> Result<(Outcome, Self), AgentError> {
        let tape = RefCell::new(Tape {
            events: &self.events,
            next: 0,
        });
        let mut log = Self::default();
        let end = agent.run(
            &mut Played(&tape),
            &mut Played(&tape),
            &mut Played(&tape),
            &mut |event| {
                log.note(event);
            },
        );
        let differs = log
            .events
            .iter()
            .zip(&self.events)
            .position(|(now, then)| !same(now, then));
        let differs = differs
            .or((log.events.len() != self.events.len()).then(|| log.events.len().min(self.events.len())));
        match (differs, end) {
            (Some(event), _) => Err(AgentError::Replay { event }),
            (None, end) => Ok((end?, log)),
        }
    }
}

/// Whether two events are the same. A failure of camera or arm comes back in other words: its type is not in the log.
fn same(now: &LoggedEvent, then: &LoggedEvent) -> bool {
    match (&now.kind, &then.kind) {
        (EventKind::Failed(_), EventKind::Failed(_)) => now.cycle == then.cycle && now.joints == then.joints,
        _ => now == then,
    }
}

/// The answers of then, as a tape that plays on.
struct Tape<'a> {
    events: &'a [LoggedEvent],
    next: usize,
}

impl Tape<'_> {
    /// The next event that was an answer, and moves on behind it.
    fn answer(&mut self) -> Option<LoggedEvent> {
        while let Some(event) = self.events.get(self.next) {
            self.next += 1;
            if is_answer(&event.kind) {
                return Some(event.clone());
            }
        }
        None
    }

    /// Why there is no answer: what the run ended with, or that the log is too short.
    fn silence(&self) -> String {
        match self.events.last().map(|event| &event.kind) {
            Some(EventKind::Failed(reason)) => format!("this failed then: {reason}"),
            _ => "the log ends here".into(),
        }
    }

    /// Whether the next answer was that something is near; moves on only if so.
    fn near(&mut self) -> bool {
        let rest = self.events.get(self.next..).unwrap_or_default();
        let near = rest.first().is_some_and(|event| event.kind == EventKind::TooNear);
        self.next += usize::from(near);
        near
    }
}

/// Whether an event tells what arm or eye answered; the others follow from those.
fn is_answer(kind: &EventKind) -> bool {
    !matches!(
        kind,
        EventKind::Searching
            | EventKind::Lost
            | EventKind::TooFast
            | EventKind::AtGoal
            | EventKind::Gripped
            | EventKind::Missed
            | EventKind::GaveUp(_)
            | EventKind::Failed(_)
    )
}

/// Arm, sensors and eye of then.
struct Played<'a, 'b>(&'a RefCell<Tape<'b>>);

/// What the devices of a replay are called in messages.
const NAME: &str = "replayed event log";

impl Played<'_, '_> {
    fn stand(&self) -> Result<Joints, ArmError> {
        let mut tape = self.0.borrow_mut();
        match tape.answer() {
            Some(event) => Ok(event.joints),
            None => Err(ArmError::Refused {
                port: NAME.into(),
                sent: "a move".into(),
                message: tape.silence(),
            }),
        }
    }
}

impl Manipulator for Played<'_, '_> {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        self.stand()
    }

    fn move_by(&mut self, _delta: JointDelta) -> Result<Joints, ArmError> {
        self.stand()
    }

    fn move_to(&mut self, _target: Joints) -> Result<Joints, ArmError> {
        self.stand()
    }

    fn set_gripper(&mut self, _gripper: Gripper) -> Result<(), ArmError> {
        Ok(())
    }

    fn stop(&mut self) -> Result<(), ArmError> {
        Ok(())
    }
}

impl ProximitySensor for Played<'_, '_> {
    fn object_near(&mut self) -> Result<bool, ArmError> {
        Ok(self.0.borrow_mut().near())
    }
}

impl Eye for Played<'_, '_> {
    fn look(&mut self) -> Result<Look, FrameError> {
        let mut tape = self.0.borrow_mut();
        match tape.answer().map(|event| event.kind) {
            Some(EventKind::Seen(sighting)) => Ok(Look {
                frame: None,
                ball: Some(sighting),
            }),
            Some(EventKind::NotSeen) => Ok(Look::default()),
            _ => Err(FrameError::Failed {
                origin: NAME.into(),
                reason: tape.silence(),
            }),
        }
    }
}
