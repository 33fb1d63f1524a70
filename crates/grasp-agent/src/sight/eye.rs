//! The eye: where the features of the ball come from.

use hough_heuristic::image::GrayImage;
use hough_heuristic::{CircleDetector, FrameError, FrameSource};

use crate::percept::Sighting;

use crate::sight::target::{BallFeatures, ObjectFeatures};

/// Looks for the ball from where the camera is now.
pub trait Eye {
    /// One look.
    ///
    /// # Errors
    /// Whatever kept the camera from delivering a frame.
    fn look(&mut self) -> Result<Look, FrameError>;
}

/// What one look brought.
#[derive(Clone, Debug, Default)]
pub struct Look {
    /// The frame that was looked at; `None` from an eye that needs none.
    pub frame: Option<GrayImage>,
    /// The ball, or the object in its place, if it was found.
    pub ball: Option<Sighting>,
}

/// A camera, and what is looked for in its frames.
pub struct CameraEye<'a> {
    source: &'a mut dyn FrameSource,
    object: Box<dyn ObjectFeatures + 'a>,
}

impl<'a> CameraEye<'a> {
    /// An eye that takes frames from `source` and looks for the ball with `detector`: see
    /// [`BallFeatures`].
    pub fn new(source: &'a mut dyn FrameSource, detector: &'a mut dyn CircleDetector) -> Self {
        Self::looking_for(source, BallFeatures::new(detector))
    }

    /// An eye that takes frames from `source` and looks for any object in them.
    pub fn looking_for(source: &'a mut dyn FrameSource, object: impl ObjectFeatures + 'a) -> Self {
        Self {
            source,
            object: Box::new(object),
        }
    }
}

impl Eye for CameraEye<'_> {
    fn look(&mut self) -> Result<Look, FrameError> {
        let mut frame = GrayImage::default();
        self.source.grab(&mut frame)?;
        let ball = self.object.find(&frame);
        Ok(Look {
            frame: Some(frame),
            ball,
        })
    }
}

impl std::fmt::Debug for CameraEye<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("CameraEye").finish_non_exhaustive()
    }
}
