//! The eye of an agent: a camera, and what is looked for in its frames.

use hough_heuristic::image::GrayImage;
use hough_heuristic::{CircleDetector, FrameError, FrameSource};

use crate::percept::Sighting;
use crate::sight::target::{BallTarget, Target};

/// Looks for the ball, or an object in its place, from the camera's present pose.
pub trait Eye {
    /// Takes a new frame and returns the ball in it, if there is one.
    ///
    /// # Errors
    /// Reason why the camera delivered no frame, or the frame could not be searched.
    fn look(&mut self) -> Result<Option<Sighting>, FrameError>;

    /// Returns the frame of the last look; `None` for eyes without frames.
    fn frame(&self) -> Option<&GrayImage> {
        None
    }
}

/// A camera and a detector as one function.
impl<F: FnMut() -> Result<Option<Sighting>, FrameError>> Eye for F {
    fn look(&mut self) -> Result<Option<Sighting>, FrameError> {
        self()
    }
}

/// A camera and the target that is looked for in its frames.
pub struct CameraEye<'a> {
    source: &'a mut dyn FrameSource,
    target: Box<dyn Target + 'a>,
    frame: Option<GrayImage>,
}

impl<'a> CameraEye<'a> {
    /// Creates an eye that looks for a ball: the best circle of `detector` with its centre in the
    /// frame.
    pub fn new(source: &'a mut dyn FrameSource, detector: &'a mut dyn CircleDetector) -> Self {
        Self::looking_for(source, BallTarget::new(detector))
    }

    /// Creates an eye that looks for any target.
    pub fn looking_for(source: &'a mut dyn FrameSource, target: impl Target + 'a) -> Self {
        Self {
            source,
            target: Box::new(target),
            frame: None,
        }
    }
}

impl Eye for CameraEye<'_> {
    fn look(&mut self) -> Result<Option<Sighting>, FrameError> {
        let frame = self.frame.get_or_insert_default();
        self.source.grab(frame)?;
        self.target.find(frame)
    }

    fn frame(&self) -> Option<&GrayImage> {
        self.frame.as_ref()
    }
}

impl std::fmt::Debug for CameraEye<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("CameraEye").finish_non_exhaustive()
    }
}
