//! Instructions carried out, whether from a program or from `DO`.

use std::time::Duration;

use crate::emulator::controller::{Emulator, Event};
use crate::emulator::language::expr::{Expr, is_true, whole};
use crate::emulator::language::instruction::{Instruction, SpeedUnit};
use crate::emulator::language::place::Place;
use crate::emulator::language::place_expr::{PlaceName, values};
use crate::emulator::language::scope::Scope;
use crate::emulator::machine::arm::Speed;
use crate::emulator::machine::job::{Flow, Job, JobKind, Wait};
use crate::emulator::machine::process;
use crate::emulator::machine::reaction::Reaction;
use crate::emulator::message::{Fault, Message};
use crate::joints::{Joint, Joints};
use crate::manipulator::Gripper;

impl Emulator {
    pub(crate) fn carry_out(
        &mut self,
        instruction: &Instruction,
        job: &mut Job,
    ) -> Result<Flow, Fault> {
        let moves = is_motion(instruction);
        if job.kind == JobKind::Process && (moves || !process::takes(instruction)) {
            return Err(Message::IllegalInstruction.into());
        }
        let waits = job.kind != JobKind::Process && needs_standing_arm(instruction);
        if self.arm.moving() && waits {
            return Ok(Flow::WhenStanding);
        }
        if moves {
            return self.motion_after_motion(instruction, job);
        }
        let scope = self.scope();
        let number = |e: &Expr| e.value(&scope);
        match instruction {
            Instruction::Remark | Instruction::Accepted | Instruction::Break => {}
            Instruction::Fine(fine, always) => {
                self.arm.fine_next = *fine;
                if *always {
                    self.arm.fine_always = *fine;
                }
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
            Instruction::Grasp(opening, label) => {
                let opening = opening.as_ref().map(number).transpose()?;
                let program = job.frames.last_mut().zip(*label);
                if let Some((frame, label)) = program.filter(|_| opening.is_some_and(|o| o > 0.0)) {
                    frame.step = frame.program.labelled(label)?;
                }
                self.arm.gripper = Gripper::Closed;
                self.note(Event::Gripper(Gripper::Closed));
                return Ok(Flow::Wait(Wait::Until(self.now + self.profile.hand_time)));
            }
            Instruction::Timer(timer, seconds) => {
                let (timer, seconds) = (whole(number(timer)?, 0, 8)?, number(seconds)?);
                self.memory.timers[timer as usize] = self.now.as_secs_f64() - seconds;
            }
            Instruction::Parameter(name, value) => {
                let value = number(value)?;
                self.memory
                    .set_parameter(name.clone(), value, &self.profile)?;
            }
            Instruction::Switch(names, on) => self.set_switches(names, *on)?,
            Instruction::RunSignal(signal) => {
                let signal = whole(number(signal)?, 1, 2064)?;
                self.signals.command(signal)?;
                job.run_signal = Some(signal);
            }
            Instruction::Posture(part, value) => self.arm.set_posture_next(*part, *value),
            Instruction::Speed {
                value,
                unit,
                always,
            } => {
                let speed = Speed::new(number(value)?, *unit)?;
                if *always {
                    self.arm.program_speed = speed;
                } else {
                    self.arm.set_speed_next(speed);
                }
            }
            Instruction::Signal(numbers) => self.command_signals(numbers)?,
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
            Instruction::Here(names) => {
                let (key, place) = self.taught(names)?;
                self.memory.set_place(key, place, &self.profile)?;
            }
            Instruction::Decompose(into, place) => {
                let first = into.index.first().map_or(Ok(0.0), number)?;
                let first = whole(first, 0, 32000)?;
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
                self.ask_values(&text, variables.clone());
                return Ok(Flow::Wait(Wait::Answer));
            }
            Instruction::Call(name, arguments) => {
                return self.call(name, arguments).map(Flow::Call);
            }
            Instruction::Local(names) => self.make_local(names, job)?,
            Instruction::OnFault(program) => {
                if let Some(name) = program {
                    self.memory.program(name)?;
                }
                self.on_fault = program.clone();
            }
            Instruction::Return(skip) => {
                if let [.., caller, _] = &mut job.frames[..] {
                    caller.step += *skip as usize;
                }
                return Ok(Flow::Return);
            }
            Instruction::Pause(text) | Instruction::Stop(text) => {
                if let Some(text) = text {
                    self.print_line(text);
                }
                return Ok(match instruction {
                    Instruction::Pause(_) => Flow::Pause,
                    _ => Flow::EndOfCycle,
                });
            }
            Instruction::Halt => return Ok(Flow::Halt),
            _ => return self.control(instruction, job),
        }
        Ok(Flow::Next)
    }

    /// Starts a motion. A program's motion blends with the one under way as soon as that slows down
    /// for its end; faults are left to the standing arm.
    fn motion_after_motion(
        &mut self,
        instruction: &Instruction,
        job: &mut Job,
    ) -> Result<Flow, Fault> {
        if !self.arm.moving() {
            self.motion(instruction)?;
            return Ok(Flow::Next);
        }
        let continuous = self.switches.get("CP").is_none_or(|on| *on) && job.is_program();
        let Some(at) = self.arm.slows_down().filter(|_| continuous) else {
            return Ok(Flow::WhenStanding);
        };
        // The controller plans a period ahead.
        let at = at.saturating_sub(self.profile.tick);
        if self.now < at {
            return Ok(Flow::WhenSlowing(at));
        }
        if let Ok(true) = self.motion(instruction) {
            return Ok(Flow::Next);
        }
        self.arm.close();
        Ok(Flow::WhenStanding)
    }

    /// Starts the motion of an instruction. Returns `false` if the arm has to stand first.
    fn motion(&mut self, instruction: &Instruction) -> Result<bool, Fault> {
        let scope = self.scope();
        let number = |e: &Expr| e.value(&scope);
        match instruction {
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
                self.start_motion(*straight, &place)
            }
            Instruction::Appro {
                straight,
                to,
                distance,
            } => {
                let place = to.place(&scope)?;
                let target = self.arm.approach(&place, number(distance)? / 1000.0);
                self.start_motion(*straight, &target)
            }
            Instruction::Depart { straight, distance } => {
                let here = Place::Transformation(scope.destination());
                let target = self.arm.approach(&here, number(distance)? / 1000.0);
                self.start_motion(*straight, &target)
            }
            Instruction::Drive([joint, change, speed]) => {
                let (joint, change, speed) = (number(joint)?, number(change)?, number(speed)?);
                self.drive(joint, change, speed)
            }
            Instruction::Draw(by) => {
                let mut pose = scope.destination();
                pose.translation.vector += nalgebra::Vector3::from(values(by, &scope)?) / 1000.0;
                self.start_motion(true, &Place::Transformation(pose))
            }
            Instruction::Align => {
                let target = self.arm.aligned();
                self.start_motion(false, &target)
            }
            Instruction::Ready => {
                let ready = Joints::READY;
                self.start_motion(false, &Place::PrecisionPoint(ready))
            }
            Instruction::Nest => {
                let nest = Place::PrecisionPoint(self.profile.nest);
                self.start_motion(false, &nest)
            }
            _ => Err(Message::IllegalInstruction.into()),
        }
    }

    fn start_motion(&mut self, straight: bool, to: &Place) -> Result<bool, Fault> {
        let before = self.arm.gripper;
        let begun = if straight {
            self.arm.start_line(to, self.now, &self.profile)?
        } else {
            self.arm.check_ready()?;
            let joints = self.arm.resolve(to)?;
            self.arm
                .start_joints(joints, None, self.now, &self.profile)?
        };
        Ok(self.motion_started(begun, before))
    }

    fn motion_started(&mut self, begun: bool, gripper_before: Gripper) -> bool {
        if begun {
            self.next_tick = self.now;
            self.note(Event::MotionStarted);
            if self.arm.gripper != gripper_before {
                self.note(Event::Gripper(self.arm.gripper));
            }
        }
        begun
    }

    fn drive(&mut self, joint: f64, change: f64, speed: f64) -> Result<bool, Fault> {
        let joint = Joint::ALL[(whole(joint, 1, 6)? - 1) as usize];
        let speed = Speed::new(speed, SpeedUnit::Percent)?;
        let short = self.profile.drive_error_degrees.min(change.abs()) * change.signum();
        let from = self.arm.start();
        let mut to = from;
        to.0[joint.index()] += change.to_radians();
        self.arm.check_ready()?;
        let range = self.arm.params.ranges[joint.index()];
        if !range.holds(to[joint]) && !range.inwards(from[joint], to[joint]) {
            return Err(Fault::at(Message::OutOfRange, joint));
        }
        to.0[joint.index()] -= short.to_radians();
        let before = self.arm.gripper;
        let begun = self
            .arm
            .start_joints(to, Some(speed), self.now, &self.profile)?;
        Ok(self.motion_started(begun, before))
    }

    /// Returns the key and the value of a location at which the arm stands. Of a compound the last
    /// part is meant, relative to the parts before it.
    pub(crate) fn taught(&self, names: &[PlaceName]) -> Result<(String, Place), Fault> {
        let scope = self.scope();
        let (last, frame) = names.split_last().ok_or(Message::InvalidArgument)?;
        let key = last.key(&scope)?;
        if last.precision {
            let alone = frame.is_empty().then_some(());
            alone.ok_or(Message::InvalidArgument)?;
            return Ok((key, Place::PrecisionPoint(self.arm.shown())));
        }
        let mut pose = scope.here();
        for name in frame {
            let Place::Transformation(part) = scope.place(&name.key(&scope)?)? else {
                return Err(Message::InvalidArgument.into());
            };
            pose = part.inverse() * pose;
        }
        Ok((key, Place::Transformation(pose)))
    }

    pub(crate) fn set_base(&mut self, [dx, dy, dz, turn]: [f64; 4]) {
        let shift = nalgebra::Vector3::new(dx, dy, dz) / 1000.0;
        let turn = nalgebra::UnitQuaternion::from_axis_angle(
            &nalgebra::Vector3::z_axis(),
            turn.to_radians(),
        );
        self.arm.frames.base = nalgebra::Isometry3::from_parts(shift.into(), turn);
    }

    /// Sets outputs, all of whose numbers have a value.
    pub(crate) fn command_signals(&mut self, numbers: &[Expr]) -> Result<(), Fault> {
        let values: Result<Vec<_>, _> = numbers.iter().map(|n| n.value(&self.scope())).collect();
        for value in values? {
            let number = whole(value, -9999, 9999).map_err(|_| Message::IllegalSignal)?;
            self.signals.command(number)?;
            self.note(Event::Output {
                signal: number.unsigned_abs() as u16,
                on: number > 0,
            });
        }
        Ok(())
    }

    fn disarm(&mut self, signal: f64) {
        self.reactions
            .retain(|r| r.signal.abs().total_cmp(&signal.abs()).is_ne());
    }
}

fn is_motion(instruction: &Instruction) -> bool {
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
    )
}

/// Returns `true` for instructions other than motions that wait for the end of a motion.
fn needs_standing_arm(instruction: &Instruction) -> bool {
    matches!(
        instruction,
        Instruction::Break
            | Instruction::Delay(_)
            | Instruction::Grasp(..)
            | Instruction::Hand { at_once: true, .. }
            | Instruction::Tool(_)
            | Instruction::Base(_)
    )
}
