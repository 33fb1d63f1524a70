//! The event log: what happened in a run, kept, and run again.

use std::cell::RefCell;

use hough_heuristic::FrameError;
use hough_heuristic::image::{GrayImage, Luma};
use puma_val2::{ArmError, Gripper, JointDelta, Joints, Manipulator, ProximitySensor};

use crate::controller::Controller;
use crate::error::AgentError;
use crate::run::agent::Agent;
use crate::run::event::{Event, EventKind, Order, Outcome};
use crate::sight::eye::{Eye, Look};

/// An [`Event`] without its frame.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LoggedEvent {
    /// How many moves had been made since the ball was first seen.
    pub cycle: usize,
    /// What happened.
    #[cfg_attr(feature = "serde", serde(with = "crate::record::numbers"))]
    pub kind: EventKind,
    /// Where the arm stood, as it reported.
    #[cfg_attr(feature = "serde", serde(with = "crate::record::numbers"))]
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

    /// Lets `agent` make the run again, with the arm, the sensors and the eye answering as they did
    /// then, and returns the log of that. The same controller with the same knowledge makes the
    /// same log.
    ///
    /// # Errors
    /// [`AgentError::Replay`] when the agent does something else than was done then; otherwise what
    /// the run ended with, if it ended with an error.
    pub fn replay<C: Controller + Clone>(
        &self,
        agent: &Agent<C>,
    ) -> Result<(Outcome, Self), AgentError> {
        let Played { end, log, differs } = self.play(agent.clone());
        match (differs, end) {
            (Some(event), _) => Err(AgentError::Replay { event }),
            (None, end) => Ok((end?, log)),
        }
    }

    /// Lets `agent` make the run again, whatever comes of it.
    pub(crate) fn play<C: Controller>(&self, agent: Agent<C>) -> Played {
        let tape = RefCell::new(Tape {
            events: &self.events,
            next: 0,
            frame: 0,
        });
        let mut log = Self::default();
        let end = agent.having_seen(numbered(0)).run_and_learn(
            &mut Player(&tape),
            &mut Player(&tape),
            &mut Player(&tape),
            &mut |event| {
                log.note(event);
            },
        );
        let differs = log
            .events
            .iter()
            .zip(&self.events)
            .position(|(now, then)| !same(now, then));
        let differs = differs.or((log.events.len() != self.events.len())
            .then(|| log.events.len().min(self.events.len())));
        Played { end, log, differs }
    }
}

/// A run, made again.
pub(crate) struct Played {
    pub(crate) end: Result<Outcome, AgentError>,
    pub(crate) log: EventLog,
    /// The first event that was another one then.
    pub(crate) differs: Option<usize>,
}

/// Whether two events are the same. A failure of camera or arm comes back in the words of the
/// replayed device, which quote those of then.
fn same(now: &LoggedEvent, then: &LoggedEvent) -> bool {
    match (&now.kind, &then.kind) {
        (EventKind::Failed(cause), EventKind::Failed(cause_then)) => {
            now.cycle == then.cycle
                && alike(&now.joints, &then.joints)
                && same_cause(cause, cause_then)
        }
        _ => alike(now, then),
    }
}

/// Whether two values are equal, NaN being equal to NaN. In debug format every other number has a
/// text of its own.
fn alike<T: PartialEq + std::fmt::Debug>(now: &T, then: &T) -> bool {
    now == then || format!("{now:?}") == format!("{then:?}")
}

/// Whether `now` is what ended the run `then`: the same words, or the same device failing again.
fn same_cause(now: &str, then: &str) -> bool {
    let quoted =
        |by: Device| by.failed_in(then) && now == by.silence(failed_then(then)).to_string();
    now == then || quoted(Device::Camera) || quoted(Device::Arm)
}

/// What a replayed device says when it is asked for the answer that failed.
fn failed_then(cause: &str) -> String {
    format!("this failed then: {cause}")
}

/// Who failed.
#[derive(Clone, Copy)]
enum Device {
    Camera,
    Arm,
}

impl Device {
    /// Whether `cause` begins as the errors of this device do.
    fn failed_in(self, cause: &str) -> bool {
        let words = self.silence(String::new()).to_string();
        let begin = words.split_inclusive(": ").next();
        begin.is_some_and(|begin| cause.starts_with(begin))
    }

    /// The error of a device that has no answer, with the reason.
    fn silence(self, reason: String) -> AgentError {
        match self {
            Self::Camera => AgentError::Camera(unseen(reason)),
            Self::Arm => AgentError::Arm(unmoved(reason)),
        }
    }
}

fn unseen(reason: String) -> FrameError {
    FrameError::Failed {
        origin: NAME.into(),
        reason,
    }
}

fn unmoved(reason: String) -> ArmError {
    ArmError::Refused {
        port: NAME.into(),
        sent: "an order".into(),
        message: reason,
    }
}

/// A frame that differs from that of every other number: what there was to see is not in the log,
/// only whether it was the same.
pub(crate) fn numbered(number: u32) -> GrayImage {
    GrayImage::from_fn(4, 1, |x, _| Luma([number.to_le_bytes()[x as usize]]))
}

/// The answers of then, as a tape that plays on.
struct Tape<'a> {
    events: &'a [LoggedEvent],
    next: usize,
    /// Number of the frame shown last.
    frame: u32,
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
            Some(EventKind::Failed(cause)) => failed_then(cause),
            _ => "the log ends here".into(),
        }
    }

    /// Whether the next event is `kind`; moves on only if so.
    fn next_if(&mut self, kind: &EventKind) -> bool {
        let next = self
            .events
            .get(self.next)
            .is_some_and(|event| event.kind == *kind);
        self.next += usize::from(next);
        next
    }

    /// Fails if the next thing that happened was that the sensors on the arm did: their answers
    /// make no event of their own.
    fn sensors_hold(&self) -> Result<(), ArmError> {
        match self.events.get(self.next).map(|event| &event.kind) {
            Some(EventKind::Failed(cause)) if Device::Arm.failed_in(cause) => {
                Err(unmoved(self.silence()))
            }
            _ => Ok(()),
        }
    }

    /// Fails if the next thing that happened was that this order was not answered: of the orders
    /// that make no event when they succeed.
    fn answers(&self, order: Order) -> Result<(), ArmError> {
        match self.events.get(self.next).map(|event| &event.kind) {
            Some(EventKind::Unanswered(then)) if *then == order => Err(unmoved(self.silence())),
            _ => Ok(()),
        }
    }
}

/// Whether an event tells what arm or eye answered; the others follow from those.
fn is_answer(kind: &EventKind) -> bool {
    !matches!(
        kind,
        EventKind::Searching
            | EventKind::Reaching
            | EventKind::SameFrame
            | EventKind::Lost
            | EventKind::TooFast
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

/// Arm, sensors and eye of then.
struct Player<'a, 'b>(&'a RefCell<Tape<'b>>);

/// What the devices of a replay are called in messages.
const NAME: &str = "replayed event log";

impl Player<'_, '_> {
    fn stand(&self) -> Result<Joints, ArmError> {
        let mut tape = self.0.borrow_mut();
        match tape.answer() {
            Some(event) => Ok(event.joints),
            None => Err(unmoved(tape.silence())),
        }
    }
}

impl Manipulator for Player<'_, '_> {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        // Asked before anything happens. An arm that failed after it had told where it stands has
        // told it all the same.
        let tape = self.0.borrow();
        match tape.events.first() {
            Some(LoggedEvent { kind, joints, .. })
                if !matches!(kind, EventKind::Failed(_)) || *joints != Joints::default() =>
            {
                Ok(*joints)
            }
            _ => Err(unmoved(tape.silence())),
        }
    }

    fn move_by(&mut self, _delta: JointDelta) -> Result<Joints, ArmError> {
        self.stand()
    }

    fn move_to(&mut self, _target: Joints) -> Result<Joints, ArmError> {
        self.stand()
    }

    fn set_gripper(&mut self, gripper: Gripper) -> Result<(), ArmError> {
        let mut tape = self.0.borrow_mut();
        tape.answers(Order::Jaws {
            close: gripper == Gripper::Closed,
        })?;
        // The opened gripper begins the run.
        tape.next_if(&EventKind::Started);
        Ok(())
    }

    fn stop(&mut self) -> Result<(), ArmError> {
        self.0.borrow().answers(Order::Stop)
    }
}

impl ProximitySensor for Player<'_, '_> {
    fn object_near(&mut self) -> Result<bool, ArmError> {
        let mut tape = self.0.borrow_mut();
        tape.sensors_hold()?;
        // What was too near made no event where the arm could not be stopped.
        Ok(tape.next_if(&EventKind::TooNear) || tape.answers(Order::Stop).is_err())
    }
}

impl Eye for Player<'_, '_> {
    fn look(&mut self) -> Result<Look, FrameError> {
        let mut tape = self.0.borrow_mut();
        let ball = match tape.answer().map(|event| event.kind) {
            Some(EventKind::Seen(sighting)) => Some(sighting),
            Some(EventKind::NotSeen) => None,
            _ => return Err(unseen(tape.silence())),
        };
        if !tape.next_if(&EventKind::SameFrame) {
            tape.frame = tape.frame.wrapping_add(1);
        }
        Ok(Look {
            frame: Some(numbered(tape.frame)),
            ball,
        })
    }
}
