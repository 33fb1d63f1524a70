//! The controller as a whole: its clock, its terminal, its arm and what happens in which order.

use std::collections::{BTreeMap, VecDeque};
use std::fmt;
use std::time::Duration;

use crate::emulator::console::mode::Mode;
use crate::emulator::console::terminal::{Terminal, Typed};
use crate::emulator::language::place::Place;
use crate::emulator::machine::arm::Arm;
use crate::emulator::machine::job::Job;
use crate::emulator::machine::memory::Memory;
use crate::emulator::machine::reaction::Reaction;
use crate::emulator::machine::scope::View;
use crate::emulator::machine::signals::Signals;
use crate::emulator::message::{Fault, Message};
use crate::emulator::profile::Profile;
use crate::joints::{Joint, Joints};
use crate::kinematics::params::PumaParams;
use crate::manipulator::Gripper;

/// Event in the controller or at the arm.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Event {
    /// The controller was started, or started again.
    Started,
    /// Arm power went on or off.
    ArmPower(bool),
    /// The arm found its joint angles.
    Calibrated,
    /// A motion began, from a stand or out of the motion before it.
    MotionStarted,
    /// The arm came to a stand.
    MotionEnded,
    /// A motion was broken off before its end.
    MotionBrokenOff,
    /// The hand opened or closed.
    Gripper(Gripper),
    /// An output signal was set.
    Output {
        /// Number of the signal.
        signal: u16,
        /// New state.
        on: bool,
    },
    /// A message went to the terminal in asterisks.
    Refused(Fault),
    /// A program was started.
    ProgramStarted(String),
    /// A program ended: [`Message::Completed`], [`Message::Aborted`] and the like.
    ProgramEnded(Message),
    /// A file was written to the floppy disk.
    FileStored(String),
    /// A file was deleted from the floppy disk.
    FileDeleted(String),
    /// A character was lost because the input buffer was full.
    CharacterLost,
}

/// Most events kept until they are taken; older ones are dropped.
const EVENT_LIMIT: usize = 1024;

/// Most steps of its own that the emulator takes in one call. [`Emulator::next_deadline`] then says
/// that more is due.
const STEPS_PER_CALL: usize = 20_000;

/// A sensor: a function of the arm's joint angles.
pub(super) type Sense = Box<dyn FnMut(&Joints) -> bool + Send>;

/// An emulated VAL II controller with a PUMA 560.
///
/// [`Emulator::feed`] takes bytes from the terminal; it and [`Emulator::poll`] return bytes to the
/// terminal. The caller gives the time, a duration since any origin, which never runs backwards (an
/// earlier time counts as the latest seen). [`Emulator::next_deadline`] returns the time of the
/// next thing that happens without input. Wait that long, and the emulator runs in real time; call
/// [`Emulator::poll`] with that time at once, and it runs as fast as the machine.
///
/// ```
/// use puma_val2::{Emulator, Profile, PumaParams};
/// use std::time::Duration;
///
/// let mut controller = Emulator::new(PumaParams::unimation(), Profile::val2());
/// let mut said = controller.feed(b"N\rN\r", Duration::ZERO);
/// said.extend(controller.feed(b"where\r", Duration::ZERO));
/// let said = String::from_utf8_lossy(&said);
/// assert!(said.contains("JT1") && said.contains("  -90.000   90.000"));
/// ```
pub struct Emulator {
    pub(super) profile: Profile,
    pub(super) now: Duration,
    pub(super) terminal: Terminal,
    pub(super) mode: Mode,
    pub(super) arm: Arm,
    pub(super) memory: Memory,
    pub(super) signals: Signals,
    pub(super) job: Option<Job>,
    /// Job that `PROCEED` and `RETRY` continue.
    pub(super) paused: Option<Job>,
    /// Process-control program that runs beside the job, and one that `PCPROCEED` continues.
    pub(super) process: Option<Job>,
    pub(super) process_paused: Option<Job>,
    pub(super) reactions: Vec<Reaction>,
    /// Program that `REACTE` calls after a fault.
    pub(super) on_fault: Option<String>,
    pub(super) sensors: Vec<(u16, Sense)>,
    pub(super) next_tick: Duration,
    pub(super) monitor_ready: Duration,
    pub(super) panel_used: bool,
    pub(super) executed_last: Option<String>,
    pub(super) edited_last: Option<String>,
    /// The last `TYPE` left its line open.
    pub(super) type_stays: bool,
    pub(super) switches: BTreeMap<String, bool>,
    pub(super) floppy: BTreeMap<String, String>,
    pub(super) events: VecDeque<Event>,
}

impl fmt::Debug for Emulator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Emulator")
            .field("profile", &self.profile.name)
            .field("now", &self.now)
            .field("mode", &self.mode)
            .field("joints", &self.arm.joints())
            .finish_non_exhaustive()
    }
}

impl Emulator {
    /// Creates a controller that has just been switched on. [`Emulator::poll`] returns its first
    /// start-up question.
    pub fn new(params: PumaParams, profile: Profile) -> Self {
        let mut emulator = Self {
            arm: Arm::new(params, &profile),
            profile,
            now: Duration::ZERO,
            terminal: Terminal::new(),
            mode: Mode::Monitor,
            memory: Memory::default(),
            signals: Signals::default(),
            job: None,
            paused: None,
            process: None,
            process_paused: None,
            reactions: Vec::new(),
            on_fault: None,
            sensors: Vec::new(),
            next_tick: Duration::ZERO,
            monitor_ready: Duration::ZERO,
            panel_used: false,
            executed_last: None,
            edited_last: None,
            type_stays: false,
            switches: BTreeMap::new(),
            floppy: BTreeMap::new(),
            events: VecDeque::new(),
        };
        emulator.boot(0);
        emulator.note(Event::Started);
        emulator
    }

    /// Takes bytes from the terminal at time `now` and returns what goes out by then.
    pub fn feed(&mut self, bytes: &[u8], now: Duration) -> Vec<u8> {
        // What was due before the bytes came happens before them.
        self.advance(now);
        self.terminal.arrive(bytes, self.now, &self.profile);
        self.poll(now)
    }

    /// Lets time pass until `now` and returns what goes out by then.
    pub fn poll(&mut self, now: Duration) -> Vec<u8> {
        self.advance(now);
        self.terminal.departed(self.now, &self.profile)
    }

    /// Returns the time of the next thing that happens without further input, if any.
    pub fn next_deadline(&self) -> Option<Duration> {
        let out = self.terminal.next_departure(&self.profile);
        [self.next_step(), out].into_iter().flatten().min()
    }

    /// Returns the time up to which the controller has lived.
    pub fn now(&self) -> Duration {
        self.now
    }

    /// Lets time pass without taking output.
    pub(crate) fn advance(&mut self, now: Duration) {
        let now = now.max(self.now);
        for _ in 0..STEPS_PER_CALL {
            match self.next_step() {
                Some(at) if at <= now => {
                    self.now = self.now.max(at);
                    self.step();
                }
                _ => {
                    self.now = now;
                    self.arm.advance(now);
                    return;
                }
            }
        }
    }

    /// Returns the time of the next thing to do, output aside.
    fn next_step(&self) -> Option<Duration> {
        let line = (self.terminal.has_line() && self.takes_lines()).then_some(self.monitor_ready);
        let tick = (self.arm.moving() && self.watches()).then_some(self.next_tick);
        let due = |job: &Option<Job>| job.as_ref().and_then(|job| self.job_due(job));
        [
            self.terminal.next_arrival(),
            self.arm.motion_end(),
            line,
            tick,
            due(&self.job),
            due(&self.process),
        ]
        .into_iter()
        .flatten()
        .min()
        .map(|at| at.max(self.now))
    }

    /// Does what is due at `self.now`: one thing of each kind.
    fn step(&mut self) {
        if let Some(outcome) = self.arm.advance(self.now) {
            self.motion_ended(outcome);
        }
        if self.arm.moving() && self.watches() && self.next_tick <= self.now {
            self.next_tick = self.now + self.profile.tick.max(Duration::from_millis(1));
            self.sense();
            self.check_reactions();
        }
        match self.terminal.take_character(self.now, &self.profile) {
            None | Some(Typed::Nothing) => {}
            Some(Typed::Line) => self.line_complete(),
            Some(Typed::Cancel) => self.cancel(),
            Some(Typed::EndOfInput) => self.end_of_input(),
            Some(Typed::Lost) => self.note(Event::CharacterLost),
        }
        if self.takes_lines()
            && self.monitor_ready <= self.now
            && let Some(line) = self.terminal.next_line()
        {
            self.monitor_ready = self.now + self.profile.line_time;
            self.line(&line);
        }
        self.run_job();
        self.run_process();
    }

    /// Returns `true` if sensors or reactions have to be looked at while the arm moves.
    fn watches(&self) -> bool {
        !self.sensors.is_empty() || !self.reactions.is_empty()
    }

    pub(super) fn sense(&mut self) {
        let joints = self.arm.joints();
        for (signal, sense) in &mut self.sensors {
            // The number was checked when the sensor was attached.
            let _ = self.signals.set(*signal, sense(&joints));
        }
    }

    pub(super) fn scope(&self) -> View<'_> {
        View {
            memory: &self.memory,
            signals: &self.signals,
            arm: &self.arm,
            profile: &self.profile,
            now: self.now,
        }
    }

    pub(super) fn note(&mut self, event: Event) {
        if self.events.len() >= EVENT_LIMIT {
            self.events.pop_front();
        }
        self.events.push_back(event);
    }

    /// Returns the events since the last call, oldest first.
    pub fn take_events(&mut self) -> Vec<Event> {
        self.events.drain(..).collect()
    }

    /// Returns the arm's true joint angles at [`Emulator::now`].
    pub fn joints(&self) -> Joints {
        self.arm.joints()
    }

    /// Returns `true` while the arm moves.
    pub fn moving(&self) -> bool {
        self.arm.moving()
    }

    /// Returns the state of the hand.
    pub fn gripper(&self) -> Gripper {
        self.arm.gripper
    }

    /// Returns the arm's geometry and limits.
    pub fn params(&self) -> &PumaParams {
        &self.arm.params
    }

    /// Presses the ARM POWER button, or the emergency stop. Without power a motion stops at once
    /// and the brakes hold the arm.
    pub fn set_arm_power(&mut self, on: bool) {
        self.panel_used = true;
        self.switch_power(on);
        if !on && self.arm.moving() {
            self.arm.break_off(self.now, Duration::ZERO);
            self.fail_job(Message::ArmPowerOff.into());
        }
    }

    pub(super) fn switch_power(&mut self, on: bool) {
        if self.arm.power != on {
            self.arm.power = on;
            self.note(Event::ArmPower(on));
        }
    }

    /// Lets the servo of `joint` fail: the motion stops at once with an envelope error, and arm
    /// power goes off.
    pub fn envelope_error(&mut self, joint: Joint) {
        self.arm.break_off(self.now, Duration::ZERO);
        self.switch_power(false);
        self.fail_job(Fault::at(Message::EnvelopeError, joint));
    }

    /// Switches the controller off and on again. The arm stays, memory is kept, calibration is
    /// lost, and the start-up dialogue begins.
    pub fn restart(&mut self) {
        let (joints, gripper) = (self.arm.joints(), self.arm.gripper);
        self.arm = Arm::new(self.arm.params, &self.profile);
        self.arm.put(joints);
        self.arm.gripper = gripper;
        self.terminal = Terminal::new();
        self.job = None;
        self.paused = None;
        self.process = None;
        self.process_paused = None;
        self.reactions.clear();
        self.panel_used = false;
        self.terminal.print(self.profile.eol, self.now);
        self.boot(0);
        self.note(Event::Started);
    }

    /// Writes text to the terminal unasked, as a fault or a second operator would.
    pub fn interject(&mut self, text: &str) {
        self.terminal.print(text, self.now);
    }

    /// Returns the state of a signal: 1 to 64 outputs, 1001 to 1064 inputs, 2001 to 2064 soft
    /// signals.
    ///
    /// # Errors
    /// [`Message::IllegalSignal`] for any other number.
    pub fn signal(&self, number: u16) -> Result<bool, Fault> {
        self.signals.get(number)
    }

    /// Sets a signal from outside, an input for instance.
    ///
    /// # Errors
    /// [`Message::IllegalSignal`] for a number that no signal has.
    pub fn set_signal(&mut self, number: u16, on: bool) -> Result<(), Fault> {
        self.signals.set(number, on)?;
        self.check_reactions();
        Ok(())
    }

    /// Connects a sensor to an input. `sense` is called every trajectory tick while the arm moves,
    /// when it has come to a stand, and before a step of a program or a line of the monitor.
    ///
    /// # Errors
    /// [`Message::IllegalSignal`] for a number that no signal has.
    pub fn attach_sensor(
        &mut self,
        signal: u16,
        sense: impl FnMut(&Joints) -> bool + Send + 'static,
    ) -> Result<(), Fault> {
        self.signals.get(signal)?;
        self.sensors.retain(|(number, _)| *number != signal);
        self.sensors.push((signal, Box::new(sense)));
        self.sense();
        Ok(())
    }

    /// Returns the value of a real variable.
    pub fn real(&self, name: &str) -> Option<f64> {
        self.memory.reals.get(name).copied()
    }

    /// Returns the value of a location. The name of a precision point begins with `#`.
    pub fn place(&self, name: &str) -> Option<Place> {
        self.memory.places.get(name).copied()
    }
}
