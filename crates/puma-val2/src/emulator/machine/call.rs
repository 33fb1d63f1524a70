//! Calls: what goes to the program called, what is its own, and what comes back.

use crate::emulator::controller::Emulator;
use crate::emulator::language::argument::Argument;
use crate::emulator::language::place::Place;
use crate::emulator::machine::job::{CALL_DEPTH, Frame, Job, Wait};
use crate::emulator::message::{Fault, Message};

impl Emulator {
    /// Returns the frame of a call, with its arguments as values of its parameters. A parameter
    /// without an argument has no value.
    pub(crate) fn call(&self, name: &str, arguments: &[Argument]) -> Result<Frame, Fault> {
        let mut frame = self.frame(name, 0)?;
        let parameters = &frame.program.parameters;
        if arguments.len() > parameters.len() {
            return Err(Message::InvalidArgument.into());
        }
        let scope = self.scope();
        for (i, parameter) in parameters.iter().enumerate() {
            let mut value = (parameter.clone(), None, None);
            match arguments.get(i) {
                None => {}
                Some(Argument::Number(number)) => value.1 = Some(number.value(&scope)?),
                Some(Argument::Place(place)) => value.2 = Some(place.place(&scope)?),
                Some(Argument::Named(name)) => {
                    let key = name.key(&scope)?;
                    value.1 = self.memory.reals.get(&key).copied();
                    value.2 = self.memory.places.get(&key).copied();
                    frame.returns.push((parameter.clone(), key));
                }
            }
            let is_point = value
                .2
                .is_some_and(|place| matches!(place, Place::PrecisionPoint(_)));
            if parameter.starts_with('#') != is_point && (is_point || value.2.is_some()) {
                return Err(Message::InvalidArgument.into());
            }
            frame.locals.push(value);
        }
        Ok(frame)
    }

    /// Goes into the program of `frame`, whose locals hold the arguments.
    pub(crate) fn enter(&mut self, mut frame: Frame, job: &mut Job) -> Result<(), Fault> {
        for local in &mut frame.locals {
            *local = self.exchange(local)?;
        }
        job.frames.push(frame);
        Ok(())
    }

    /// Gives variables and locations to the innermost program alone; they have no value yet.
    pub(crate) fn make_local(&mut self, names: &[String], job: &mut Job) -> Result<(), Fault> {
        let frame = job.frames.last_mut().ok_or(Message::IllegalInstruction)?;
        for name in names {
            self.profile.check_name(name.trim_start_matches('#'))?;
            if frame.locals.iter().all(|local| local.0 != *name) {
                frame
                    .locals
                    .push(self.exchange(&(name.clone(), None, None))?);
            }
        }
        Ok(())
    }

    /// Goes back to the caller, whose names get the values of the parameters.
    pub(crate) fn leave(&mut self, job: &mut Job) -> Result<(), Fault> {
        let Some(frame) = job.frames.pop() else {
            return Ok(());
        };
        let value = |e: &Self, key: &String| {
            let (real, place) = (e.memory.reals.get(key), e.memory.places.get(key));
            (real.copied(), place.copied())
        };
        let returned: Vec<_> = frame
            .returns
            .iter()
            .map(|(own, _)| value(self, own))
            .collect();
        for local in frame.locals.iter().rev() {
            self.exchange(local)?;
        }
        for ((_, key), (real, place)) in frame.returns.iter().zip(returned) {
            if let Some(real) = real {
                self.memory.set_real(key.clone(), real, &self.profile)?;
            }
            if let Some(place) = place {
                self.memory.set_place(key.clone(), place, &self.profile)?;
            }
        }
        Ok(())
    }

    /// Gives all names back their values from before the program.
    pub(crate) fn leave_all(&mut self, job: &mut Job) {
        while !job.frames.is_empty() {
            // The values were in memory before, so they fit again.
            let _ = self.leave(job);
        }
    }

    /// Gives a name other values and returns those it had.
    fn exchange(
        &mut self,
        (key, real, place): &(String, Option<f64>, Option<Place>),
    ) -> Result<(String, Option<f64>, Option<Place>), Fault> {
        let before = (
            key.clone(),
            self.memory.reals.remove(key),
            self.memory.places.remove(key),
        );
        if let Some(real) = real {
            self.memory.set_real(key.clone(), *real, &self.profile)?;
        }
        if let Some(place) = place {
            self.memory.set_place(key.clone(), *place, &self.profile)?;
        }
        Ok(before)
    }

    /// Calls the program of `REACTE` after a fault. It is disarmed then, and its `RETURN` leads
    /// behind the step with the fault.
    pub(crate) fn recovers(&mut self, job: &mut Job) -> bool {
        if !job.is_program() || job.ending.is_some() || job.frames.len() >= CALL_DEPTH {
            return false;
        }
        let frame = self.on_fault.take().map(|name| self.frame(&name, 0));
        let Some(Ok(frame)) = frame else {
            return false;
        };
        job.frames.push(frame);
        job.wait = Wait::Nothing;
        job.next_step = self.now;
        true
    }
}
