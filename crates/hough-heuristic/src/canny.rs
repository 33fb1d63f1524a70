//! Canny's edge operator.

use image::GrayImage;

use crate::error::require;
use crate::{ConfigError, EdgeDetector, EdgeMap};

/// The settings of [`Canny`].
///
/// Thresholds are in grey levels of the Sobel gradient's length, `sqrt(gx^2 + gy^2)` with the 3x3 kernels that sum to 8
/// times the slope per pixel; the largest possible value is about 1140. A step of `c` grey levels, smoothed as it is
/// here, gives about `2 c`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CannyConfig {
    /// A pixel this strong continues an edge (default 30; 0 < low <= high). Lower: longer edges, and more of them from texture.
    pub low: f32,
    /// A pixel this strong starts an edge (default 70; low..=1140). Lower: fainter balls are seen, and more clutter.
    pub high: f32,
}

impl Default for CannyConfig {
    fn default() -> Self {
        Self {
            low: 30.0,
            high: 70.0,
        }
    }
}

/// Canny's edge operator: smooth, differentiate, thin, and keep what is connected to a strong edge.
#[derive(Clone, Debug, Default)]
pub struct Canny {
    config: CannyConfig,
    edges: EdgeMap,
}

impl Canny {
    /// An operator with these thresholds.
    ///
    /// # Errors
    /// [`ConfigError::Thresholds`] unless `0 < low <= high`, [`ConfigError::OutOfRange`] for a `high` above 1141.
    pub fn new(config: CannyConfig) -> Result<Self, ConfigError> {
        let CannyConfig { low, high } = config;
        if !(low > 0.0 && low <= high) {
            return Err(ConfigError::Thresholds {
                low: low.into(),
                high: high.into(),
            });
        }
        require("high", high.into(), "at most 1141", high <= 1141.0)?;
        Ok(Self {
            config,
            edges: EdgeMap::default(),
        })
    }
}

impl EdgeDetector for Canny {
    fn detect_edges<'a>(&'a mut self, frame: &GrayImage) -> &'a EdgeMap {
        if frame.width() < 3 || frame.height() < 3 {
            self.edges.clear(frame.width(), frame.height());
        } else {
            let CannyConfig { low, high } = self.config;
            self.edges.copy_from(&imageproc::edges::canny(frame, low, high));
        }
        &self.edges
    }

    fn edges(&self) -> &EdgeMap {
        &self.edges
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thresholds_are_checked() {
        for (low, high) in [
            (0.0, 10.0),
            (-1.0, 5.0),
            (20.0, 10.0),
            (f32::NAN, 1.0),
            (1.0, f32::NAN),
        ] {
            assert!(Canny::new(CannyConfig { low, high }).is_err(), "{low} {high}");
        }
        let error = Canny::new(CannyConfig { low: 5.0, high: 2e3 }).unwrap_err();
        assert!(error.to_string().contains("2000"), "{error}");
    }

    #[test]
    fn frames_of_every_small_size_pass() {
        let mut canny = Canny::default();
        for width in 0..12 {
            for height in 0..12 {
                let frame = GrayImage::from_fn(width, height, |x, _| {
                    image::Luma([if x > width / 2 { 255 } else { 0 }])
                });
                let edges = canny.detect_edges(&frame);
                assert_eq!((edges.width(), edges.height()), (width, height));
            }
        }
        assert!(!canny.edges().pixels().is_empty());
    }
}
