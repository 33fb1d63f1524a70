//! The crate's own Canny operator.

use image::GrayImage;

use super::maxima::Maxima;
use super::noise::{ROW_STEP, noise_deviation};
use super::rows::{Candidate, STRONG, WEAK};
use super::{EdgeDetector, EdgeMap};
use crate::error::{ConfigError, require};

/// The largest threshold: no gradient is steeper.
pub(super) const MAX_THRESHOLD: f32 = 1141.0;

/// Least low threshold in noise, as a fraction of the high one.
const LOW_FLOOR: f32 = 0.6;

/// The settings of [`Canny`].
///
/// Thresholds are in gray levels of the Sobel gradient's length, `sqrt(gx^2 + gy^2)` with the 3x3
/// kernels that sum to 8 times the slope per pixel; the largest possible value is about 1140. A
/// step of `c` gray levels, smoothed by the default `sigma`, gives about `2.3 c`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct CannyConfig {
    /// A pixel this strong continues an edge (default 30; 0 < low <= high). Lower: longer edges,
    /// and more of them from texture.
    pub low: f32,
    /// A pixel this strong starts an edge (default 70; low..=1141). Lower: fainter balls are seen,
    /// and more clutter.
    pub high: f32,
    /// Deviation of the Gaussian that smooths the frame, pixels (default 1.2; 0..=2, and 0 does not
    /// smooth). Larger: less noise, and corners and small circles rounded off. The kernel is cut
    /// off after 2 px up to 1.25, 3 px up to 1.6, else 4 px.
    pub sigma: f32,
    /// Raises the thresholds in noisy frames: `high` to at least this many times the deviation that
    /// the frame's noise gives to each part of the gradient, `low` to at least 0.6 of that (default
    /// 5; 0..=20, and 0 leaves the thresholds as they are). At 5 noise alone starts about one edge
    /// per frame of 768x576, at 4 a hundred.
    pub noise_factor: f32,
}

impl Default for CannyConfig {
    fn default() -> Self {
        Self {
            low: 30.0,
            high: 70.0,
            sigma: 1.2,
            noise_factor: 5.0,
        }
    }
}

/// Canny's edge operator: smooth, differentiate, thin, and keep what is connected to a strong edge.
///
/// All passes run together over a few rows at a time, in integers, so that the result is the same
/// on every machine. Each edge pixel keeps its gradient, and from that its position to a fraction
/// of a pixel ([`EdgeMap::position`]). The outermost row and column of a frame hold no edges.
#[derive(Clone, Debug)]
pub struct Canny {
    config: CannyConfig,
    thresholds: (f32, f32),
    pub(super) maxima: Maxima,
    /// Pixels of the flood whose neighbours are still to be looked at, as indices.
    open: Vec<u32>,
    pub(super) edges: EdgeMap,
}

impl Canny {
    /// Builds an operator with these settings.
    ///
    /// # Errors
    /// [`ConfigError::Thresholds`] unless `0 < low <= high`, [`ConfigError::OutOfRange`] for
    /// anything else outside its range.
    pub fn new(config: CannyConfig) -> Result<Self, ConfigError> {
        let (sigma, factor) = (config.sigma.into(), config.noise_factor.into());
        check_thresholds(config.low, config.high)?;
        require("sigma", sigma, "0..=2 px", (0.0..=2.0).contains(&sigma))?;
        let usable = (0.0..=20.0).contains(&factor);
        require("noise_factor", factor, "0..=20", usable)?;
        Ok(Self::build(config))
    }

    fn build(config: CannyConfig) -> Self {
        Self {
            config,
            thresholds: (config.low, config.high),
            maxima: Maxima::new(config.sigma),
            open: Vec::new(),
            edges: EdgeMap::default(),
        }
    }

    /// Returns the thresholds `(low, high)` of the last frame, in the units of [`CannyConfig`], as
    /// its noise raised them; before the first frame those of the configuration.
    pub fn thresholds(&self) -> (f32, f32) {
        self.thresholds
    }

    /// Returns the thresholds for a frame with this noise.
    fn thresholds_in(&self, noise: f32) -> (f32, f32) {
        let floor = self.config.noise_factor * noise * self.maxima.noise_gain();
        let high = self.config.high.max(floor).min(MAX_THRESHOLD);
        (self.config.low.max(LOW_FLOOR * floor).min(high), high)
    }
}

impl Default for Canny {
    fn default() -> Self {
        Self::build(CannyConfig::default())
    }
}

impl EdgeDetector for Canny {
    fn detect_edges<'a>(&'a mut self, frame: &GrayImage) -> &'a EdgeMap {
        let (width, height) = frame.dimensions();
        if width < 3 || height < 3 {
            self.edges.clear(width, height);
            return &self.edges;
        }
        let (gray, columns) = (frame.as_raw(), width as usize);
        let noise = if self.config.noise_factor > 0.0 {
            noise_deviation(gray, columns, ROW_STEP)
        } else {
            0.0
        };
        self.thresholds = self.thresholds_in(noise);
        let (maxima, open, thresholds) = (&mut self.maxima, &mut self.open, self.thresholds);
        self.edges
            .repaint(width, height, |image, pixels, gradients| {
                let candidates = maxima.mark(gray, columns, thresholds, image);
                // At most all of them are open; so the shape of the edges does not decide whether
                // memory is asked for.
                open.reserve(candidates.len());
                pixels.reserve(candidates.len());
                gradients.reserve(candidates.len());
                follow(image, columns, candidates, open);
                for candidate in candidates {
                    let kept = &mut image
                        [candidate.pixel.y as usize * columns + candidate.pixel.x as usize];
                    if *kept == EDGE {
                        pixels.push(candidate.pixel);
                        gradients.push(candidate.gradient);
                    } else {
                        *kept = 0;
                    }
                }
            });
        &self.edges
    }

    fn edges(&self) -> &EdgeMap {
        &self.edges
    }
}

pub(super) const EDGE: u8 = 255;

/// Hysteresis: marks as edges the strong candidates and the weak ones that touch an edge, also by a
/// corner.
fn follow(image: &mut [u8], width: usize, candidates: &[Candidate], open: &mut Vec<u32>) {
    for candidate in candidates {
        let seed = candidate.pixel.y as usize * width + candidate.pixel.x as usize;
        if image[seed] == STRONG {
            image[seed] = EDGE;
            open.push(seed as u32);
        }
        while let Some(index) = open.pop() {
            // Candidates never lie on the border. A strong neighbour has its own turn as a seed.
            for centre in [
                index as usize - width,
                index as usize,
                index as usize + width,
            ] {
                for (pixel, mark) in (centre - 1..).zip(&mut image[centre - 1..=centre + 1]) {
                    if *mark == WEAK {
                        *mark = EDGE;
                        open.push(pixel as u32);
                    }
                }
            }
        }
    }
}

/// The thresholds of either Canny operator.
pub(super) fn check_thresholds(low: f32, high: f32) -> Result<(), ConfigError> {
    if !(low > 0.0 && low <= high) {
        return Err(ConfigError::Thresholds {
            low: low.into(),
            high: high.into(),
        });
    }
    require("high", high.into(), "at most 1141", high <= MAX_THRESHOLD)
}
