//! The eye: where the features of the ball come from.

use hough_heuristic::image::GrayImage;
use hough_heuristic::{CircleDetector, Detection, Features, FrameError, FrameSource};

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
    /// The ball, if it was found.
    pub ball: Option<Sighting>,
}

/// A ball in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sighting {
    /// The circle in pixels of the frame, with its score.
    pub detection: Detection,
    /// The same in feature units.
    pub features: Features,
}

/// A camera with a circle detector behind it.
pub struct CameraEye<'a> {
    source: &'a mut dyn FrameSource,
    detector: &'a mut dyn CircleDetector,
    found: Vec<Detection>,
}

impl<'a> CameraEye<'a> {
    /// An eye that takes frames from `source` and finds circles with `detector`.
    ///
    /// The ball is the best circle whose centre lies in the frame.
    pub fn new(source: &'a mut dyn FrameSource, detector: &'a mut dyn CircleDetector) -> Self {
        Self {
            source,
            detector,
            found: Vec::new(),
        }
    }
}

impl Eye for CameraEye<'_> {
    fn look(&mut self) -> Result<Look, FrameError> {
        let frame = self.source.grab()?;
        self.detector.detect_into(&frame, &mut self.found);
        let height = Features::WIDTH * f64::from(frame.height()) / f64::from(frame.width());
        let ball = self.found.iter().find_map(|detection| {
            let features = Features::from_circle(&detection.circle, frame.width());
            let inside =
                (0.0..=Features::WIDTH).contains(&features.x) && (0.0..=height).contains(&features.y);
            (inside && features.r.is_finite()).then_some(Sighting {
                detection: *detection,
                features,
            })
        });
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
