use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

use super::belonging::NearEdges;
use crate::acceptance::MAX_TOLERANCE;
use crate::curve::Curve;
use crate::edges::{EdgeMap, EdgePixel};
use crate::error::{ConfigError, require, require_iterations};
use crate::sampling::structure::Structure;

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

/// A curve that is present in the edge image.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FoundCurve<C> {
    /// The curve, through n edge pixels.
    pub curve: C,
    /// The belonging β: the share of the curve's pixels that are edges, when it was found.
    pub beta: f64,
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
/// assert!((found[0].curve.x - 60.0).abs() < 1.5 && found[0].beta > 0.6);
/// # Ok::<(), hough_heuristic::ConfigError>(())
/// ```
#[derive(Clone, Debug)]
pub struct CurveSearch {
    config: CurveSearchConfig,
    structure: Structure,
    near: NearEdges,
}

impl CurveSearch {
    /// Builds a search with these settings.
    ///
    /// # Errors
    /// [`ConfigError::OutOfRange`] for the first parameter outside its range.
    pub fn new(config: CurveSearchConfig) -> Result<Self, ConfigError> {
        let CurveSearchConfig {
            theta, tolerance, ..
        } = config;
        require(
            "theta",
            theta,
            "between 0 and 1, both excluded",
            theta > 0.0 && theta < 1.0,
        )?;
        require_iterations(config.iterations)?;
        require(
            "tolerance",
            tolerance,
            "0..=8 px",
            (0.0..=MAX_TOLERANCE).contains(&tolerance),
        )?;
        require(
            "max_curves",
            config.max_curves as f64,
            "at least 1",
            config.max_curves > 0,
        )?;
        let reach = config.reach.unwrap_or(1.0);
        require(
            "reach",
            reach,
            "finite and at least 1 px",
            reach.is_finite() && reach >= 1.0,
        )?;
        Ok(Self {
            config,
            structure: Structure::default(),
            near: NearEdges::new(tolerance),
        })
    }

    /// Returns the curves of an edge image for which `admits` is true, in the order in which they
    /// were found.
    ///
    /// The time to check a curve grows with its outline. Let `admits` refuse curves much larger
    /// than the image.
    pub fn find<C: Curve>(
        &mut self,
        edges: &EdgeMap,
        admits: impl Fn(&C) -> bool,
    ) -> Vec<FoundCurve<C>> {
        let (width, height) = (edges.width(), edges.height());
        self.structure.fill(width, height, edges.pixels());
        self.near.fill(width, height, edges.pixels());
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(self.config.seed);
        let mut pixels = Vec::with_capacity(C::PARAMETERS);
        let mut found = Vec::new();
        for _ in 0..self.config.iterations {
            if !self.draw(C::PARAMETERS, &mut rng, &mut pixels) {
                break;
            }
            let Some(curve) = C::through(&pixels).filter(&admits) else {
                continue;
            };
            let Some(beta) = self.near.belonging(&curve, self.config.theta) else {
                continue;
            };
            let band = self.config.tolerance + 1.5;
            let near = &mut self.near;
            self.structure.remove(|pixel| {
                let explained = curve.distance(pixel.x.into(), pixel.y.into()) <= band;
                if explained {
                    near.forget(pixel);
                }
                explained
            });
            found.push(FoundCurve { curve, beta });
            if found.len() == self.config.max_curves {
                break;
            }
        }
        found
    }

    /// Draws `count` pixels; false if there are not so many left.
    fn draw(
        &self,
        count: usize,
        rng: &mut Xoshiro256PlusPlus,
        pixels: &mut Vec<EdgePixel>,
    ) -> bool {
        pixels.clear();
        if self.structure.entries().len() < count {
            return false;
        }
        while pixels.len() < count {
            match (self.config.reach, pixels.first()) {
                (Some(reach), Some(&first)) => {
                    pixels.push(self.structure.draw_around(first, reach, rng));
                }
                _ => pixels.extend(self.structure.draw_anywhere::<1>(rng).into_iter().flatten()),
            }
        }
        true
    }
}
