//! Instructions carried out: at the monitor through `DO`, or step by step in a program.

use std::sync::Arc;
use std::time::Duration;

use super::arm::Speed;
use super::dialogue::Mode;
use super::expr::{Expr, Variable, is_true, whole};
use super::instruction::{Instruction, Item};
use super::place::{Place, values};
use super::program::Program;
use super::{Emulator, Event, Fault, Message, display};
use crate::{Gripper, Joint, Joints};

/// Deepest nesting of `CALL`.
const CALL_DEPTH: usize = 16;

/// Something that is being carried out.
#[derive(Debug)]
pub(super) struct Job {
    kind: JobKind,
    /// The program and those that called it, innermost last. Empty for `DO`.
    frames: Vec<Frame>,
    wait: Wait,
    next_step: Duration,
    /// Cycles left after this one; `None` for ever.
    cycles_left: Option<u32>,
    /// How it ends as soon as the arm stands.
    ending: Option<Message>,
    /// Stop after one step, for `NEXT`.
    single: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum JobKind {
    Program,
    Do,
    Calibration,
}

#[derive(Debug)]
struct Frame {
    name: String,
    program: Arc<Program>,
    step: usize,
    loops: Vec<Loop>,
}

/// A `FOR` under way.
#[derive(Debug)]
struct Loop {
    head: usize,
    key: String,
    to: f64,
    step: f64,
}

#[derive(Debug, PartialEq)]
enum Wait {
    Nothing,
    /// Until the arm stands.
    Motion,
    Until(Duration),
    Condition(Expr),
    /// Until the terminal has answered.
    Answer,
}

/// An armed `REACT` or `REACTI`.
#[derive(Clone, Debug)]
pub(super) struct Reaction {
    /// Negative: reacts when the signal is off.
    signal: f64,
    program: Option<String>,
    at_once: bool,
}

/// What carrying out an instruction leads to.
enum Flow {
    /// On to the next step.
    Next,
    /// The same step again when the arm stands.
    WhenStanding,
    /// To this step.
    Jump(usize),
    /// Wait, then on to the next step.
    Wait(Wait),
    /// Into a program.
    Call(String),
    Return,
    /// The present cycle is over.
    EndOfCycle,
    Pause,
    Halt,
}

impl Job {
    fn new(kind: JobKind, now: Duration) -> Self {
        Self {
            kind,
            frames: Vec::new(),
            wait: Wait::Nothing,
            next_step: now,
            cycles_left: Some(0),
            ending: None,
            single: false,
        }
    }

    pub(super) fn is_program(&self) -> bool {
        self.kind == JobKind::Program
    }

    /// Name and step (from 1) of the innermost program.
    pub(super) fn at(&self) -> Option<(&str, usize)> {
        self.frames.last().map(|f| (f.name.as_str(), f.step + 1))
    }

    pub(super) fn cycles_left(&self) -> Option<u32> {
        self.cycles_left
    }

    /// The signal that a `WAIT` waits for may come; show what it waits for.
    pub(super) fn waits(&self) -> bool {
        matches!(self.wait, Wait::Condition(_) | Wait::Answer)
    }
}

impl Emulator {
    fn step_time(&self) -> Duration {
        self.profile.step_time.max(Duration::from_micros(100))
    }

    /// When the job goes on of itself.
    pub(super) fn job_due(&self, job: &Job) -> Option<Duration> {
        if job.ending.is_some() {
            return (!self.arm.moving()).then_some(self.now);
        }
        match &job.wait {
            Wait::Nothing => Some(job.next_step),
            Wait::Motion => (!self.arm.moving()).then_some(job.next_step),
            Wait::Until(at) => Some(*at),
            Wait::Condition(condition) => {
                let met = condition.value(&self.scope()).map_or(true, is_true);
                met.then_some(job.next_step)
            }
            Wait::Answer => None,
        }
    }

    /// Starts a program.
    pub(super) fn start_program(
        &mut self,
        name: &str,
        cycles: Option<u32>,
        step: usize,
        single: bool,
    ) -> Result<(), Fault> {
        let frame = self.frame(name, step)?;
        self.arm.forget_words();
        self.arm.program_speed = Speed::FULL;
        self.reactions.clear();
        let mut job = Job::new(JobKind::Program, self.now + self.step_time());
        job.frames.push(frame);
        job.cycles_left = cycles.map(|n| n.saturating_sub(1));
        job.single = single;
        self.job = Some(job);
        self.paused = None;
        self.note(Event::ProgramStarted(name.to_owned()));
        Ok(())
    }

    fn frame(&self, name: &str, step: usize) -> Result<Frame, Fault> {
        let program = self
            .memory
            .programs
            .get(name)
            .ok_or(Message::UndefinedProgram)?
            .clone();
        program.check().map_err(|_| Message::ControlStructure)?;
        if step > program.steps.len() {
            return Err(Message::InvalidArgument.into());
        }
        Ok(Frame {
            name: name.to_owned(),
            program,
            step,
            loops: Vec::new(),
        })
    }

    /// Goes on with a program that was paused, aborted or refused, at its next step or (`again`) at the one it stopped in.
    pub(super) fn resume_program(&mut self, again: bool, single: bool) -> Result<(), Fault> {
        let mut job = self.paused.take().ok_or(Message::NotRunning)?;
        if again && let Some(frame) = job.frames.last_mut() {
            frame.step = frame.step.saturating_sub(1);
        }
        job.ending = None;
        job.wait = Wait::Nothing;
        job.next_step = self.now + self.step_time();
        job.single = single;
        self.job = Some(job);
        Ok(())
    }

    /// Carries out one instruction for `DO`; the prompt comes when it is done.
    pub(super) fn do_instruction(&mut self, instruction: &Instruction) -> Result<(), Fault> {
        if instruction.needs_program() {
            return Err(Message::IllegalInstruction.into());
        }
        if matches!(instruction, Instruction::React { .. }) && !self.profile.react_at_monitor {
            return Err(Message::IllegalInstruction.into());
        }
        if let Instruction::Call(name) = instruction {
            return self
                .start_program(name, Some(1), 0, false)
                .map(|()| self.prompt());
        }
        let mut job = Job::new(JobKind::Do, self.now);
        match self.carry_out(instruction, &mut job)? {
            Flow::WhenStanding => return Err(Message::Busy.into()),
            Flow::Wait(wait) => job.wait = wait,
            _ => {}
        }
        if job.wait == Wait::Nothing && self.arm.moving() {
            if !self.profile.do_blocks {
                self.prompt();
                return Ok(());
            }
            job.wait = Wait::Motion;
        }
        if job.wait == Wait::Nothing {
            self.prompt();
            return Ok(());
        }
        if !matches!(self.mode, Mode::Answer(_)) {
            self.mode = Mode::Busy;
        }
        self.job = Some(job);
        Ok(())
    }

    pub(super) fn start_calibration_job(&mut self) {
        let mut job = Job::new(JobKind::Calibration, self.now);
        job.wait = Wait::Motion;
        self.job = Some(job);
        self.mode = Mode::Busy;
    }

    /// The arm has come to a stand.
    pub(super) fn motion_ended(&mut self, outcome: Result<(), Fault>) {
        self.sense();
        self.note(Event::MotionEnded);
        if let Err(fault) = outcome {
            self.fail_job(fault);
        }
    }

    /// Stops the arm and ends the job; `PROCEED` can go on with a program.
    pub(super) fn stop_job(&mut self, how: Message) {
        if self.arm.moving() {
            self.note(Event::MotionBrokenOff);
        }
        self.arm.break_off(self.now, self.profile.stop_time);
        if let Some(job) = &mut self.job {
            job.ending = Some(how);
        }
    }

    /// Ends the job with a message in asterisks; without a job the message comes unasked.
    pub(super) fn fail_job(&mut self, fault: Fault) {
        let job = self.job.take();
        self.refuse(fault);
        match job {
            Some(job) => self.end_job(job, Message::Aborted),
            None => {
                if matches!(self.mode, Mode::Monitor) {
                    self.prompt();
                }
            }
        }
    }

    /// The terminal has answered a `PROMPT`.
    pub(super) fn answered(&mut self) {
        match self.job.as_mut() {
            Some(job) => {
                job.wait = Wait::Nothing;
                job.next_step = self.now;
                if job.kind == JobKind::Program {
                    self.prompt();
                }
            }
            None => self.prompt(),
        }
    }

    /// Lets the job go on if it can.
    pub(super) fn run_job(&mut self) {
        let due = |emulator: &Self| emulator.job.as_ref().and_then(|job| emulator.job_due(job));
        if due(self).is_none_or(|at| at > self.now) {
            return;
        }
        let Some(mut job) = self.job.take() else { return };
        if let Some(how) = job.ending {
            return self.end_job(job, how);
        }
        if let Wait::Condition(condition) = &job.wait
            && let Err(fault) = condition.value(&self.scope())
        {
            self.refuse(fault);
            return self.end_job(job, Message::Aborted);
        }
        job.wait = Wait::Nothing;
        if job.kind != JobKind::Program {
            return self.end_job(job, Message::Completed);
        }
        self.sense();
        job.next_step = self.now + self.step_time();
        match self.program_step(&mut job) {
            Ok(None) => {
                self.job = Some(job);
                self.check_reactions();
            }
            Ok(Some(how)) if self.arm.moving() => {
                job.ending = Some(how);
                self.job = Some(job);
            }
            Ok(Some(how)) => self.end_job(job, how),
            Err(fault) => {
                self.refuse(fault);
                self.arm.break_off(self.now, self.profile.stop_time);
                self.end_job(job, Message::Aborted);
            }
        }
    }

    fn end_job(&mut self, job: Job, how: Message) {
        match job.kind {
            JobKind::Calibration => {
                if how == Message::Completed {
                    self.calibration_done();
                }
            }
            JobKind::Do => {}
            JobKind::Program => {
                let text = self.profile.text(how).to_owned();
                let line = match job.at() {
                    Some((name, step)) if how != Message::Completed => {
                        format!("{text} at {name}, step {step}")
                    }
                    _ => text,
                };
                self.print_line(&line);
                self.note(Event::ProgramEnded(how));
                self.reactions.clear();
                if how != Message::Completed {
                    self.paused = Some(job);
                }
                if !matches!(self.mode, Mode::Monitor | Mode::Busy | Mode::Answer(_)) {
                    // The terminal is in another dialogue, which goes on.
                    return;
                }
            }
        }
        self.prompt();
    }

    /// One step of a program. `Some` says how the program ends.
    fn program_step(&mut self, job: &mut Job) -> Result<Option<Message>, Fault> {
        let Some(frame) = job.frames.last_mut() else {
            return Ok(Some(Message::Completed));
        };
        let program = Arc::clone(&frame.program);
        let at = frame.step;
        let flow = match program.steps.get(at) {
            Some(step) => {
                frame.step = at + 1;
                self.carry_out(&step.instruction, job)?
            }
            None => Flow::Return,
        };
        let Some(frame) = job.frames.last_mut() else {
            return Ok(Some(Message::Completed));
        };
        match flow {
            Flow::Next => {}
            Flow::WhenStanding => {
                frame.step = at;
                job.wait = Wait::Motion;
                return Ok(None);
            }
            Flow::Jump(to) => frame.step = to,
            Flow::Wait(wait) => job.wait = wait,
            Flow::Call(name) => {
                if job.frames.len() >= CALL_DEPTH {
                    return Err(Message::OutOfMemory.into());
                }
                job.frames.push(self.frame(&name, 0)?);
            }
            Flow::Return if job.frames.len() > 1 => {
                job.frames.pop();
            }
            Flow::Return | Flow::EndOfCycle => {
                job.frames.truncate(1);
                match &mut job.cycles_left {
                    Some(0) => return Ok(Some(Message::Completed)),
                    Some(left) => *left -= 1,
                    None => {}
                }
                job.frames[0].step = 0;
                job.frames[0].loops.clear();
            }
            Flow::Pause => return Ok(Some(Message::Paused)),
            Flow::Halt => return Ok(Some(Message::Halted)),
        }
        Ok(job.single.then_some(Message::Paused))
    }

    /// Looks whether a signal has come that somebody waits for.
    pub(super) fn check_reactions(&mut self) {
        let due = |r: &Reaction| self.scope().signal(r.signal).unwrap_or(false);
        let Some(index) = self.reactions.iter().position(due) else {
            return;
        };
        let runs_program = self
            .job
            .as_ref()
            .is_some_and(|job| job.kind == JobKind::Program && job.ending.is_none());
        let moves = self.arm.moving();
        if !runs_program && !moves {
            return;
        }
        let reaction = self.reactions.remove(index);
        if reaction.at_once && moves {
            self.arm.break_off(self.now, self.profile.stop_time);
            self.note(Event::MotionBrokenOff);
        }
        let Some(name) = reaction.program else { return };
        let called = self.frame(&name, 0);
        match (&mut self.job, called) {
            (Some(job), Ok(frame)) if job.kind == JobKind::Program && job.frames.len() < CALL_DEPTH => {
                if matches!(job.wait, Wait::Until(_) | Wait::Condition(_)) {
                    // What was waited for is waited for again after the reaction.
                    if let Some(waiting) = job.frames.last_mut() {
                        waiting.step = waiting.step.saturating_sub(1);
                    }
                }
                job.frames.push(frame);
                if reaction.at_once || !matches!(job.wait, Wait::Motion) {
                    job.wait = if moves && reaction.at_once {
                        Wait::Motion
                    } else {
                        Wait::Nothing
                    };
                }
                job.next_step = self.now;
            }
            (Some(job), Ok(_)) if job.kind == JobKind::Program => self.fail_job(Message::OutOfMemory.into()),
            (Some(_), Ok(_)) => {}
            (None, Ok(_)) => {}
            (_, Err(fault)) => self.fail_job(fault),
        }
    }

    fn carry_out(&mut self, instruction: &Instruction, job: &mut Job) -> Result<Flow, Fault> {
        if self.arm.moving() && needs_standing_arm(instruction) {
            return Ok(Flow::WhenStanding);
        }
        let scope = self.scope();
        let number = |e: &Expr| e.value(&scope);
        match instruction {
            Instruction::Remark | Instruction::Settling | Instruction::Break => {}
            Instruction::Move { straight, to, hand } => {
                let place = to.place(&scope)?;
                let opening = hand.as_ref().map(number).transpose()?;
                if let Some(opening) = opening {
                    self.arm.set_gripper_next(if opening > 0.0 {
                        Gripper::Open
                    } else {
                        Gripper::Closed
                    });
                }
                self.start_motion(*straight, &place)?;
            }
            Instruction::Appro {
                straight,
                to,
                distance,
            } => {
                let place = to.place(&scope)?;
                let target = self.arm.approach(&place, number(distance)? / 1000.0);
                self.start_motion(*straight, &target)?;
            }
            Instruction::Depart { straight, distance } => {
                let here = Place::Transformation(scope.destination());
                let target = self.arm.approach(&here, number(distance)? / 1000.0);
                self.start_motion(*straight, &target)?;
            }
            Instruction::Drive([joint, change, speed]) => {
                let (joint, change, speed) = (number(joint)?, number(change)?, number(speed)?);
                self.drive(joint, change, speed)?;
            }
            Instruction::Draw(by) => {
                let mut pose = scope.destination();
                pose.translation.vector += nalgebra::Vector3::from(values(by, &scope)?) / 1000.0;
                self.start_motion(true, &Place::Transformation(pose))?;
            }
            Instruction::Align => {
                let target = self.arm.aligned();
                self.start_motion(false, &target)?;
            }
            Instruction::Ready => {
                let ready = Joints::from_degrees([0.0, -90.0, 90.0, 0.0, 0.0, 0.0]);
                self.start_motion(false, &Place::PrecisionPoint(ready))?;
            }
            Instruction::Nest => {
                let nest = Place::PrecisionPoint(self.profile.nest);
                self.start_motion(false, &nest)?;
            }
            Instruction::Delay(seconds) => {
                let seconds = number(seconds)?.clamp(0.0, 1e6);
                return Ok(Flow::Wait(Wait::Until(
                    self.now + Duration::from_secs_f64(seconds),
                )));
            }
            Instruction::Hand { to, at_once } => {
                if !at_once {
                    self.arm.set_gripper_next(*to);
                    return Ok(Flow::Next);
                }
                self.arm.gripper = *to;
                self.note(Event::Gripper(*to));
                return Ok(Flow::Wait(Wait::Until(self.now + self.profile.hand_time)));
            }
            Instruction::Posture(posture) => self.arm.set_posture_next(*posture),
            Instruction::Speed { value, unit, always } => {
                let speed = Speed::new(number(value)?, *unit)?;
                if *always {
                    self.arm.program_speed = speed;
                } else {
                    self.arm.set_speed_next(speed);
                }
            }
            Instruction::Signal(numbers) => {
                let numbers = numbers.iter().map(number).collect::<Result<Vec<_>, _>>()?;
                for value in numbers {
                    self.command_signal(value)?;
                }
            }
            Instruction::Reset => self.signals.reset_outputs(),
            Instruction::Wait(condition) => {
                if !is_true(number(condition)?) {
                    return Ok(Flow::Wait(Wait::Condition(condition.clone())));
                }
            }
            Instruction::React {
                at_once,
                signal,
                program,
            } => {
                let signal = number(signal)?;
                scope.signal(signal)?;
                if let Some(name) = program
                    && !self.memory.programs.contains_key(name)
                {
                    return Err(Message::UndefinedProgram.into());
                }
                let armed = Reaction {
                    signal,
                    program: program.clone(),
                    at_once: *at_once,
                };
                self.disarm(signal);
                if self.reactions.len() >= 64 {
                    return Err(Message::OutOfMemory.into());
                }
                self.reactions.push(armed);
            }
            Instruction::Ignore(signal) => {
                let signal = number(signal)?;
                self.disarm(signal);
            }
            Instruction::SetPlace(name, to) => {
                let (key, place) = (name.key(&scope)?, to.place(&scope)?);
                if name.precision != matches!(place, Place::PrecisionPoint(_)) {
                    return Err(Message::InvalidArgument.into());
                }
                self.memory.set_place(key, place, &self.profile)?;
            }
            Instruction::Assign(variable, value) => {
                let (key, value) = (variable.key(&scope)?, number(value)?);
                self.memory.set_real(key, value, &self.profile)?;
            }
            Instruction::Here(name) => {
                let (key, place) = (name.key(&scope)?, self.here(name.precision));
                self.memory.set_place(key, place, &self.profile)?;
            }
            Instruction::Decompose(into, place) => {
                let first = match &into.index {
                    Some(index) => whole(number(index)?, 0, 32000)?,
                    None => 0,
                };
                scope.check_name(&into.name)?;
                for (i, value) in (first..).zip(place.place(&scope)?.val()) {
                    self.memory
                        .set_real(format!("{}[{i}]", into.name), value, &self.profile)?;
                }
            }
            Instruction::Tool(to) => {
                let tool = to.as_ref().map(|t| t.transformation(&scope)).transpose()?;
                self.arm.frames.tool = tool.unwrap_or_default();
            }
            Instruction::Base(shift) => {
                let shift = values(shift, &scope)?;
                self.set_base(shift);
            }
            Instruction::Type(items) => self.type_items(items)?,
            Instruction::Prompt(text, variables) => {
                for variable in variables {
                    variable.key(&scope)?;
                }
                let text = text.clone().unwrap_or_default();
                return Ok(self.ask_values(&text, variables.clone()));
            }
            Instruction::Call(name) => return Ok(Flow::Call(name.clone())),
            Instruction::Return => return Ok(Flow::Return),
            Instruction::Pause => return Ok(Flow::Pause),
            Instruction::Stop => return Ok(Flow::EndOfCycle),
            Instruction::Halt => return Ok(Flow::Halt),
            _ => return self.control(instruction, job),
        }
        Ok(Flow::Next)
    }

    /// `GOTO`, `IF`, `FOR`, `WHILE`, `DO`, `CASE` and their parts. The frame's step already points behind the instruction.
    fn control(&mut self, instruction: &Instruction, job: &mut Job) -> Result<Flow, Fault> {
        let frame = job.frames.last_mut().ok_or(Message::IllegalInstruction)?;
        let program = Arc::clone(&frame.program);
        let at = frame.step - 1;
        let scope = self.scope();
        Ok(match instruction {
            Instruction::Goto(label) => Flow::Jump(program.labelled(*label)?),
            Instruction::IfGoto(condition, label) => {
                if is_true(condition.value(&scope)?) {
                    Flow::Jump(program.labelled(*label)?)
                } else {
                    Flow::Next
                }
            }
            Instruction::IfThen(condition) => {
                if is_true(condition.value(&scope)?) {
                    Flow::Next
                } else {
                    Flow::Jump(program.next_part(at)? + 1)
                }
            }
            Instruction::Else => Flow::Jump(program.end_of(at)? + 1),
            Instruction::While(condition) => {
                if is_true(condition.value(&scope)?) {
                    Flow::Next
                } else {
                    Flow::Jump(program.end_of(at)? + 1)
                }
            }
            Instruction::Do => Flow::Next,
            Instruction::Until(condition) => {
                if is_true(condition.value(&scope)?) {
                    Flow::Next
                } else {
                    Flow::Jump(program.head_of(at)? + 1)
                }
            }
            Instruction::Case(of) => {
                let of = of.value(&scope)?;
                Flow::Jump(self.branch(&program, at, of)?)
            }
            Instruction::Value(_) | Instruction::Any => Flow::Jump(program.end_of(at)? + 1),
            Instruction::For {
                variable,
                from,
                to,
                step,
            } => {
                let key = variable.key(&scope)?;
                let (from, to) = (from.value(&scope)?, to.value(&scope)?);
                let step = step.as_ref().map_or(Ok(1.0), |s| s.value(&scope))?;
                if step == 0.0 {
                    return Err(Message::InvalidArgument.into());
                }
                frame.loops.retain(|l| l.head != at);
                let end = program.end_of(at)?;
                let empty = if step > 0.0 { from > to } else { from < to };
                self.memory.set_real(key.clone(), from, &self.profile)?;
                if empty {
                    Flow::Jump(end + 1)
                } else {
                    frame.loops.push(Loop {
                        head: at,
                        key,
                        to,
                        step,
                    });
                    Flow::Next
                }
            }
            Instruction::End => {
                let head = program.head_of(at)?;
                match program.steps[head].instruction {
                    Instruction::While(_) => Flow::Jump(head),
                    Instruction::For { .. } => {
                        let Some(index) = frame.loops.iter().position(|l| l.head == head) else {
                            return Ok(Flow::Next);
                        };
                        let turn = &frame.loops[index];
                        let next = scope.real(&turn.key)? + turn.step;
                        let key = turn.key.clone();
                        let over = if turn.step > 0.0 {
                            next > turn.to
                        } else {
                            next < turn.to
                        };
                        if over {
                            frame.loops.remove(index);
                        }
                        self.memory.set_real(key, next, &self.profile)?;
                        if over { Flow::Next } else { Flow::Jump(head + 1) }
                    }
                    _ => Flow::Next,
                }
            }
            _ => return Err(Message::IllegalInstruction.into()),
        })
    }

    /// The step of a `CASE` to go on with: behind the first `VALUE` that fits, behind `ANY`, or behind the `END`.
    #[allow(clippy::float_cmp)] // `VALUE` compares as the controller does.
    fn branch(&self, program: &Program, case: usize, of: f64) -> Result<usize, Fault> {
        let scope = self.scope();
        let mut at = program.next_part(case)?;
        loop {
            match &program.steps[at].instruction {
                Instruction::Value(values) => {
                    for value in values {
                        if value.value(&scope)? == of {
                            return Ok(at + 1);
                        }
                    }
                }
                _ => return Ok(at + 1),
            }
            at = program.next_part(at)?;
        }
    }

    fn start_motion(&mut self, straight: bool, to: &Place) -> Result<(), Fault> {
        let before = self.arm.gripper;
        if straight {
            self.arm.start_line(to, self.now, &self.profile)?;
        } else {
            self.arm.check_ready()?;
            let joints = self.arm.resolve(to)?;
            self.arm.start_joints(joints, None, self.now, &self.profile)?;
        }
        self.motion_started(before);
        Ok(())
    }

    fn motion_started(&mut self, gripper_before: Gripper) {
        self.next_tick = self.now;
        self.note(Event::MotionStarted);
        if self.arm.gripper != gripper_before {
            self.note(Event::Gripper(self.arm.gripper));
        }
    }

    fn drive(&mut self, joint: f64, change: f64, speed: f64) -> Result<(), Fault> {
        let joint = Joint::ALL[(whole(joint, 1, 6)? - 1) as usize];
        let speed = Speed::new(speed, super::instruction::SpeedUnit::Percent)?;
        let short = self.profile.drive_error_degrees.min(change.abs()) * change.signum();
        let mut to = self.arm.joints();
        to.0[joint.index()] += change.to_radians();
        self.arm.check_ready()?;
        let range = self.arm.params.ranges[joint.index()];
        if to[joint] < range.min - 1e-4 || to[joint] > range.max + 1e-4 {
            return Err(Fault::at(Message::OutOfRange, joint));
        }
        to.0[joint.index()] -= short.to_radians();
        let before = self.arm.gripper;
        self.arm.start_joints(to, Some(speed), self.now, &self.profile)?;
        self.motion_started(before);
        Ok(())
    }

    pub(super) fn here(&self, precision: bool) -> Place {
        if precision {
            Place::PrecisionPoint(self.arm.shown())
        } else {
            Place::Transformation(self.scope().here())
        }
    }

    pub(super) fn set_base(&mut self, [dx, dy, dz, turn]: [f64; 4]) {
        let shift = nalgebra::Vector3::new(dx, dy, dz) / 1000.0;
        let turn = nalgebra::UnitQuaternion::from_axis_angle(&nalgebra::Vector3::z_axis(), turn.to_radians());
        self.arm.frames.base = nalgebra::Isometry3::from_parts(shift.into(), turn);
    }

    pub(super) fn command_signal(&mut self, value: f64) -> Result<(), Fault> {
        let number = whole(value, -9999, 9999).map_err(|_| Message::IllegalSignal)?;
        self.signals.command(number)?;
        self.note(Event::Output {
            signal: number.unsigned_abs() as u16,
            on: number > 0,
        });
        Ok(())
    }

    fn disarm(&mut self, signal: f64) {
        self.reactions
            .retain(|r| r.signal.abs().total_cmp(&signal.abs()).is_ne());
    }

    fn type_items(&mut self, items: &[Item]) -> Result<(), Fault> {
        let mut text = String::new();
        let mut stay = false;
        let mut format = None;
        for item in items {
            match item {
                Item::Text(words) => text.push_str(words),
                Item::Value(value) => {
                    let value = value.value(&self.scope())?;
                    match format {
                        Some((width, decimals)) => text.push_str(&display::number(value, width, decimals)),
                        None => text.push_str(&format!(" {}", display::plain(value))),
                    }
                }
                Item::Blanks(n) => text.push_str(&" ".repeat(*n)),
                Item::Lines(n) => text.push_str(&self.profile.eol.repeat(*n)),
                Item::Stay => stay = true,
                Item::Format(new) => format = *new,
            }
        }
        if matches!(self.mode, Mode::Monitor) && !self.type_stays {
            self.terminal.fresh_line(&self.profile, self.now);
        }
        self.type_stays = stay;
        self.print(&text);
        if !stay {
            self.print(self.profile.eol);
        }
        Ok(())
    }

    fn ask_values(&mut self, text: &str, variables: Vec<Variable>) -> Flow {
        self.terminal.fresh_line(&self.profile, self.now);
        self.print(text);
        self.mode = Mode::Answer(variables);
        Flow::Wait(Wait::Answer)
    }
}

/// Motions wait for the one before, and so does what has to happen at its end.
fn needs_standing_arm(instruction: &Instruction) -> bool {
    matches!(
        instruction,
        Instruction::Move { .. }
            | Instruction::Appro { .. }
            | Instruction::Depart { .. }
            | Instruction::Drive(_)
            | Instruction::Draw(_)
            | Instruction::Align
            | Instruction::Ready
            | Instruction::Nest
            | Instruction::Break
            | Instruction::Hand { at_once: true, .. }
            | Instruction::Tool(_)
            | Instruction::Base(_)
    )
}
