use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

use super::belonging::Unexplained;
use crate::curve::Curve;
use crate::edges::{EdgeMap, EdgePixel};
use crate::error::{ConfigError, require, require_share, require_some, require_tolerance};

/// The settings of [`CurveSearch`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct CurveSearchConfig {
    /// The offset θ that β must exceed (default 0.6; 0..1, both excluded).
    pub theta: f64,
    /// Largest number of n-tuples drawn (default 60000; at least 1).
    pub iterations: u32,
    /// Largest distance of an edge pixel from a curve's pixel that it matches, pixels (default 1;
    /// 0..=8).
    pub tolerance: f64,
    /// Largest number of curves reported (default 1; at least 1).
    pub max_curves: usize,
    /// If given, all pixels of a draw lie within about this distance of the first along each axis,
    /// pixels (default none: they come from anywhere; at least 1).
    pub reach: Option<f64>,
    /// The seed of the draws (default 1). They begin anew with every call.
    pub seed: u64,
}

impl Default for CurveSearchConfig {
    fn default() -> Self {
        Self {
            theta: 0.6,
            iterations: 60_000,
            tolerance: 1.0,
            max_curves: 1,
            reach: None,
            seed: 1,
        }
    }
}

/// The algorithm of section 2.1 as it stands there, for any [`Curve`].
///
/// 1. Set the offset θ and the number of iterations ([`CurveSearchConfig`]).
/// 2. Create the structure `D` of all edge pixels.
/// 3. Repeat until β exceeds θ: draw an n-tuple from `D`, compute the parameters of its curve, and
///    count β.
/// 4. If β > θ, the curve is there; else it is not present.
///
/// For several curves, the edge pixels that the curve found explains are taken out of `D`, and
/// steps 3 and 4 go on with what is left of the iterations.
///
/// ```
/// use hough_heuristic::image::{GrayImage, Luma};
/// use hough_heuristic::{CurveSearch, CurveSearchConfig, EdgeMap, Ellipse};
///
/// // The outline of a slanted ellipse, as an edge image.
/// let edges = GrayImage::from_fn(120, 90, |x, y| {
///     let (u, v) = (f64::from(x) - 60.0, f64::from(y) - 45.0);
///     let level = ((u + v) / 50.0).hypot((u - v) / 30.0);
///     Luma([if (level - 1.0).abs() < 0.025 { 255 } else { 0 }])
/// });
/// let mut search = CurveSearch::new(CurveSearchConfig::default())?;
/// let edges = EdgeMap::from_image(&edges);
/// let found = search.find::<Ellipse>(&edges, |ellipse| ellipse.minor > 10.0);
/// assert_eq!(found.len(), 1);
/// assert!((found[0].0.x - 60.0).abs() < 1.5 && found[0].1 > 0.6);
/// # Ok::<(), hough_heuristic::ConfigError>(())
/// ```
#[derive(Clone, Debug)]
pub struct CurveSearch {
    config: CurveSearchConfig,
    unexplained: Unexplained,
}

impl CurveSearch {
    /// Builds a search with these settings.
    ///
    /// # Errors
    /// [`ConfigError::OutOfRange`] for the first parameter outside its range.
    pub fn new(config: CurveSearchConfig) -> Result<Self, ConfigError> {
        require_share("theta", config.theta)?;
        require_some("iterations", config.iterations as usize)?;
        require_tolerance(config.tolerance)?;
        require_some("max_curves", config.max_curves)?;
        let reach = config.reach.unwrap_or(1.0);
        let usable = reach.is_finite() && reach >= 1.0;
        require("reach", reach, "finite and at least 1 px", usable)?;
        Ok(Self {
            config,
            unexplained: Unexplained::new(config.tolerance),
        })
    }

    /// Returns the curves of an edge image for which `admits` is true, in the order in which they
    /// were found, each with its β: the share of its pixels that were edges then.
    ///
    /// The time to check a curve grows with its outline. Let `admits` refuse curves much larger
    /// than the image.
    pub fn find<C: Curve>(
        &mut self,
        edges: &EdgeMap,
        admits: impl Fn(&C) -> bool,
    ) -> Vec<(C, f64)> {
        let Self {
            config,
            unexplained,
        } = self;
        unexplained.fill(edges);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(config.seed);
        let mut pixels = vec![EdgePixel::default(); C::PARAMETERS];
        let mut found = Vec::new();
        for _ in 0..config.iterations {
            let drawn = unexplained
                .structure
                .draw(config.reach, &mut rng, &mut pixels);
            if !drawn || found.len() == config.max_curves {
                break;
            }
            let Some(curve) = C::through(&pixels).filter(&admits) else {
                continue;
            };
            if let Some(beta) = unexplained.near.belonging(&curve, config.theta) {
                unexplained.explain(&curve, config.tolerance + 1.5);
                found.push((curve, beta));
            }
        }
        found
    }
}
