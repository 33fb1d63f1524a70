//! What the hand does to the simulated cell while an arm moves it that knows nothing of the cell.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use pipeline_sim::{Contact, Grasp, SharedCell};
use puma_val2::{Gripper, Joints};

/// What the hand has done in the cell of a [`Rig`](crate::Rig) since the ball was placed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Contacts {
    /// How often fingers, palm or camera ran into ball, holder or table.
    pub collisions: usize,
    /// How far the ball was pushed by that, metres.
    pub pushed: f64,
    /// What closing the jaws came to the last time; `None` before the first.
    pub grasp: Option<Grasp>,
}

/// The cell, told where the hand is and what the jaws do.
#[derive(Clone, Debug)]
pub(crate) struct Surroundings(Arc<Mutex<State>>);

#[derive(Debug)]
struct State {
    cell: SharedCell,
    /// Where the hand was last.
    stood: Option<Joints>,
    /// Whether it ran into something there.
    touching: bool,
    contacts: Contacts,
}

impl Surroundings {
    pub(crate) fn new(cell: SharedCell) -> Self {
        Self(Arc::new(Mutex::new(State {
            cell,
            stood: None,
            touching: false,
            contacts: Contacts::default(),
        })))
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // Plain data: whatever a panicking thread left in it can be gone on from.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The arm is at `joints`, on its way or standing. Returns whether something is too near to the
    /// hand there.
    pub(crate) fn hand_at(&self, joints: &Joints) -> bool {
        let mut state = self.lock();
        let from = state.stood.replace(*joints).unwrap_or(*joints);
        let (contact, inside, near) = state.cell.with(|cell| {
            let contact = cell.sweep(&from, joints);
            (contact, cell.collides(joints), cell.proximity(joints))
        });
        let mut touching = inside;
        if let Contact::Pushed { by } = contact {
            state.contacts.pushed += by;
            touching = true;
        }
        // As long as it goes on it is one collision.
        state.contacts.collisions += usize::from(touching && !state.touching);
        state.touching = touching;
        near
    }

    /// The jaws have been opened or closed with the arm at `joints`.
    pub(crate) fn jaws(&self, gripper: Gripper, joints: &Joints) {
        let mut state = self.lock();
        let grasp = state.cell.with(|cell| match gripper {
            Gripper::Open => {
                cell.open_gripper();
                None
            }
            Gripper::Closed => Some(cell.close_gripper(joints)),
        });
        state.contacts.grasp = grasp.or(state.contacts.grasp);
    }

    pub(crate) fn contacts(&self) -> Contacts {
        self.lock().contacts
    }

    /// Counts from nothing again.
    pub(crate) fn begin(&self) {
        self.lock().contacts = Contacts::default();
    }
}
