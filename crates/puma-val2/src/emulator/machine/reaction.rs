//! `REACT` and `REACTI`: what happens when a signal comes.

use crate::emulator::controller::{Emulator, Event};
use crate::emulator::language::scope::Scope;
use crate::emulator::machine::job::{CALL_DEPTH, JobKind, Wait};
use crate::emulator::message::Message;

/// Armed `REACT` or `REACTI`.
#[derive(Clone, Debug)]
pub(crate) struct Reaction {
    /// Negative: reacts when the signal is off.
    pub(crate) signal: f64,
    pub(crate) program: Option<String>,
    pub(crate) at_once: bool,
}

impl Emulator {
    /// Carries out the reaction to a signal that has come.
    pub(crate) fn check_reactions(&mut self) {
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
        if let Some(job) = &self.job
            && job.kind == JobKind::Program
            && matches!(job.wait, Wait::Answer)
            && called.is_ok()
        {
            // The terminal is the monitor's again until the values are asked for anew.
            self.prompt();
        }
        match (&mut self.job, called) {
            (Some(job), Ok(frame))
                if job.kind == JobKind::Program && job.frames.len() < CALL_DEPTH =>
            {
                if matches!(job.wait, Wait::Until(_) | Wait::Condition(_) | Wait::Answer) {
                    // What was waited for is waited for again after the reaction.
                    if let Some(waiting) = job.frames.last_mut() {
                        waiting.step = waiting.step.saturating_sub(1);
                    }
                }
                job.frames.push(frame);
                if reaction.at_once || !matches!(job.wait, Wait::Motion | Wait::Slowing(_)) {
                    job.wait = if moves && reaction.at_once {
                        Wait::Motion
                    } else {
                        Wait::Nothing
                    };
                }
                job.next_step = self.now;
            }
            (Some(job), Ok(_)) if job.kind == JobKind::Program => {
                self.fail_job(Message::OutOfMemory.into());
            }
            (Some(_), Ok(_)) => {}
            (None, Ok(_)) => {}
            (_, Err(fault)) => self.fail_job(fault),
        }
    }
}
