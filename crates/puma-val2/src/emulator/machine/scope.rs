//! The controller's state as the expressions of a program see it.

use std::time::Duration;

use nalgebra::Isometry3;

use crate::emulator::language::expr::whole;
use crate::emulator::language::place::Place;
use crate::emulator::language::scope::Scope;
use crate::emulator::machine::arm::Arm;
use crate::emulator::machine::memory::Memory;
use crate::emulator::machine::signals::Signals;
use crate::emulator::message::{Fault, Message};
use crate::emulator::profile::Profile;

/// View of memory, signals and arm.
#[derive(Debug)]
pub(crate) struct View<'a> {
    pub(crate) memory: &'a Memory,
    pub(crate) signals: &'a Signals,
    pub(crate) arm: &'a Arm,
    pub(crate) profile: &'a Profile,
    pub(crate) now: Duration,
}

impl Scope for View<'_> {
    fn real(&self, key: &str) -> Result<f64, Fault> {
        let value = self.memory.reals.get(key).copied();
        value.ok_or(Message::UndefinedValue.into())
    }

    fn place(&self, key: &str) -> Result<Place, Fault> {
        let place = self.memory.places.get(key).copied();
        place.ok_or(Message::UndefinedValue.into())
    }

    fn signal(&self, number: f64) -> Result<bool, Fault> {
        let number = whole(number, -9999, 9999).map_err(|_| Message::IllegalSignal)?;
        Ok(self.signals.get(number.unsigned_abs() as u16)? == (number > 0))
    }

    fn timer(&self, number: usize) -> f64 {
        self.now.as_secs_f64() - self.memory.timers[number]
    }

    fn reaches(&self, place: &Place) -> bool {
        self.arm.resolve(place).is_ok()
    }

    fn here(&self) -> Isometry3<f64> {
        self.arm.hand(&self.arm.shown())
    }

    fn destination(&self) -> Isometry3<f64> {
        self.arm.hand(&self.arm.destination())
    }

    fn has_ppoint(&self) -> bool {
        self.profile.ppoint
    }

    fn check_name(&self, name: &str) -> Result<(), Fault> {
        self.profile.check_name(name)
    }
}
