//! The door of every circle detector.

use image::GrayImage;

use crate::Circle;

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
/// A detector owns its buffers, hence `&mut self`; what it finds depends on its configuration (seed included) and on the
/// frame, never on the frames before it.
pub trait CircleDetector {
    /// Replaces the content of `found` by the circles of `frame`, best first.
    ///
    /// A frame without circles, the empty frame among them, leaves `found` empty.
    fn detect_into(&mut self, frame: &GrayImage, found: &mut Vec<Detection>);

    /// The circles of `frame`, best first.
    fn detect(&mut self, frame: &GrayImage) -> Vec<Detection> {
        let mut found = Vec::new();
        self.detect_into(frame, &mut found);
        found
    }
}
