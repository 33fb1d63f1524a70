//! Noise on image features.

use hough_heuristic::Features;
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

/// Adds normal noise of standard deviation `sigma` units to each feature; the radius stays above a
/// tenth of a unit.
pub(crate) fn with_noise<R: Rng + ?Sized>(features: Features, sigma: f64, rng: &mut R) -> Features {
    if sigma == 0.0 {
        return features;
    }
    let mut draw = || -> f64 { StandardNormal.sample(rng) };
    Features {
        x: features.x + sigma * draw(),
        y: features.y + sigma * draw(),
        r: (features.r + sigma * draw()).max(0.1),
    }
}
