//! The doors of the cell: a camera that delivers frames, an arm that moves, sensors that warn.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use hough_heuristic::image::GrayImage;
use hough_heuristic::{FrameError, FrameSource};
use puma_val2::{ArmError, Gripper, JointDelta, Joints, Manipulator, ProximitySensor};

use crate::{Cell, Renderer};

/// A cell that camera, arm and whoever pushes the ball have in common.
///
/// ```
/// use nalgebra::Point3;
/// use pipeline_sim::{Ball, Cell, SharedCell};
///
/// let cell = SharedCell::new(Cell::paper(Ball::at(0.6, 0.1, -0.1)));
/// let same = cell.clone();
/// same.with(|cell| cell.place_ball(Point3::new(0.65, 0.1, -0.1)));
/// assert_eq!(cell.get().ball.centre.x, 0.65);
/// ```
#[derive(Clone, Debug)]
pub struct SharedCell(Arc<Mutex<Cell>>);

impl SharedCell {
    /// Shares a cell.
    pub fn new(cell: Cell) -> Self {
        Self(Arc::new(Mutex::new(cell)))
    }

    /// A copy of the cell as it is now.
    pub fn get(&self) -> Cell {
        *locked(&self.0)
    }

    /// Does something to the cell, or asks it something.
    pub fn with<T>(&self, act: impl FnOnce(&mut Cell) -> T) -> T {
        act(&mut locked(&self.0))
    }
}

/// A cell is plain data: whatever a panicking thread left in it is still a cell.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The camera on the hand as a [`FrameSource`]: every grab renders the cell as it is, with the joints where they are.
///
/// The joints come from a closure, so that any arm will do: [`SimulatedArm::pose`], or an emulated controller asked where it stands.
pub struct CellCamera<P> {
    cell: SharedCell,
    renderer: Renderer,
    pose: P,
}

impl<P: FnMut() -> Joints> CellCamera<P> {
    /// A camera in `cell` that looks from wherever `pose` says the joints are.
    pub fn new(cell: SharedCell, renderer: Renderer, pose: P) -> Self {
        Self { cell, renderer, pose }
    }

    /// Renders the next frame into the renderer's own buffer, without a copy.
    ///
    /// # Errors
    /// [`FrameError::Failed`] if the joints are not finite.
    pub fn look(&mut self) -> Result<&GrayImage, FrameError> {
        let joints = (self.pose)();
        if let Some(joint) = joints.non_finite() {
            return Err(FrameError::Failed {
                origin: "simulated camera".to_owned(),
                reason: format!("the angle of {joint} is not a finite number"),
            });
        }
        Ok(self.renderer.render(&self.cell.get(), &joints))
    }
}

impl<P: FnMut() -> Joints> FrameSource for CellCamera<P> {
    fn grab(&mut self) -> Result<GrayImage, FrameError> {
        self.look().cloned()
    }
}

impl<P> std::fmt::Debug for CellCamera<P> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("CellCamera")
            .field("cell", &self.cell)
            .finish_non_exhaustive()
    }
}

/// An arm that is simply where it was sent, at once: a [`Manipulator`] and a [`ProximitySensor`] without a controller in between.
#[derive(Clone, Debug)]
pub struct SimulatedArm {
    cell: SharedCell,
    joints: Arc<Mutex<Joints>>,
    gripper: Gripper,
    stops: usize,
}

impl SimulatedArm {
    /// An arm in `cell`, standing at `joints` with open jaws.
    ///
    /// # Errors
    /// [`ArmError::JointLimit`] or [`ArmError::NotFinite`] if it cannot stand there.
    pub fn new(cell: SharedCell, joints: Joints) -> Result<Self, ArmError> {
        cell.get().params.check(&joints)?;
        Ok(Self {
            cell,
            joints: Arc::new(Mutex::new(joints)),
            gripper: Gripper::Open,
            stops: 0,
        })
    }

    /// A closure that tells where the joints are, now and later: what [`CellCamera::new`] wants.
    pub fn pose(&self) -> impl FnMut() -> Joints + Send + use<> {
        let joints = Arc::clone(&self.joints);
        move || *locked(&joints)
    }

    /// The cell the arm stands in.
    pub fn cell(&self) -> &SharedCell {
        &self.cell
    }

    /// The state of the jaws.
    pub fn gripper(&self) -> Gripper {
        self.gripper
    }

    /// How often the arm was told to stop.
    pub fn stops(&self) -> usize {
        self.stops
    }
}

impl Manipulator for SimulatedArm {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        Ok(*locked(&self.joints))
    }

    fn move_by(&mut self, delta: JointDelta) -> Result<Joints, ArmError> {
        let target = *locked(&self.joints) + delta;
        self.move_to(target)
    }

    fn move_to(&mut self, target: Joints) -> Result<Joints, ArmError> {
        self.cell.get().params.check(&target)?;
        *locked(&self.joints) = target;
        Ok(target)
    }

    fn set_gripper(&mut self, gripper: Gripper) -> Result<(), ArmError> {
        self.gripper = gripper;
        Ok(())
    }

    fn stop(&mut self) -> Result<(), ArmError> {
        self.stops += 1;
        Ok(())
    }
}

impl ProximitySensor for SimulatedArm {
    fn object_near(&mut self) -> Result<bool, ArmError> {
        let joints = *locked(&self.joints);
        Ok(self.cell.with(|cell| cell.proximity(&joints)))
    }
}
