//! Branches and loops of a program.

use std::sync::Arc;

use crate::emulator::controller::Emulator;
use crate::emulator::language::expr::is_true;
use crate::emulator::language::instruction::Instruction;
use crate::emulator::language::program::Program;
use crate::emulator::language::scope::Scope;
use crate::emulator::machine::job::{Flow, Job, Loop};
use crate::emulator::message::{Fault, Message};

impl Emulator {
    /// Carries out `GOTO`, `IF`, `FOR`, `WHILE`, `DO`, `CASE` and their parts. The frame's step
    /// already points behind the instruction.
    pub(crate) fn control(
        &mut self,
        instruction: &Instruction,
        job: &mut Job,
    ) -> Result<Flow, Fault> {
        let frame = job.frames.last_mut().ok_or(Message::IllegalInstruction)?;
        let program = Arc::clone(&frame.program);
        let at = frame.step - 1;
        let scope = self.scope();
        Ok(match instruction {
            Instruction::Goto(label) => Flow::Jump(program.labelled(*label)?),
            Instruction::IfGoto(condition, label) if is_true(condition.value(&scope)?) => {
                Flow::Jump(program.labelled(*label)?)
            }
            Instruction::IfThen(condition) if !is_true(condition.value(&scope)?) => {
                let mut part = program.next_part(at)?;
                while let Instruction::Else(Some(condition)) = &program.steps[part].instruction
                    && !is_true(condition.value(&scope)?)
                {
                    part = program.next_part(part)?;
                }
                Flow::Jump(part + 1)
            }
            Instruction::While(condition) if !is_true(condition.value(&scope)?) => {
                Flow::Jump(program.end_of(at)? + 1)
            }
            Instruction::Until(condition) if !is_true(condition.value(&scope)?) => {
                Flow::Jump(program.head_of(at)? + 1)
            }
            Instruction::IfGoto(..)
            | Instruction::IfThen(_)
            | Instruction::While(_)
            | Instruction::Until(_)
            | Instruction::Do => Flow::Next,
            Instruction::Else(_) | Instruction::Value(_) | Instruction::Any => {
                Flow::Jump(program.end_of(at)? + 1)
            }
            Instruction::LeaveLoop => Flow::Jump(program.end_of(program.loop_of(at)?)? + 1),
            Instruction::NextTurn => Flow::Jump(program.end_of(program.loop_of(at)?)?),
            Instruction::Case(of) => {
                let of = of.value(&scope)?;
                Flow::Jump(self.branch(&program, at, of)?)
            }
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
                self.memory.set_real(key.clone(), from, &self.profile)?;
                if passed(from, to, step) {
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
                        let over = passed(next, turn.to, turn.step);
                        if over {
                            frame.loops.remove(index);
                        }
                        self.memory.set_real(key, next, &self.profile)?;
                        if over {
                            Flow::Next
                        } else {
                            Flow::Jump(head + 1)
                        }
                    }
                    _ => Flow::Next,
                }
            }
            _ => return Err(Message::IllegalInstruction.into()),
        })
    }

    /// Returns the next step of a `CASE`: behind the first `VALUE` that fits, behind `ANY`, or
    /// behind the `END`.
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
}

/// Returns `true` if a loop's variable is beyond its last value.
fn passed(value: f64, to: f64, step: f64) -> bool {
    if step > 0.0 { value > to } else { value < to }
}
