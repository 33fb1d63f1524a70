//! Faults of the line and of the controller, injected one by one at every place of a session, and
//! at random.
//!
//! Each time the following must hold: a call that succeeds leaves the arm where it was sent; a call
//! that fails is a typed error, the arm stands, no joint has gone beyond where it was sent, and the
//! joint angles that the client still holds for known are those of the arm.

mod babble;
mod characters;
mod connecting;
mod events;
mod field;
mod guard;
mod hand;
mod harness;
pub(crate) mod line;
mod resident;
mod used;
