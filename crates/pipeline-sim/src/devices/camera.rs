//! The camera on the hand, with and without frames.

use std::collections::VecDeque;

use hough_heuristic::image::{GrayImage, imageops};
use hough_heuristic::{Features, FrameError, FrameSource};
use puma_val2::Joints;
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

use crate::cell::errors::Glitch;
use crate::cell::geometry::Cell;
use crate::cell::noise::with_noise;
use crate::devices::shared_cell::{SharedCell, remove_ball};
use crate::error::QuantityError;
use crate::render::renderer::Renderer;
use crate::render::shot::Shot;

/// The camera on the hand as a [`FrameSource`]: every grab renders the cell as it is, with the
/// joints where they are, with the errors of the cell ([`SharedCell::set_errors`]).
///
/// A closure supplies the joints, so that any arm will do: [`SimulatedArm::pose`] or the pose of an
/// emulated controller. Frames are taken in an instant unless [`CellCamera::exposed`] sets an
/// exposure.
///
/// [`SimulatedArm::pose`]: crate::SimulatedArm::pose
pub struct CellCamera<P> {
    cell: SharedCell,
    renderer: Renderer,
    pose: P,
    exposure: Option<(Shot, Box<Moved>)>,
    rng: Xoshiro256PlusPlus,
    late: VecDeque<GrayImage>,
}

/// Returns cell and joints some seconds later, or before.
type Moved = dyn FnMut(&Cell, &Joints, f64) -> (Cell, Joints) + Send;

impl<P: FnMut() -> Joints> CellCamera<P> {
    /// Creates a camera in `cell` at the pose that `pose` returns.
    pub fn new(cell: SharedCell, renderer: Renderer, pose: P) -> Self {
        let rng = Xoshiro256PlusPlus::seed_from_u64(renderer.seed());
        Self {
            cell,
            renderer,
            pose,
            exposure: None,
            rng,
            late: VecDeque::new(),
        }
    }

    /// Gives the frames an exposure time, of one field or two. `moved` receives the cell and the
    /// joints in the middle of the exposure and a time t, and returns both t seconds later (earlier
    /// for t below zero).
    ///
    /// The truth of the frame, and [`Cell::features`], hold for the middle of the exposure.
    ///
    /// ```
    /// use pipeline_sim::hough_heuristic::FrameSource;
    /// use pipeline_sim::image::GrayImage;
    /// use pipeline_sim::{Ball, Cell, CellCamera, Renderer, Scene, SharedCell, Shot, Workspace};
    ///
    /// fn main() -> Result<(), Box<dyn std::error::Error>> {
    ///     let cell = SharedCell::new(Cell::paper(Ball::at(0.6, 0.15, -0.1)));
    ///     let pose = Workspace::paper().search_poses()[3];
    ///     let renderer = Renderer::new(&Scene::laboratory(), 1);
    ///     // PAL, each field exposed for 10 ms, while the waist turns by 20 degrees a second.
    ///     let mut camera = CellCamera::new(cell, renderer, move || pose).exposed(
    ///         Shot::pal(0.010, 4),
    ///         |cell, joints, seconds| {
    ///             let mut then = *joints;
    ///             then.0[0] += 20.0_f64.to_radians() * seconds;
    ///             (*cell, then)
    ///         },
    ///     )?;
    ///     let mut frame = GrayImage::default();
    ///     camera.grab(&mut frame)?;
    ///     assert_eq!(frame.dimensions(), (768, 576));
    ///     Ok(())
    /// }
    /// ```
    ///
    /// # Errors
    /// [`QuantityError`] names the quantity of `shot` that is out of range.
    pub fn exposed(
        mut self,
        shot: Shot,
        moved: impl FnMut(&Cell, &Joints, f64) -> (Cell, Joints) + Send + 'static,
    ) -> Result<Self, QuantityError> {
        shot.check()?;
        self.exposure = Some((shot, Box::new(moved)));
        Ok(self)
    }
}

impl<P: FnMut() -> Joints> FrameSource for CellCamera<P> {
    /// Renders the next frame.
    ///
    /// # Errors
    /// [`FrameError::Failed`] if the joints, or those of a moment of the exposure, are not finite.
    fn grab(&mut self, frame: &mut GrayImage) -> Result<(), FrameError> {
        let joints = (self.pose)();
        let mut wrong = joints.non_finite();
        let (mut cell, errors) = (self.cell.get(), self.cell.errors());
        match errors.glitch(&mut self.rng) {
            Glitch::None => {}
            Glitch::Missed => remove_ball(&mut cell),
            Glitch::Outlier(features) => {
                if let Some(elsewhere) = cell.ball_showing(&joints, &features) {
                    remove_ball(&mut cell);
                    cell.ball.centre = elsewhere;
                }
            }
        }
        if wrong.is_none() {
            match &mut self.exposure {
                None => drop(self.renderer.render(&cell, &joints)),
                Some((shot, moved)) => {
                    self.renderer.take(shot, |t| {
                        let (cell, joints) = moved(&cell, &joints, t - shot.middle());
                        wrong = wrong.or(joints.non_finite());
                        (cell, joints)
                    });
                }
            }
        }
        if let Some(joint) = wrong {
            return Err(FrameError::Failed {
                origin: "simulated camera".to_owned(),
                reason: format!("the angle of {joint} is not a finite number"),
            });
        }
        frame.clone_from(self.renderer.frame());
        if errors.mirrored {
            imageops::flip_horizontal_in_place(frame);
        }
        if errors.lag > 0 {
            self.late.push_back(frame.clone());
            if let Some(late) = delayed(&mut self.late, errors.lag) {
                *frame = late;
            }
        }
        Ok(())
    }
}

impl<P> std::fmt::Debug for CellCamera<P> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let shot = self.exposure.as_ref().map(|(shot, _)| shot);
        f.debug_struct("CellCamera")
            .field("cell", &self.cell)
            .field("shot", &shot)
            .finish_non_exhaustive()
    }
}

/// Camera and detector in one: the ball's features from the geometry, with the errors of the cell
/// ([`SharedCell::set_errors`]), without a frame.
pub struct FeatureCamera<P> {
    cell: SharedCell,
    pose: P,
    rng: Xoshiro256PlusPlus,
    late: VecDeque<Option<Features>>,
}

impl<P: FnMut() -> Joints> FeatureCamera<P> {
    /// Creates a camera in `cell` at the pose that `pose` returns; its errors are drawn from
    /// `seed`.
    pub fn new(cell: SharedCell, pose: P, seed: u64) -> Self {
        Self {
            cell,
            pose,
            rng: Xoshiro256PlusPlus::seed_from_u64(seed),
            late: VecDeque::new(),
        }
    }

    /// Returns the features that a detector would find; `None` if the ball counts as lost.
    pub fn look(&mut self) -> Option<Features> {
        let (joints, errors) = ((self.pose)(), self.cell.errors());
        let seen = match errors.glitch(&mut self.rng) {
            Glitch::None => self.cell.with(|cell| cell.features(&joints)).ok(),
            Glitch::Missed => None,
            Glitch::Outlier(features) => Some(features),
        };
        let mut seen = seen.map(|f| with_noise(f, errors.feature_noise, &mut self.rng));
        if let Some(features) = seen.as_mut().filter(|_| errors.mirrored) {
            features.x = Features::WIDTH - features.x;
        }
        self.late.push_back(seen);
        delayed(&mut self.late, errors.lag).flatten()
    }
}

/// Takes the image that is `lag` frames older than the newest, which is the last of the queue.
/// While the queue is shorter, takes the oldest one.
fn delayed<T: Clone>(queue: &mut VecDeque<T>, lag: usize) -> Option<T> {
    while queue.len() > lag + 1 {
        queue.pop_front();
    }
    if queue.len() == lag + 1 {
        queue.pop_front()
    } else {
        queue.front().cloned()
    }
}

impl<P> std::fmt::Debug for FeatureCamera<P> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FeatureCamera")
            .field("cell", &self.cell)
            .finish_non_exhaustive()
    }
}
