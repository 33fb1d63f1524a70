//! The crate's own Canny operator.

use image::GrayImage;

use super::noise::{ROW_STEP, noise_deviation};
use super::rows::{Candidate, Passes, Rows, STRONG, UNITS, WEAK};
use super::smoothing::{noise_gain, smoothing_weights};
use super::{EdgeDetector, EdgeMap, dispatch};
use crate::error::{ConfigError, require};

/// The largest threshold: no gradient is steeper.
pub(super) const MAX_THRESHOLD: f32 = 1141.0;

/// Low threshold in noise, as a share of the high one.
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
    passes: Passes,
    /// Deviation of each part of the gradient, in gray levels, under noise of deviation 1.
    noise_gain: f32,
    rows: Rows,
    candidates: Vec<Candidate>,
    /// Pixels of the flood whose neighbours are still to be looked at, as indices.
    open: Vec<u32>,
    edges: EdgeMap,
}

impl Canny {
    /// An operator with these settings.
    ///
    /// # Errors
    /// [`ConfigError::Thresholds`] unless `0 < low <= high`, [`ConfigError::OutOfRange`] for
    /// anything else outside its range.
    pub fn new(config: CannyConfig) -> Result<Self, ConfigError> {
        check_thresholds(config.low, config.high)?;
        let CannyConfig {
            sigma,
            noise_factor,
            ..
        } = config;
        require(
            "sigma",
            sigma.into(),
            "0..=2 px",
            (0.0..=2.0).contains(&sigma),
        )?;
        require(
            "noise_factor",
            noise_factor.into(),
            "0..=20",
            (0.0..=20.0).contains(&noise_factor),
        )?;
        Ok(Self::build(config))
    }

    fn build(config: CannyConfig) -> Self {
        let weights = smoothing_weights(config.sigma);
        Self {
            config,
            thresholds: (config.low, config.high),
            noise_gain: noise_gain(&weights),
            passes: Passes {
                weights,
                low: 0,
                high: 0,
            },
            rows: Rows::default(),
            candidates: Vec::new(),
            open: Vec::new(),
            edges: EdgeMap::default(),
        }
    }

    /// The thresholds `(low, high)` of the last frame, in the units of [`CannyConfig`], as its
    /// noise raised them; before the first frame those of the configuration.
    pub fn thresholds(&self) -> (f32, f32) {
        self.thresholds
    }

    /// Sets the thresholds for a frame with this noise.
    fn set_thresholds(&mut self, noise: f32) {
        let CannyConfig {
            low,
            high,
            noise_factor,
            ..
        } = self.config;
        let floor = noise_factor * noise * self.noise_gain;
        let high = high.max(floor).min(MAX_THRESHOLD);
        let low = low.max(LOW_FLOOR * floor).min(high);
        self.thresholds = (low, high);
        // The passes compare squares, in units of their own.
        let square = |threshold: f32| {
            let threshold = threshold * UNITS;
            (threshold * threshold) as i32
        };
        self.passes.low = square(low);
        self.passes.high = square(high);
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
        let gray = frame.as_raw();
        let columns = width as usize;
        let noise = if self.config.noise_factor > 0.0 {
            noise_deviation(gray, columns, ROW_STEP)
        } else {
            0.0
        };
        self.set_thresholds(noise);

        let Self {
            passes,
            rows,
            candidates,
            open,
            ..
        } = self;
        candidates.clear();
        self.edges
            .repaint(width, height, |image, pixels, gradients| {
                dispatch::candidates(passes, gray, columns, rows, image, candidates);
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

const EDGE: u8 = 255;

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edges::{EdgePixel, plain};
    use proptest::prelude::*;

    #[test]
    fn settings_are_checked() {
        let with = |low, high| CannyConfig {
            low,
            high,
            ..CannyConfig::default()
        };
        for (low, high) in [
            (0.0, 10.0),
            (-1.0, 5.0),
            (20.0, 10.0),
            (f32::NAN, 1.0),
            (1.0, f32::NAN),
        ] {
            assert!(Canny::new(with(low, high)).is_err(), "{low} {high}");
        }
        let error = Canny::new(with(5.0, 2e3)).unwrap_err();
        assert!(error.to_string().contains("2000"), "{error}");
        for (sigma, noise_factor) in [
            (2.5, 1.0),
            (-1.0, 1.0),
            (f32::NAN, 1.0),
            (1.0, -1.0),
            (1.0, f32::NAN),
        ] {
            let config = CannyConfig {
                sigma,
                noise_factor,
                ..CannyConfig::default()
            };
            assert!(Canny::new(config).is_err(), "{sigma} {noise_factor}");
        }
    }

    #[test]
    fn frames_of_every_small_size_pass() {
        for sigma in [0.0, 1.2, 1.5, 2.0] {
            let mut canny = Canny::new(CannyConfig {
                sigma,
                ..CannyConfig::default()
            })
            .unwrap();
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

    /// Frames with flat parts, steps and texture, of sizes around the block size.
    fn frames() -> impl Strategy<Value = GrayImage> {
        (3u32..80, 3u32..40, any::<u64>(), 1u8..=255).prop_map(
            |(width, height, seed, roughness)| {
                let mut state = seed | 1;
                GrayImage::from_fn(width, height, |x, y| {
                    state = state
                        .wrapping_mul(6_364_136_223_846_793_005)
                        .wrapping_add(1);
                    let texture = (state >> 56) as u8 % roughness;
                    let step = if (x + y) % 37 < 18 { 90 } else { 0 };
                    image::Luma([texture.saturating_add(step)])
                })
            },
        )
    }

    proptest! {
        #[test]
        fn every_path_gives_what_the_plain_version_gives(
            frame in frames(), sigma in 0f32..=2.0, low in 1f32..300.0, ratio in 1f32..3.0
        ) {
            let config = CannyConfig { sigma, low, high: low * ratio, noise_factor: 0.0 };
            let mut canny = Canny::new(config).unwrap();
            canny.set_thresholds(0.0);
            let (gray, width) = (frame.as_raw(), frame.width() as usize);
            let expected = plain::maxima(&canny.passes, gray, width);
            let mut expected_marks = vec![0; gray.len()];
            for maximum in &expected {
                expected_marks[maximum.index] = maximum.mark;
            }
            for path in [dispatch::candidates, dispatch::candidates_baseline] {
                let mut marks = vec![77; gray.len()];
                let mut found = Vec::new();
                path(&canny.passes, gray, width, &mut canny.rows, &mut marks, &mut found);
                prop_assert_eq!(&marks, &expected_marks);
                // The list is the same without marks.
                let mut unmarked = Vec::new();
                path(&canny.passes, gray, width, &mut canny.rows, &mut [], &mut unmarked);
                prop_assert_eq!(&unmarked, &found);
                let index = |pixel: EdgePixel| pixel.y as usize * width + pixel.x as usize;
                let listed: Vec<_> = found.iter().map(|found| index(found.pixel)).collect();
                let indices: Vec<_> = expected.iter().map(|maximum| maximum.index).collect();
                prop_assert_eq!(listed, indices);
                for (candidate, maximum) in found.iter().zip(&expected) {
                    let gradient = candidate.gradient;
                    prop_assert_eq!(gradient.vector(), maximum.vector);
                    prop_assert!((gradient.strength() - maximum.strength).abs() < 1e-9);
                    let ((x, y), (u, v)) = (gradient.offset(), maximum.offset);
                    let off = (x - u).abs().max((y - v).abs());
                    prop_assert!(off < 1e-9, "{:?} {:?}", candidate, maximum);
                }
            }
        }

        #[test]
        fn image_and_list_agree(frame in frames()) {
            let mut canny = Canny::default();
            let edges = canny.detect_edges(&frame);
            let again = EdgeMap::from_image(edges.image());
            prop_assert_eq!(again.pixels(), edges.pixels());
            prop_assert_eq!(edges.gradients.len(), edges.pixels().len());
            prop_assert!(edges.image().as_raw().iter().all(|&gray| gray == 0 || gray == EDGE));
        }
    }

    #[test]
    fn a_slanted_border_is_located_to_a_twentieth_of_a_pixel() {
        for degrees in (0..180).step_by(7) {
            let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
            let distance = |x: f64, y: f64| (x - 40.2) * cos + (y - 39.6) * sin;
            let frame = GrayImage::from_fn(80, 80, |x, y| {
                let cover = (distance(x.into(), y.into()) + 0.5).clamp(0.0, 1.0);
                image::Luma([(50.0 + 120.0 * cover) as u8])
            });
            let mut canny = Canny::default();
            let edges = canny.detect_edges(&frame);
            assert!(edges.pixels().len() > 50);
            let mut errors = Vec::new();
            for (index, gradient) in edges.gradients.iter().enumerate() {
                let (x, y) = edges.position(index);
                if (6.0..73.0).contains(&x) && (6.0..73.0).contains(&y) {
                    errors.push(distance(x, y).abs());
                    let (gx, gy) = gradient.vector();
                    let along = (gx * cos + gy * sin) / gradient.strength();
                    assert!(along > 0.998, "{degrees}: direction off by {along}");
                }
            }
            let mean = errors.iter().sum::<f64>() / errors.len() as f64;
            assert!(mean < 0.05, "{degrees}: {mean}");
        }
    }

    #[test]
    fn noise_raises_the_thresholds() {
        let mut state = 1u64;
        let mut noise = || {
            // The sum of twelve uniform numbers is close to normal, with deviation 1.
            (0..12)
                .map(|_| {
                    state = state
                        .wrapping_mul(6_364_136_223_846_793_005)
                        .wrapping_add(1);
                    (state >> 40) as f32 / (1u64 << 24) as f32 - 0.5
                })
                .sum::<f32>()
        };
        for deviation in [5.0f32, 15.0, 30.0] {
            let frame = GrayImage::from_fn(400, 300, |_, _| {
                image::Luma([(128.0 + deviation * noise()).round() as u8])
            });
            let estimate = noise_deviation(frame.as_raw(), 400, ROW_STEP);
            assert!(
                (estimate / deviation - 1.0).abs() < 0.1,
                "{deviation}: {estimate}"
            );
            let operator = |noise_factor| {
                let config = CannyConfig {
                    noise_factor,
                    ..CannyConfig::default()
                };
                let mut canny = Canny::new(config).unwrap();
                canny.detect_edges(&frame);
                canny
            };
            assert_eq!(operator(0.0).thresholds(), (30.0, 70.0));
            let raised = operator(5.0);
            let high = 5.0 * estimate * raised.noise_gain;
            assert_eq!(
                raised.thresholds().1.to_bits(),
                high.max(70.0).to_bits(),
                "{deviation}"
            );
            let count = |noise_factor| operator(noise_factor).edges().pixels().len();
            assert!(count(5.0) < 60, "{deviation}: {}", count(5.0));
            assert!(
                deviation < 20.0 || count(0.0) > 3000,
                "{deviation}: {}",
                count(0.0)
            );
        }
    }
}
