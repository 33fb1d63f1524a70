//! Values that an expression can look up.

use nalgebra::Isometry3;

use crate::emulator::language::place::Place;
use crate::emulator::message::Fault;

/// Access to the controller's state during the evaluation of an expression.
pub(crate) trait Scope {
    /// Returns the value of a real variable.
    fn real(&self, key: &str) -> Result<f64, Fault>;

    /// Returns the value of a location.
    fn place(&self, key: &str) -> Result<Place, Fault>;

    /// Returns `true` if the signal is in the state that the sign of `number` asks for.
    fn signal(&self, number: f64) -> Result<bool, Fault>;

    /// Returns the seconds that the timer of this number shows.
    fn timer(&self, number: usize) -> f64;

    /// Returns `true` if the arm can go to the place.
    fn reaches(&self, place: &Place) -> bool;

    /// Returns the present hand pose, for `HERE`.
    fn here(&self) -> Isometry3<f64>;

    /// Returns the hand pose at the end of the present motion, for `DEST`.
    fn destination(&self) -> Isometry3<f64>;

    /// Returns `true` if the controller knows `#PPOINT`.
    fn has_ppoint(&self) -> bool;

    /// Refuses a name that is too long for the controller.
    fn check_name(&self, name: &str) -> Result<(), Fault>;
}
