//! A cell shared between camera, arm and sensors, with a record of contacts.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nalgebra::Point3;
use puma_val2::{Gripper, Joints};

use crate::cell::errors::Errors;
use crate::cell::geometry::Cell;
use crate::cell::grasp::Grasp;
use crate::error::QuantityError;

/// Contacts of the hand with the cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Contacts {
    /// Number of times that fingers, palm or camera ran into ball, holder or table; with a
    /// [`SimulatedArm`](crate::SimulatedArm), number of moves that pushed the ball.
    pub collisions: usize,
    /// Distance that the ball was pushed, metres.
    pub pushed: f64,
    /// Result of the last closing of the jaws; `None` before the first.
    pub grasp: Option<Grasp>,
}

/// A handle to a cell that camera, arm, sensors and the user share.
#[derive(Clone, Debug)]
pub struct SharedCell(Arc<Mutex<State>>);

#[derive(Debug)]
struct State {
    cell: Cell,
    /// Last pose of the hand.
    stood: Option<Joints>,
    /// Set while the hand overlaps something.
    touching: bool,
    contacts: Contacts,
    errors: Errors,
    /// Angles of joints that stay in their dead zone.
    stuck: [Option<f64>; 6],
}

impl SharedCell {
    /// Shares a cell.
    pub fn new(cell: Cell) -> Self {
        Self(Arc::new(Mutex::new(State {
            cell,
            stood: None,
            touching: false,
            contacts: Contacts::default(),
            errors: Errors::none(),
            stuck: [None; 6],
        })))
    }

    /// Sets the errors that arm and cameras in this cell make. The errors of camera, ball and links
    /// are not among them: [`Errors::apply`] puts those into the cell itself. Backlash and encoder
    /// steps concern a [`SimulatedArm`] only.
    ///
    /// # Errors
    /// [`QuantityError`] names the quantity that is out of range.
    ///
    /// [`SimulatedArm`]: crate::SimulatedArm
    pub fn set_errors(&self, errors: &Errors) -> Result<(), QuantityError> {
        errors.check()?;
        self.lock().errors = *errors;
        Ok(())
    }

    pub(super) fn errors(&self) -> Errors {
        self.lock().errors
    }

    /// Returns the angles of the links of an arm that reports these, which cameras and sensors go
    /// by.
    pub fn links(&self, reported: &Joints) -> Joints {
        let state = self.lock();
        let driven = |i: usize| state.stuck[i].unwrap_or(reported.0[i]);
        let driven = Joints(std::array::from_fn(driven));
        state.errors.links(&state.cell, &driven)
    }

    /// Returns the target of a move that joints with stiction really go to, and remembers the
    /// joints that stay in their dead zone.
    pub(super) fn overcome_friction(&self, reported: &Joints, target: &Joints) -> Joints {
        let mut state = self.lock();
        let (stiction, dead_zone) = (state.errors.stiction, state.errors.dead_zone);
        let mut end = *target;
        for i in 0..6 {
            if (target.0[i] - reported.0[i]).abs() < stiction {
                end.0[i] = reported.0[i];
            }
            let here = state.stuck[i].unwrap_or(reported.0[i]);
            state.stuck[i] = ((end.0[i] - here).abs() < dead_zone).then_some(here);
        }
        end
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // Plain data stays valid when a thread panics.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns a copy of the cell.
    pub fn get(&self) -> Cell {
        self.lock().cell
    }

    /// Calls `act` with the cell.
    pub fn with<T>(&self, act: impl FnOnce(&mut Cell) -> T) -> T {
        act(&mut self.lock().cell)
    }

    /// Places the ball, on a holder, at `centre`, out of the jaws if they held it, and clears the
    /// contacts. Returns `false`, and changes nothing, if ball or holder would overlap the hand at
    /// `joints`.
    pub fn place_ball(&self, centre: Point3<f64>, joints: &Joints) -> bool {
        let mut state = self.lock();
        let (mut there, mut without) = (state.cell, state.cell);
        there.place_ball(centre);
        remove_ball(&mut without);
        // A hand that overlaps the table does so wherever the ball is.
        let free = !there.collides(joints) || without.collides(joints);
        if free {
            state.cell = there;
            state.contacts = Contacts::default();
        }
        free
    }

    /// Removes ball and holder from the hand's surroundings.
    pub fn remove_ball(&self) {
        self.with(remove_ball);
    }

    /// Moves the hand to `joints` from where it was last, pushing the ball on its way, and counts
    /// contacts. Returns `true` if something is within the proximity sensors' range there.
    ///
    /// For an arm that does not know the cell, on its way or standing. An uninterrupted contact
    /// counts as one collision.
    pub fn move_hand(&self, joints: &Joints) -> bool {
        let mut state = self.lock();
        let from = state.stood.replace(*joints).unwrap_or(*joints);
        let pushed = state.cell.sweep(&from, joints);
        let touching = pushed > 0.0 || state.cell.collides(joints);
        state.contacts.pushed += pushed;
        state.contacts.collisions += usize::from(touching && !state.touching);
        state.touching = touching;
        state.cell.proximity(joints)
    }

    /// Moves the hand along the way of an arm that is the only one in the cell, without looking for
    /// other contacts than with the ball.
    pub(super) fn sweep(&self, from: &Joints, to: &Joints) {
        let mut state = self.lock();
        let pushed = state.cell.sweep(from, to);
        state.contacts.pushed += pushed;
        state.contacts.collisions += usize::from(pushed > 0.0);
    }

    /// Opens or closes the jaws with the arm at `joints`.
    pub fn set_gripper(&self, gripper: Gripper, joints: &Joints) {
        let mut state = self.lock();
        match gripper {
            Gripper::Open => state.cell.open_gripper(),
            Gripper::Closed => state.contacts.grasp = Some(state.cell.close_gripper(joints)),
        }
    }

    /// Returns the contacts since the ball was last placed by [`SharedCell::place_ball`].
    pub fn contacts(&self) -> Contacts {
        self.lock().contacts
    }
}

/// Puts the ball out of reach, without a holder.
pub(super) fn remove_ball(cell: &mut Cell) {
    cell.place_ball(Point3::new(-9.0, 0.0, -0.1));
    cell.holder = None;
}
