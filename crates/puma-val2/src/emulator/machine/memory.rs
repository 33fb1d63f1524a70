//! Memory of the controller: programs, locations, real variables.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::emulator::console::mode::Kind;
use crate::emulator::language::place::Place;
use crate::emulator::language::program::Program;
use crate::emulator::message::{Fault, Message};
use crate::emulator::profile::Profile;

#[derive(Clone, Debug, Default)]
pub(crate) struct Memory {
    pub(crate) programs: BTreeMap<String, Arc<Program>>,
    pub(crate) places: BTreeMap<String, Place>,
    pub(crate) reals: BTreeMap<String, f64>,
    /// Values of `PARAMETER`.
    pub(crate) parameters: BTreeMap<String, f64>,
    /// Time at which each timer showed zero, seconds.
    pub(crate) timers: [f64; 9],
}

impl Memory {
    pub(crate) fn program(&self, name: &str) -> Result<&Arc<Program>, Fault> {
        self.programs
            .get(name)
            .ok_or(Message::UndefinedProgram.into())
    }

    /// Returns the kind of what `key` names, among all kinds or only `kind`.
    pub(crate) fn kind_of(&self, key: &str, kind: Option<Kind>) -> Option<Kind> {
        let there = [
            (Kind::Program, self.programs.contains_key(key)),
            (Kind::Place, self.places.contains_key(key)),
            (Kind::Real, self.reals.contains_key(key)),
        ];
        let fits = |(k, is_there): &(Kind, bool)| *is_there && kind.is_none_or(|kind| kind == *k);
        there.into_iter().find(fits).map(|(kind, _)| kind)
    }

    pub(crate) fn set_place(
        &mut self,
        key: String,
        place: Place,
        profile: &Profile,
    ) -> Result<(), Fault> {
        if !place.val().iter().all(|v| v.is_finite()) {
            return Err(Message::ArithmeticError.into());
        }
        insert(&mut self.places, key, place, profile)
    }

    pub(crate) fn set_real(
        &mut self,
        key: String,
        value: f64,
        profile: &Profile,
    ) -> Result<(), Fault> {
        // Zero has no sign.
        insert(&mut self.reals, key, value + 0.0, profile)
    }

    pub(crate) fn set_parameter(
        &mut self,
        name: String,
        value: f64,
        profile: &Profile,
    ) -> Result<(), Fault> {
        insert(&mut self.parameters, name, value, profile)
    }

    pub(crate) fn set_program(
        &mut self,
        name: String,
        program: Program,
        profile: &Profile,
    ) -> Result<(), Fault> {
        insert(&mut self.programs, name, Arc::new(program), profile)
    }
}

fn insert<T>(
    map: &mut BTreeMap<String, T>,
    key: String,
    value: T,
    profile: &Profile,
) -> Result<(), Fault> {
    if map.len() >= profile.max_entries && !map.contains_key(&key) {
        return Err(Message::OutOfMemory.into());
    }
    map.insert(key, value);
    Ok(())
}
