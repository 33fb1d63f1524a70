//! The process-control program: a second program beside the robot's, without the arm.

use crate::emulator::controller::{Emulator, Event};
use crate::emulator::language::instruction::Instruction;
use crate::emulator::language::lexer::Cursor;
use crate::emulator::machine::job::{Job, JobKind, Wait};
use crate::emulator::message::{Fault, Message};

/// Returns `true` for an instruction that a process-control program may have, motions aside: none
/// that moves the hand, sets up a motion or a reaction, asks at the terminal, or has names of its
/// own.
pub(crate) fn takes(instruction: &Instruction) -> bool {
    use Instruction as I;
    let own_names = match instruction {
        I::Call(_, arguments) => !arguments.is_empty(),
        other => matches!(other, I::Local(_)),
    };
    let of_the_arm = matches!(
        instruction,
        I::Hand { .. }
            | I::Grasp(..)
            | I::Posture(..)
            | I::Speed { .. }
            | I::Fine(..)
            | I::Break
            | I::Tool(_)
            | I::Base(_)
            | I::React { .. }
            | I::Ignore(_)
            | I::OnFault(_)
            | I::Prompt(..)
    );
    !own_names && !of_the_arm
}

impl Emulator {
    /// Carries out `PCEXECUTE [program][,cycles][,step]`.
    pub(crate) fn execute_process(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        if self.process.is_some() {
            return Err(Message::Busy.into());
        }
        let last = self
            .process_paused
            .as_ref()
            .and_then(|job| job.frames.first());
        let last = last.map(|frame| frame.name.clone());
        let (name, cycles, step) = self.what_to_execute(cursor, last.as_ref())?;
        let mut job = Job::new(JobKind::Process, self.now + self.step_time());
        job.frames.push(self.frame(&name, step)?);
        job.cycles_left = cycles.map(|n| n.saturating_sub(1));
        self.process = Some(job);
        self.note(Event::ProgramStarted(name));
        Ok(())
    }

    /// Carries out `PCABORT`.
    pub(crate) fn abort_process(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        cursor.expect_end()?;
        let job = self.process.take().ok_or(Message::NotRunning)?;
        self.tell_end(job, Message::Aborted);
        Ok(())
    }

    /// Carries out `PCEND`: the program ends with its present cycle.
    pub(crate) fn end_process_cycle(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        cursor.expect_end()?;
        let job = self.process.as_mut().ok_or(Message::NotRunning)?;
        job.cycles_left = Some(0);
        Ok(())
    }

    /// Carries out `PCPROCEED`.
    pub(crate) fn proceed_process(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        cursor.expect_end()?;
        if self.process.is_some() {
            return Err(Message::Busy.into());
        }
        let mut job = self.process_paused.take().ok_or(Message::NotRunning)?;
        job.faulted = false;
        job.wait = Wait::Nothing;
        job.next_step = self.now + self.step_time();
        self.process = Some(job);
        Ok(())
    }

    /// Carries out a step of the process-control program if one is due.
    pub(crate) fn run_process(&mut self) {
        let due = self.process.as_ref().and_then(|job| self.job_due(job));
        if due.is_none_or(|at| at > self.now) {
            return;
        }
        let Some(mut job) = self.process.take() else {
            return;
        };
        let waited = match &job.wait {
            Wait::Condition(condition) => condition.value(&self.scope()).map(drop),
            _ => Ok(()),
        };
        job.wait = Wait::Nothing;
        job.next_step = self.now + self.step_time();
        self.sense();
        match waited.and_then(|()| self.program_step(&mut job)) {
            Ok(None) => {
                self.process = Some(job);
                self.check_reactions();
                return;
            }
            Ok(Some(how)) => self.tell_end(job, how),
            Err(fault) => {
                job.faulted = true;
                self.refuse(fault);
                self.tell_end(job, Message::Aborted);
            }
        }
        if self.at_monitor() {
            self.prompt();
        }
    }

    /// Prints the end of the process-control program. What is not complete can go on.
    fn tell_end(&mut self, job: Job, how: Message) {
        let text = format!("PC: {}", self.profile.text(how));
        self.print_line(&job.ended(&text, how));
        if let Some(signal) = job.run_signal {
            // It could be switched on.
            let _ = self.signals.command(-signal);
        }
        self.note(Event::ProgramEnded(how));
        let over = matches!(how, Message::Completed | Message::Halted);
        self.process_paused = (!over).then_some(job);
    }
}
