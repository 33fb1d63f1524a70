//! What an expression can look at.

use nalgebra::Isometry3;

use super::arm::Arm;
use super::expr::whole;
use super::memory::Memory;
use super::place::Place;
use super::signals::Signals;
use super::{Fault, Message, Profile};

#[derive(Debug)]
pub(super) struct Scope<'a> {
    pub(super) memory: &'a Memory,
    pub(super) signals: &'a Signals,
    pub(super) arm: &'a Arm,
    pub(super) profile: &'a Profile,
}

impl Scope<'_> {
    pub(super) fn real(&self, key: &str) -> Result<f64, Fault> {
        self.memory
            .reals
            .get(key)
            .copied()
            .ok_or(Message::UndefinedValue.into())
    }

    pub(super) fn place(&self, key: &str) -> Result<Place, Fault> {
        self.memory
            .places
            .get(key)
            .copied()
            .ok_or(Message::UndefinedValue.into())
    }

    /// Whether the signal is in the state that the sign of `number` asks for.
    pub(super) fn signal(&self, number: f64) -> Result<bool, Fault> {
        let number = whole(number, -9999, 9999).map_err(|_| Message::IllegalSignal)?;
        Ok(self.signals.get(number.unsigned_abs() as u16)? == (number > 0))
    }

    pub(super) fn here(&self) -> Isometry3<f64> {
        self.arm.hand(&self.arm.shown())
    }

    pub(super) fn destination(&self) -> Isometry3<f64> {
        self.arm.hand(&self.arm.destination())
    }

    pub(super) fn has_ppoint(&self) -> bool {
        self.profile.ppoint
    }

    pub(super) fn check_name(&self, name: &str) -> Result<(), Fault> {
        check_name(name, self.profile)
    }
}

/// Refuses names that the controller would not keep.
pub(super) fn check_name(name: &str, profile: &Profile) -> Result<(), Fault> {
    if name.len() > profile.max_name {
        return Err(Message::NameTooLong.into());
    }
    Ok(())
}
