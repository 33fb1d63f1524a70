//! The event log of a run, and its replay.

use std::cell::RefCell;

use hough_heuristic::FrameError;
use hough_heuristic::image::{GrayImage, Luma};
use puma_val2::{ArmError, Gripper, JointDelta, Joints, Manipulator, ProximitySensor};

use crate::controller::Controller;
use crate::error::AgentError;
use crate::percept::Sighting;
use crate::run::agent::Agent;
use crate::run::event::{EventKind, Order, RunEvent, RunOutcome};
use crate::sight::eye::Eye;

/// Events of a run, in order, without the frames.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EventLog {
    /// The events, oldest first.
    pub events: Vec<RunEvent<'static>>,
}

impl EventLog {
    /// Records an event.
    pub fn note(&mut self, event: &RunEvent<'_>) {
        self.events.push(event.logged());
    }

    /// Repeats the run with `agent` and the recorded answers of arm, sensors and camera. Returns
    /// the outcome and the new log, which equals this one for an equal controller.
    ///
    /// # Errors
    /// [`AgentError::Replay`] at the first event that differs; otherwise the error that the run
    /// ended with, if any.
    pub fn replay<C: Controller + Clone>(
        &self,
        agent: &Agent<C>,
    ) -> Result<(RunOutcome, Self), AgentError> {
        let Played { end, log, differs } = self.play(agent.clone());
        match (differs, end) {
            (Some(event), _) => Err(AgentError::Replay { event }),
            (None, end) => Ok((end?, log)),
        }
    }

    /// Repeats the run with `agent` to its end, even if it differs.
    pub(crate) fn play<C: Controller>(&self, agent: Agent<C>) -> Played {
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

/// A repeated run.
pub(crate) struct Played {
    pub(crate) end: Result<RunOutcome, AgentError>,
    pub(crate) log: EventLog,
    /// Index of the first event that differs from the record.
    pub(crate) differs: Option<usize>,
}

/// Compares two events. A replayed device reports a failure in a text of its own that quotes the
/// recorded one.
fn same(now: &RunEvent<'_>, then: &RunEvent<'_>) -> bool {
    match (&now.kind, &then.kind) {
        (EventKind::Failed(cause), EventKind::Failed(cause_then)) => {
            now.cycle == then.cycle
                && alike(&now.joints, &then.joints)
                && same_cause(cause, cause_then)
        }
        _ => alike(now, then),
    }
}

/// Compares two values, NaN being equal to NaN: in debug format every other number has a distinct
/// text.
fn alike<T: PartialEq + std::fmt::Debug>(now: &T, then: &T) -> bool {
    now == then || format!("{now:?}") == format!("{then:?}")
}

/// Compares the cause of a failure with the recorded one: equal texts, or the replayed device's
/// quotation.
fn same_cause(now: &str, then: &str) -> bool {
    let quoted =
        |by: Device| by.failed_in(then) && now == by.silence(failed_then(then)).to_string();
    now == then || quoted(Device::Camera) || quoted(Device::Arm)
}

/// Text of a replayed device whose recorded answer was a failure.
fn failed_then(cause: &str) -> String {
    format!("this failed then: {cause}")
}

/// Device that failed.
#[derive(Clone, Copy)]
enum Device {
    Camera,
    Arm,
}

impl Device {
    /// Returns whether `cause` begins like an error of this device.
    fn failed_in(self, cause: &str) -> bool {
        let words = self.silence(String::new()).to_string();
        let begin = words.split_inclusive(": ").next();
        begin.is_some_and(|begin| cause.starts_with(begin))
    }

    /// Builds the error of a replayed device without an answer.
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

    /// Explains a missing answer: the recorded failure, or the end of the log.
    fn silence(&self) -> String {
        match self.events.last().map(|event| &event.kind) {
            Some(EventKind::Failed(cause)) => failed_then(cause),
            _ => "the log ends here".into(),
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
            Some(EventKind::Failed(cause)) if Device::Arm.failed_in(cause) => {
                Err(unmoved(self.silence()))
            }
            _ => Ok(()),
        }
    }

    /// Fails if the next event says that `order` was not answered. Such an order makes no event
    /// when it succeeds.
    fn answers(&self, order: Order) -> Result<(), ArmError> {
        match self.events.get(self.next).map(|event| &event.kind) {
            Some(EventKind::Unanswered(then)) if *then == order => Err(unmoved(self.silence())),
            _ => Ok(()),
        }
    }
}

/// Returns whether an event records an answer of arm or camera. The others follow from those.
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

/// Arm, sensors and camera that give the recorded answers.
struct Player<'a, 'b> {
    tape: &'a RefCell<Tape<'b>>,
    frame: GrayImage,
}

/// Name of the replayed devices in error texts.
const NAME: &str = "replayed event log";

impl<'a, 'b> Player<'a, 'b> {
    fn new(tape: &'a RefCell<Tape<'b>>) -> Self {
        Self {
            tape,
            frame: numbered(0),
        }
    }

    fn stand(&self) -> Result<Joints, ArmError> {
        let mut tape = self.tape.borrow_mut();
        match tape.answer() {
            Some(event) => Ok(event.joints),
            None => Err(unmoved(tape.silence())),
        }
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
        let mut tape = self.tape.borrow_mut();
        tape.answers(Order::Jaws {
            close: gripper == Gripper::Closed,
        })?;
        // Opening the gripper starts the run.
        tape.next_if(&EventKind::Started);
        Ok(())
    }

    fn stop(&mut self) -> Result<(), ArmError> {
        self.tape.borrow().answers(Order::Stop)
    }
}

impl ProximitySensor for Player<'_, '_> {
    fn object_near(&mut self) -> Result<bool, ArmError> {
        let mut tape = self.tape.borrow_mut();
        tape.sensors_hold()?;
        // An arm that could not be stopped made no event for what was too near.
        Ok(tape.next_if(&EventKind::TooNear) || tape.answers(Order::Stop).is_err())
    }
}

impl Eye for Player<'_, '_> {
    fn look(&mut self) -> Result<Option<Sighting>, FrameError> {
        let mut tape = self.tape.borrow_mut();
        let ball = match tape.answer().map(|event| event.kind) {
            Some(EventKind::Seen(ball)) => Some(ball),
            Some(EventKind::NotSeen) => None,
            _ => return Err(unseen(tape.silence())),
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
