//! Canny's operator as the crate `imageproc` has it.

use image::GrayImage;

use super::canny::check_thresholds;
use super::{EdgeDetector, EdgeMap};
use crate::error::ConfigError;

/// Canny's operator of the crate `imageproc`: an independent second opinion, some thirty times as
/// slow as [`Canny`].
///
/// Smooths with a Gaussian of 1.4 px. Allocates its planes anew for every frame, and knows no
/// gradients.
///
/// [`Canny`]: crate::Canny
#[derive(Clone, Debug)]
pub struct ImageprocCanny {
    low: f32,
    high: f32,
    edges: EdgeMap,
}

impl ImageprocCanny {
    /// An operator with these thresholds, in the units of [`CannyConfig`](crate::CannyConfig).
    ///
    /// # Errors
    /// [`ConfigError::Thresholds`] unless `0 < low <= high`, [`ConfigError::OutOfRange`] for a
    /// `high` above 1141.
    pub fn new(low: f32, high: f32) -> Result<Self, ConfigError> {
        check_thresholds(low, high)?;
        Ok(Self {
            low,
            high,
            edges: EdgeMap::default(),
        })
    }
}

impl EdgeDetector for ImageprocCanny {
    fn detect_edges<'a>(&'a mut self, frame: &GrayImage) -> &'a EdgeMap {
        if frame.width() < 3 || frame.height() < 3 {
            self.edges.clear(frame.width(), frame.height());
        } else {
            let edges = imageproc::edges::canny(frame, self.low, self.high);
            self.edges.copy_from(&edges);
        }
        &self.edges
    }

    fn edges(&self) -> &EdgeMap {
        &self.edges
    }
}
