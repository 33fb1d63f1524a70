//! The eye: a camera and a circle detector, from which the features of the ball come.

use hough_heuristic::image::GrayImage;
use hough_heuristic::{CircleDetector, Detection, Features, FrameError, FrameSource};

/// A camera with a circle detector behind it.
pub struct Eye<'a> {
    source: &'a mut dyn FrameSource,
    detector: &'a mut dyn CircleDetector,
    found: Vec<Detection>,
}

/// What one look brought.
#[derive(Clone, Debug)]
pub struct Look {
    /// The frame that was looked at.
    pub frame: GrayImage,
    /// The ball, if it was found: the best circle whose centre lies in the frame.
    pub ball: Option<Sighting>,
}

/// A ball in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// The circle in pixels of the frame, with its score.
    pub detection: Detection,
    /// The same in feature units.
    pub features: Features,
}

impl<'a> Eye<'a> {
    /// An eye that takes frames from `source` and finds circles with `detector`.
    pub fn new(source: &'a mut dyn FrameSource, detector: &'a mut dyn CircleDetector) -> Self {
        Self {
            source,
            detector,
            found: Vec::new(),
        }
    }

    /// Grabs a frame and looks for the ball in it.
    ///
    /// # Errors
    /// Whatever kept the source from delivering a frame.
    pub fn look(&mut self) -> Result<Look, FrameError> {
        let frame = self.source.grab()?;
        self.detector.detect_into(&frame, &mut self.found);
        let ball = self.found.iter().find_map(|detection| {
            let features = Features::from_circle(&detection.circle, frame.width());
            let inside = (0.0..=Features::WIDTH).contains(&features.x)
                && (0.0..=Features::HEIGHT).contains(&features.y);
            (inside && features.r.is_finite()).then_some(Sighting {
                detection: *detection,
                features,
            })
        });
        Ok(Look { frame, ball })
    }
}

impl std::fmt::Debug for Eye<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Eye").finish_non_exhaustive()
    }
}
