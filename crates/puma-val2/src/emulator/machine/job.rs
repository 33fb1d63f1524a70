//! Jobs: a program step by step, one instruction for `DO`, or a calibration.

use std::sync::Arc;
use std::time::Duration;

use crate::emulator::controller::{Emulator, Event};
use crate::emulator::language::expr::{Expr, is_true};
use crate::emulator::language::instruction::Instruction;
use crate::emulator::language::lexer::Cursor;
use crate::emulator::language::place::Place;
use crate::emulator::language::program::Program;
use crate::emulator::machine::arm::Speed;
use crate::emulator::message::{Fault, Message};

/// Deepest nesting of `CALL`.
pub(crate) const CALL_DEPTH: usize = 16;

/// Job that is being carried out.
#[derive(Debug)]
pub(crate) struct Job {
    pub(crate) kind: JobKind,
    /// Program and its callers, innermost last. Empty for `DO`.
    pub(crate) frames: Vec<Frame>,
    pub(crate) wait: Wait,
    pub(crate) next_step: Duration,
    /// Cycles left after this one; `None` for ever.
    pub(crate) cycles_left: Option<u32>,
    /// End that comes as soon as the arm stands.
    pub(crate) ending: Option<Message>,
    /// Instruction of `DO` that waits for the end of the motion before it.
    pub(crate) pending: Option<Instruction>,
    /// The last step ended with a fault.
    pub(crate) faulted: bool,
    /// Output that is on while the program runs.
    pub(crate) run_signal: Option<i32>,
    /// Stop after one step, for `NEXT`.
    pub(crate) single: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum JobKind {
    Program,
    Do,
    Calibration,
    /// A process-control program, which runs beside the others.
    Process,
}

#[derive(Debug)]
pub(crate) struct Frame {
    pub(crate) name: String,
    pub(crate) program: Arc<Program>,
    pub(crate) step: usize,
    pub(crate) loops: Vec<Loop>,
    /// Names of this call alone, with what they meant before.
    pub(crate) locals: Vec<(String, Option<f64>, Option<Place>)>,
    /// Parameters whose values go back to the caller's names.
    pub(crate) returns: Vec<(String, String)>,
}

/// `FOR` under way.
#[derive(Debug)]
pub(crate) struct Loop {
    pub(crate) head: usize,
    pub(crate) key: String,
    pub(crate) to: f64,
    pub(crate) step: f64,
}

#[derive(Debug)]
pub(crate) enum Wait {
    Nothing,
    /// Until the arm stands.
    Motion,
    /// Until this time, or until the arm stands.
    Slowing(Duration),
    Until(Duration),
    Condition(Expr),
    /// Until the terminal has answered.
    Answer,
}

/// Consequence of an instruction.
pub(crate) enum Flow {
    /// On to the next step.
    Next,
    /// Repeat this step when the arm stands.
    WhenStanding,
    /// Repeat this step at this time, when the arm slows down.
    WhenSlowing(Duration),
    /// To this step.
    Jump(usize),
    /// Wait, then on to the next step.
    Wait(Wait),
    /// Into a program.
    Call(Frame),
    Return,
    /// The present cycle is over.
    EndOfCycle,
    Pause,
    Halt,
}

impl Job {
    pub(crate) fn new(kind: JobKind, now: Duration) -> Self {
        Self {
            kind,
            frames: Vec::new(),
            wait: Wait::Nothing,
            next_step: now,
            cycles_left: Some(0),
            ending: None,
            pending: None,
            faulted: false,
            run_signal: None,
            single: false,
        }
    }

    pub(crate) fn is_program(&self) -> bool {
        self.kind == JobKind::Program
    }

    /// Returns the name and step (from 1) of the innermost program: the next one, or the one with
    /// the fault.
    pub(crate) fn at(&self) -> Option<(&str, usize)> {
        let ahead = usize::from(!self.faulted);
        self.frames
            .last()
            .map(|f| (f.name.as_str(), f.step + ahead))
    }

    /// Returns the line that tells of the end, with the step unless the program is complete.
    pub(crate) fn ended(&self, text: &str, how: Message) -> String {
        match self.at() {
            Some((name, step)) if how != Message::Completed => {
                format!("{text} at {name}, step {step}")
            }
            _ => text.to_owned(),
        }
    }

    /// Returns `true` while a `WAIT` or `PROMPT` waits.
    pub(crate) fn waits(&self) -> bool {
        matches!(self.wait, Wait::Condition(_) | Wait::Answer)
    }
}

impl Emulator {
    pub(crate) fn step_time(&self) -> Duration {
        self.profile.step_time.max(Duration::from_micros(100))
    }

    /// Returns the time at which the job goes on of itself.
    pub(crate) fn job_due(&self, job: &Job) -> Option<Duration> {
        if job.ending.is_some() {
            return (!self.arm.moving()).then_some(self.now);
        }
        match &job.wait {
            Wait::Nothing => Some(job.next_step),
            Wait::Motion => (!self.arm.moving()).then_some(job.next_step),
            Wait::Slowing(at) if self.arm.moving() => Some(*at),
            Wait::Slowing(_) => Some(job.next_step),
            Wait::Until(at) => Some(*at),
            Wait::Condition(condition) => {
                let met = condition.value(&self.scope()).map_or(true, is_true);
                met.then_some(job.next_step)
            }
            Wait::Answer => None,
        }
    }

    /// Starts a program.
    pub(crate) fn start_program(
        &mut self,
        name: &str,
        cycles: Option<u32>,
        step: usize,
        single: bool,
    ) -> Result<(), Fault> {
        let frame = self.frame(name, step)?;
        if let Some(mut paused) = self.paused.take() {
            self.leave_all(&mut paused);
        }
        self.arm.forget_words();
        self.arm.program_speed = Speed::FULL;
        self.arm.fine_always = false;
        self.reactions.clear();
        self.on_fault = None;
        let mut job = Job::new(JobKind::Program, self.now + self.step_time());
        job.frames.push(frame);
        job.cycles_left = cycles.map(|n| n.saturating_sub(1));
        job.single = single;
        self.job = Some(job);
        self.note(Event::ProgramStarted(name.to_owned()));
        Ok(())
    }

    pub(crate) fn frame(&self, name: &str, step: usize) -> Result<Frame, Fault> {
        let program = self.memory.program(name)?.clone();
        program.check().map_err(|_| Message::ControlStructure)?;
        if step > program.steps.len() {
            return Err(Message::InvalidArgument.into());
        }
        Ok(Frame {
            name: name.to_owned(),
            program,
            step,
            loops: Vec::new(),
            locals: Vec::new(),
            returns: Vec::new(),
        })
    }

    /// Continues a program that was paused, aborted or refused, at its next step or (`again`) at
    /// the one it stopped in.
    pub(crate) fn resume_program(
        &mut self,
        cursor: &Cursor<'_>,
        again: bool,
        single: bool,
    ) -> Result<(), Fault> {
        cursor.expect_end()?;
        let mut job = self.paused.take().ok_or(Message::NotRunning)?;
        if again && let Some(frame) = job.frames.last_mut() {
            frame.step = frame.step.saturating_sub(1);
        }
        job.ending = None;
        job.faulted = false;
        job.wait = Wait::Nothing;
        job.next_step = self.now + self.step_time();
        job.single = single;
        self.job = Some(job);
        Ok(())
    }

    /// Carries out one instruction for `DO`; the prompt comes when it is done.
    pub(crate) fn do_instruction(&mut self, instruction: &Instruction) -> Result<(), Fault> {
        if instruction.needs_program() {
            return Err(Message::IllegalInstruction.into());
        }
        if matches!(instruction, Instruction::React { .. }) && !self.profile.react_at_monitor {
            return Err(Message::IllegalInstruction.into());
        }
        if let Instruction::Call(name, arguments) = instruction {
            let frame = self.call(name, arguments)?;
            self.start_program(name, Some(1), 0, false)?;
            if let Some(mut job) = self.job.take() {
                job.frames.clear();
                self.enter(frame, &mut job)?;
                self.job = Some(job);
            }
            self.prompt();
            return Ok(());
        }
        let mut job = Job::new(JobKind::Do, self.now);
        match self.carry_out(instruction, &mut job)? {
            Flow::WhenStanding => {
                job.pending = Some(instruction.clone());
                job.wait = Wait::Motion;
            }
            Flow::Wait(wait) => job.wait = wait,
            _ => {}
        }
        if matches!(job.wait, Wait::Nothing) {
            if !self.arm.moving() || !self.profile.do_blocks {
                self.prompt();
                return Ok(());
            }
            job.wait = Wait::Motion;
        }
        self.hold_terminal();
        self.job = Some(job);
        Ok(())
    }

    pub(crate) fn start_calibration_job(&mut self) {
        let mut job = Job::new(JobKind::Calibration, self.now);
        job.wait = Wait::Motion;
        self.job = Some(job);
        self.hold_terminal();
    }

    /// Handles the end of a motion.
    pub(crate) fn motion_ended(&mut self, outcome: Result<(), Fault>) {
        self.sense();
        self.note(Event::MotionEnded);
        let Err(fault) = outcome else { return };
        let mut job = self.job.take();
        let recovers = job.as_mut().is_some_and(|job| self.recovers(job));
        self.job = job;
        if !recovers {
            self.fail_job(fault);
        }
    }

    /// Stops the arm and ends the job; `PROCEED` can go on with a program.
    pub(crate) fn stop_job(&mut self, how: Message) {
        if self.arm.moving() {
            self.note(Event::MotionBrokenOff);
        }
        self.arm.break_off(self.now, self.profile.stop_time);
        if let Some(job) = &mut self.job {
            job.ending = Some(how);
        }
    }

    /// Ends the job with a message in asterisks. Without a job the message comes unasked.
    pub(crate) fn fail_job(&mut self, fault: Fault) {
        let job = self.job.take();
        self.refuse(fault);
        match job {
            Some(mut job) => {
                job.faulted = true;
                self.end_job(job, Message::Aborted);
            }
            None => {
                if self.at_monitor() {
                    self.prompt();
                }
            }
        }
    }

    /// Continues after the answer to a `PROMPT`.
    pub(crate) fn answered(&mut self) {
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

    /// Lets the job continue if it can.
    pub(crate) fn run_job(&mut self) {
        let due = |emulator: &Self| emulator.job.as_ref().and_then(|job| emulator.job_due(job));
        if due(self).is_none_or(|at| at > self.now) {
            return;
        }
        let Some(mut job) = self.job.take() else {
            return;
        };
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
        if let Some(instruction) = job.pending.take() {
            self.release_terminal();
            if let Err(fault) = self.do_instruction(&instruction) {
                self.refuse(fault);
                self.prompt();
            }
            return;
        }
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
            Err(_) if self.recovers(&mut job) => self.job = Some(job),
            Err(fault) => {
                job.faulted = true;
                self.refuse(fault);
                self.arm.break_off(self.now, self.profile.stop_time);
                self.end_job(job, Message::Aborted);
            }
        }
    }

    fn end_job(&mut self, mut job: Job, how: Message) {
        match job.kind {
            JobKind::Calibration => {
                if how == Message::Completed {
                    self.calibration_done();
                }
            }
            JobKind::Do | JobKind::Process => {}
            JobKind::Program => {
                let text = self.profile.text(how).to_owned();
                self.print_line(&job.ended(&text, how));
                if let Some(signal) = job.run_signal {
                    // It could be switched on.
                    let _ = self.signals.command(-signal);
                }
                self.note(Event::ProgramEnded(how));
                self.reactions.clear();
                // `HALT` is an end for good; what was stopped in any other way can go on.
                if matches!(how, Message::Completed | Message::Halted) {
                    self.leave_all(&mut job);
                } else {
                    self.paused = Some(job);
                }
                if self.in_dialogue() {
                    // The terminal is in another dialogue, which goes on.
                    return;
                }
            }
        }
        self.prompt();
    }

    /// Carries out one step of a program. `Some` is the end of the program.
    pub(crate) fn program_step(&mut self, job: &mut Job) -> Result<Option<Message>, Fault> {
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
            Flow::WhenStanding | Flow::WhenSlowing(_) => {
                frame.step = at;
                job.wait = match flow {
                    Flow::WhenSlowing(at) => Wait::Slowing(at),
                    _ => Wait::Motion,
                };
                return Ok(None);
            }
            Flow::Jump(to) => frame.step = to,
            Flow::Wait(wait) => job.wait = wait,
            Flow::Call(frame) => {
                if job.frames.len() >= CALL_DEPTH {
                    return Err(Message::OutOfMemory.into());
                }
                self.enter(frame, job)?;
            }
            Flow::Return if job.frames.len() > 1 => self.leave(job)?,
            Flow::Return | Flow::EndOfCycle => {
                while job.frames.len() > 1 {
                    self.leave(job)?;
                }
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
}
