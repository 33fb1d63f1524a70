//! The door of every circle detector.

use std::time::Duration;

use image::GrayImage;

use crate::acceptance::explained_band;
use crate::circle::Circle;
use crate::curve::Curve;
use crate::edges::{EdgeMap, EdgePixel};
use crate::error::ConfigError;

/// A circle that a detector reports, with how far to trust it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Detection {
    /// The circle, in pixels of the frame.
    pub circle: Circle,
    /// 0..=1, higher is better. What it measures is stated by the detector.
    pub score: f64,
}

/// Finds circles in monochrome frames.
///
/// A detector owns its buffers, hence `&mut self`; what it finds depends on its configuration (seed
/// included) and on the frame, never on the frames before it. One method is the work; the others
/// have a default.
pub trait CircleDetector {
    /// Replaces the content of `found` by the circles of `frame`, best first.
    ///
    /// A frame without circles, the empty frame among them, leaves `found` empty, and so does one
    /// that [`check_frame`](CircleDetector::check_frame) refuses;
    /// [`try_detect_into`](CircleDetector::try_detect_into) says which it was.
    fn detect_into(&mut self, frame: &GrayImage, found: &mut Vec<Detection>);

    /// The circles of `frame`, best first.
    fn detect(&mut self, frame: &GrayImage) -> Vec<Detection> {
        let mut found = Vec::new();
        self.detect_into(frame, &mut found);
        found
    }

    /// Whether the configuration suits frames of `width` x `height` pixels. By default every one
    /// does.
    ///
    /// # Errors
    /// [`ConfigError::Region`] if the region of interest sticks out of such a frame,
    /// [`ConfigError::Accumulator`] if the frame needs more memory than the detector may take.
    fn check_frame(&self, width: u32, height: u32) -> Result<(), ConfigError> {
        let _ = (width, height);
        Ok(())
    }

    /// [`detect_into`](CircleDetector::detect_into), for a frame whose size is not known
    /// beforehand.
    ///
    /// # Errors
    /// Those of [`check_frame`](CircleDetector::check_frame); `found` is then empty.
    fn try_detect_into(
        &mut self,
        frame: &GrayImage,
        found: &mut Vec<Detection>,
    ) -> Result<(), ConfigError> {
        found.clear();
        self.check_frame(frame.width(), frame.height())?;
        self.detect_into(frame, found);
        Ok(())
    }

    /// Whether to remember the candidates of each frame from now on, for
    /// [`stages`](CircleDetector::stages). Detectors do not unless asked to.
    fn keep_candidates(&mut self, keep: bool) {
        let _ = keep;
    }

    /// What lies between the last frame and its circles; none for a detector that does not show it.
    /// A frame that [`check_frame`](CircleDetector::check_frame) refuses is not looked at, and
    /// leaves those of the frame before.
    fn stages(&self) -> Option<Stages<'_>> {
        None
    }
}

/// The stages of a detector's last frame: for pictures (`write_stages`) and timing.
#[derive(Clone, Copy, Debug)]
pub struct Stages<'a> {
    /// The edges that the detector worked on.
    pub edges: &'a EdgeMap,
    /// The circles that it looked at closely, in the order in which it did, if they are
    /// [kept](CircleDetector::keep_candidates).
    pub candidates: &'a [Circle],
    /// How long each stage took.
    pub times: StageTimes,
    /// How far an edge pixel may lie from a circle's pixel to match it, pixels.
    pub tolerance: f64,
}

impl Stages<'_> {
    /// Whether the circle, once accepted, explains the edge pixel: such pixels are taken out of
    /// `D`.
    pub fn explains(&self, circle: &Circle, pixel: EdgePixel) -> bool {
        circle.distance(pixel.x.into(), pixel.y.into())
            <= explained_band(self.tolerance, circle.radius)
    }
}

/// How long the stages of the last frame took, on the wall clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StageTimes {
    /// Finding the edges.
    pub edges: Duration,
    /// Arranging the edge pixels as the structure `D`, and marking what lies near them.
    pub structure: Duration,
    /// The search for circles: drawing or voting, checking, fitting.
    pub search: Duration,
}

impl StageTimes {
    /// All stages together.
    pub fn total(&self) -> Duration {
        self.edges + self.structure + self.search
    }
}
