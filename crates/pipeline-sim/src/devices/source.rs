//! The doors of the cell: a camera that delivers frames, an arm that moves, sensors that warn.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use hough_heuristic::image::GrayImage;
use hough_heuristic::{Features, FrameError, FrameSource};
use puma_val2::{ArmError, Gripper, JointDelta, Joints, Manipulator, ProximitySensor};

use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

use crate::cell::errors::Drive;
use crate::cell::errors::Errors;
use crate::cell::geometry::Cell;
use crate::cell::grasp::{Contact, Grasp};
use crate::cell::motion::Motion;
use crate::error::QuantityError;
use crate::error::amount;
use crate::regression::samples::NOISE;
use crate::regression::samples::with_noise;
use crate::render::renderer::Renderer;
use crate::render::shot::Shot;

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

/// The camera on the hand as a [`FrameSource`]: every grab renders the cell as it is, with the
/// joints where they are.
///
/// The joints come from a closure, so that any arm will do: [`SimulatedArm::pose`], or an emulated
/// controller asked where it stands. Frames are taken in an instant unless [`CellCamera::exposed`]
/// says how long they take, and how things move meanwhile.
pub struct CellCamera<P> {
    cell: SharedCell,
    renderer: Renderer,
    pose: P,
    shot: Shot,
    motion: Option<Speeds>,
}

/// Tells how fast arm and ball move.
type Speeds = Box<dyn FnMut() -> Motion + Send>;

impl<P: FnMut() -> Joints> CellCamera<P> {
    /// A camera in `cell` that looks from wherever `pose` says the joints are.
    pub fn new(cell: SharedCell, renderer: Renderer, pose: P) -> Self {
        Self {
            cell,
            renderer,
            pose,
            shot: Shot::still(),
            motion: None,
        }
    }

    /// The camera with exposures that take time ([`Shot`]), of one field or two: `motion` is asked
    /// at every grab how fast arm and ball move. An arm that moves at once and a cell have no
    /// speeds of their own; whoever moves them knows, or takes what has moved since the last frame
    /// for it ([`Motion::between`]).
    ///
    /// Cell and joints are as they are in the middle of the exposure, so that its truth, and
    /// [`Cell::features`], hold for the frame.
    ///
    /// ```
    /// use hough_heuristic::FrameSource;
    /// use hough_heuristic::image::GrayImage;
    /// use pipeline_sim::{Ball, Cell, CellCamera, Motion, Renderer, Scene, SharedCell, Shot, Workspace};
    ///
    /// let cell = SharedCell::new(Cell::paper(Ball::at(0.6, 0.15, -0.1)));
    /// let pose = Workspace::paper().search_poses()[3];
    /// // PAL, each field exposed for 10 ms, while the waist turns by 20 degrees a second.
    /// let turning = || Motion {
    ///     joints: [20.0_f64.to_radians(), 0.0, 0.0, 0.0, 0.0, 0.0],
    ///     ..Motion::still()
    /// };
    /// let mut camera = CellCamera::new(cell, Renderer::new(&Scene::laboratory(), 1), move || pose)
    ///     .exposed(Shot::pal(0.010, 8), turning)?;
    /// let mut frame = GrayImage::default();
    /// camera.grab(&mut frame)?;
    /// assert_eq!(frame.dimensions(), (768, 576));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`QuantityError`] names what makes no sense in `shot`.
    pub fn exposed(
        mut self,
        shot: Shot,
        motion: impl FnMut() -> Motion + Send + 'static,
    ) -> Result<Self, QuantityError> {
        shot.check()?;
        self.shot = shot;
        self.motion = Some(Box::new(motion));
        Ok(self)
    }

    /// Renders the next frame into the renderer's own buffer, without a copy.
    ///
    /// # Errors
    /// [`FrameError::Failed`] if the joints, or the speeds of an exposure, are not finite.
    pub fn look(&mut self) -> Result<&GrayImage, FrameError> {
        let failed = |reason: String| FrameError::Failed {
            origin: "simulated camera".to_owned(),
            reason,
        };
        let joints = (self.pose)();
        if let Some(joint) = joints.non_finite() {
            return Err(failed(format!(
                "the angle of {joint} is not a finite number"
            )));
        }
        let cell = self.cell.get();
        let Some(motion) = &mut self.motion else {
            return Ok(self.renderer.render(&cell, &joints));
        };
        let motion = motion();
        motion.check().map_err(|error| failed(error.to_string()))?;
        let middle = 0.5 * (self.shot.exposure + self.shot.interlace.unwrap_or(0.0));
        Ok(self
            .renderer
            .take(&self.shot, |t| motion.moved(&cell, &joints, t - middle)))
    }
}

impl<P: FnMut() -> Joints> FrameSource for CellCamera<P> {
    fn grab(&mut self, frame: &mut GrayImage) -> Result<(), FrameError> {
        frame.clone_from(self.look()?);
        Ok(())
    }
}

impl<P> std::fmt::Debug for CellCamera<P> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("CellCamera")
            .field("cell", &self.cell)
            .field("shot", &self.shot)
            .finish_non_exhaustive()
    }
}

/// The camera and the detector in one: the ball's features straight from the geometry, with noise,
/// without a frame.
pub struct FeatureCamera<P> {
    cell: SharedCell,
    pose: P,
    noise: f64,
    rng: Xoshiro256PlusPlus,
}

impl<P: FnMut() -> Joints> FeatureCamera<P> {
    /// A camera in `cell` that looks from wherever `pose` says the joints are; its features carry
    /// normal noise of standard deviation `noise` units, drawn from `seed`. With noise that is no
    /// finite number, or below zero, it finds nothing ([`FeatureCamera::try_new`] refuses it).
    pub fn new(cell: SharedCell, pose: P, noise: f64, seed: u64) -> Self {
        Self {
            cell,
            pose,
            noise,
            rng: Xoshiro256PlusPlus::seed_from_u64(seed),
        }
    }

    /// As [`FeatureCamera::new`].
    ///
    /// # Errors
    /// [`QuantityError::NotFinite`], [`QuantityError::Negative`] for noise that is no finite number
    /// of zero or above.
    pub fn try_new(
        cell: SharedCell,
        pose: P,
        noise: f64,
        seed: u64,
    ) -> Result<Self, QuantityError> {
        amount(NOISE, noise)?;
        Ok(Self::new(cell, pose, noise, seed))
    }

    /// What a detector would find; `None` if the ball counts as lost, or the noise is no finite
    /// number of zero or above.
    pub fn look(&mut self) -> Option<Features> {
        if amount(NOISE, self.noise).is_err() {
            return None;
        }
        let joints = (self.pose)();
        let features = self.cell.with(|cell| cell.features(&joints))?;
        Some(with_noise(features, self.noise, &mut self.rng))
    }
}

impl<P> std::fmt::Debug for FeatureCamera<P> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FeatureCamera")
            .field("cell", &self.cell)
            .field("noise", &self.noise)
            .finish_non_exhaustive()
    }
}

/// An arm that moves at once, without a controller in between: a [`Manipulator`] and a
/// [`ProximitySensor`].
///
/// On its way it pushes the ball if it runs into it, and carries it if it holds it. With [`Errors`]
/// its gears have play and its encoders count in steps: what it reports is where the motors are,
/// and [`SimulatedArm::pose`] tells where the links are.
#[derive(Clone, Debug)]
pub struct SimulatedArm {
    cell: SharedCell,
    drive: Arc<Mutex<Drive>>,
    grasp: Option<Grasp>,
    contact: Contact,
    stops: usize,
}

impl SimulatedArm {
    /// A perfect arm in `cell`, standing at `joints`.
    ///
    /// # Errors
    /// [`ArmError::JointLimit`] or [`ArmError::NotFinite`] if it cannot stand there.
    pub fn new(cell: SharedCell, joints: Joints) -> Result<Self, ArmError> {
        Self::with_errors(cell, joints, &Errors::none())
    }

    /// An arm with the backlash and the encoder steps of `errors`, sent to `joints` to begin with.
    /// (The other errors are the cell's: [`Errors::apply`].)
    ///
    /// # Errors
    /// As for [`SimulatedArm::new`]; [`ArmError::Setting`] for backlash or an encoder step that no
    /// arm can have (not finite, below zero).
    pub fn with_errors(
        cell: SharedCell,
        joints: Joints,
        errors: &Errors,
    ) -> Result<Self, ArmError> {
        errors.check_drive()?;
        cell.with(|cell| cell.params.check(&joints))?;
        let drive = Arc::new(Mutex::new(Drive::new(joints, errors)));
        Ok(Self {
            cell,
            drive,
            grasp: None,
            contact: Contact::Free,
            stops: 0,
        })
    }

    /// A closure that tells where the links are, now and later: what [`CellCamera::new`] and
    /// [`FeatureCamera::new`] want.
    pub fn pose(&self) -> impl FnMut() -> Joints + Send + use<> {
        let drive = Arc::clone(&self.drive);
        move || locked(&drive).links()
    }

    /// The cell the arm stands in.
    pub fn cell(&self) -> &SharedCell {
        &self.cell
    }

    /// The state of the jaws.
    pub fn gripper(&self) -> Gripper {
        self.cell.with(|cell| cell.jaws)
    }

    /// What closing the jaws came to the last time; `None` before the first.
    pub fn grasp(&self) -> Option<Grasp> {
        self.grasp
    }

    /// What the last move did to the ball.
    pub fn contact(&self) -> Contact {
        self.contact
    }

    /// How often the arm was told to stop.
    pub fn stops(&self) -> usize {
        self.stops
    }
}

impl Manipulator for SimulatedArm {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        Ok(locked(&self.drive).reported())
    }

    fn move_by(&mut self, delta: JointDelta) -> Result<Joints, ArmError> {
        let target = locked(&self.drive).reported() + delta;
        self.move_to(target)
    }

    fn move_to(&mut self, target: Joints) -> Result<Joints, ArmError> {
        let mut drive = locked(&self.drive);
        let contact = self.cell.with(|cell| {
            cell.params.check(&target)?;
            let from = drive.links();
            drive.send(target);
            Ok(cell.sweep(&from, &drive.links()))
        })?;
        self.contact = contact;
        Ok(drive.reported())
    }

    fn set_gripper(&mut self, gripper: Gripper) -> Result<(), ArmError> {
        let joints = locked(&self.drive).links();
        self.cell.with(|cell| match gripper {
            Gripper::Open => cell.open_gripper(),
            Gripper::Closed => self.grasp = Some(cell.close_gripper(&joints)),
        });
        Ok(())
    }

    fn stop(&mut self) -> Result<(), ArmError> {
        self.stops += 1;
        Ok(())
    }
}

impl ProximitySensor for SimulatedArm {
    fn object_near(&mut self) -> Result<bool, ArmError> {
        let joints = locked(&self.drive).links();
        Ok(self.cell.with(|cell| cell.proximity(&joints)))
    }
}
