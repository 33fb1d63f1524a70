//! The paper's detector: sample three edge pixels, look at the edge image itself, keep no accumulator.

use image::GrayImage;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{Rng, SeedableRng};

use crate::belonging::{MAX_TOLERANCE, NearEdges, Probes};
use crate::error::{require, require_radii};
use crate::fit::fit_circle;
use crate::structure::{Structure, circle_through};
use crate::{
    Canny, Circle, CircleDetector, ConfigError, Detection, EdgeDetector, EdgeMap, EdgePixel, Region,
};

/// Where the three pixels of a draw come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Sampling {
    /// All three from the whole of `D`, as the paper has it. For a circle that owns the share `p` of all edge pixels, one
    /// draw in `p^-3` hits it.
    Anywhere,
    /// The first from the whole of `D`; the others from a window around it that is as wide as a circle of some radius
    /// between the smallest and the largest can reach, the radius drawn anew each time (small ones more often: its
    /// logarithm is uniform). Beyond the paper; in clutter it hits a small ball hundreds of times as often.
    #[default]
    Near,
}

/// The settings of [`Heuristic`].
///
/// The defaults suit the paper's frames of 768x576 pixels with one ball of radius 20 to 290 px amid moderate clutter.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct HeuristicConfig {
    /// The offset θ that β must exceed (default 0.65; 0..1). Lower: balls more hidden are found, and more circles that are none.
    pub theta: f64,
    /// How many triples are drawn at most per frame (default 60000; at least 1). Bounds the time; more finds fainter and smaller
    /// balls amid more clutter.
    pub iterations: u32,
    /// The smallest radius, pixels (default 15; 1..=max_radius). Below about 15 px, with a tolerance of 1,
    /// corners and texture begin to pass for circles..
    pub min_radius: f64,
    /// The largest radius, pixels (default 300; at least min_radius).
    pub max_radius: f64,
    /// How far an edge pixel may lie from a pixel of the circle to match it, pixels (default 1; 0..=8). Larger: rounder than round
    /// is forgiven, and texture matches more by chance.
    pub tolerance: f64,
    /// How many circles to look for (default 1; at least 1). The search ends with the last one found; if there are fewer in the
    /// frame it uses all of `iterations`.
    pub max_circles: usize,
    /// The least distance between the centres of two circles found, pixels (default 8; at least 0). 0 allows concentric ones.
    pub min_distance: f64,
    /// Where the centre may lie (default None: anywhere, even outside the frame).
    pub region: Option<Region>,
    /// Whether to fit an accepted circle to its edge pixels by least squares (default true). Beyond the paper: three whole pixels
    /// give the centre to about a pixel, the fit to a tenth or two.
    pub refine: bool,
    /// Where draws come from (default [`Sampling::Near`]).
    pub sampling: Sampling,
    /// The seed of the draws (default 1). They begin anew with every frame, so that what is found depends on the configuration and
    /// the frame alone.
    pub seed: u64,
}

impl Default for HeuristicConfig {
    fn default() -> Self {
        Self {
            theta: 0.65,
            iterations: 60_000,
            min_radius: 15.0,
            max_radius: 300.0,
            tolerance: 1.0,
            max_circles: 1,
            min_distance: 8.0,
            region: None,
            refine: true,
            sampling: Sampling::default(),
            seed: 1,
        }
    }
}

impl HeuristicConfig {
    /// # Errors
    /// The first parameter outside its range.
    fn check(&self) -> Result<(), ConfigError> {
        require(
            "theta",
            self.theta,
            "between 0 and 1, both excluded",
            self.theta > 0.0 && self.theta < 1.0,
        )?;
        require(
            "iterations",
            self.iterations.into(),
            "at least 1",
            self.iterations > 0,
        )?;
        require_radii(self.min_radius, self.max_radius)?;
        require(
            "tolerance",
            self.tolerance,
            "0..=8 px",
            (0.0..=MAX_TOLERANCE).contains(&self.tolerance),
        )?;
        require(
            "max_circles",
            self.max_circles as f64,
            "at least 1",
            self.max_circles > 0,
        )?;
        let distance = self.min_distance;
        require(
            "min_distance",
            distance,
            "finite and at least 0 px",
            distance.is_finite() && distance >= 0.0,
        )
    }
}

/// The heuristic of section 2.1 of the paper, for circles.
///
/// All edge pixels form the structure `D`. Until the budget is spent: draw three of them, solve for the circle through
/// them, and count how many pixels of that circle are edges. Their share is the *belonging* β; a circle with β above the
/// offset θ is there. Its edge pixels are then taken out of `D`, and the search goes on for the next.
///
/// **How β is counted.** The estimated circle is rasterised by the midpoint rule into a thin outline of about 5.7 pixels
/// per pixel of radius. A pixel of it matches when an edge pixel lies within `tolerance`. β is the share of the matching
/// pixels in all pixels of the outline; those that lie outside the frame count as pixels and never match, so a ball cut
/// in half by the border has a β of at most about one half.
///
/// **Beyond the paper.** A hopeless draw is mostly turned away after a look at 8 to 32 pixels of its outline, which can
/// delay a circle whose β barely exceeds θ but never lets in one that does not; [`Sampling::Near`]; and the final fit.
///
/// The score of a [`Detection`] is β of the circle as reported. It means the same at every radius.
#[derive(Clone, Debug)]
pub struct Heuristic<E = Canny> {
    config: HeuristicConfig,
    edge_detector: E,
    probes: Probes,
    /// The reaches of [`Sampling::Near`], pixels.
    reaches: Vec<f64>,
    structure: Structure,
    near: NearEdges,
    /// Scratch: the edge pixels around a circle.
    around: Vec<(f64, f64)>,
}

impl Heuristic<Canny> {
    /// A detector on the edges of [`Canny`] with its default thresholds.
    ///
    /// # Errors
    /// The first parameter outside its range.
    pub fn with_canny(config: HeuristicConfig) -> Result<Self, ConfigError> {
        Self::new(config, Canny::default())
    }
}

impl<E: EdgeDetector> Heuristic<E> {
    /// A detector on the edges of `edge_detector`, which may be a `Box<dyn EdgeDetector>`.
    ///
    /// # Errors
    /// The first parameter outside its range.
    pub fn new(config: HeuristicConfig, edge_detector: E) -> Result<Self, ConfigError> {
        config.check()?;
        Ok(Self {
            edge_detector,
            probes: Probes::new(config.theta),
            reaches: reaches(config.min_radius, config.max_radius),
            structure: Structure::default(),
            near: NearEdges::new(config.tolerance),
            around: Vec::new(),
            config,
        })
    }

    /// The edges of the last frame; empty before the first.
    pub fn edges(&self) -> &EdgeMap {
        self.edge_detector.edges()
    }

    /// The settings the detector was built with.
    pub fn config(&self) -> &HeuristicConfig {
        &self.config
    }

    fn draw(&self, rng: &mut Xoshiro256PlusPlus) -> Option<[EdgePixel; 3]> {
        match self.config.sampling {
            Sampling::Anywhere => self.structure.draw_anywhere(rng),
            Sampling::Near => {
                let reach = self.reaches[rng.next_u32() as usize % self.reaches.len()];
                self.structure.draw_near(reach, rng)
            }
        }
    }

    /// Whether the configuration admits this circle beside those found.
    fn admits(&self, circle: &Circle, found: &[Detection]) -> bool {
        let config = &self.config;
        (config.min_radius..=config.max_radius).contains(&circle.radius)
            && config.region.is_none_or(|region| region.holds(circle))
            && found.iter().all(|other| {
                let (dx, dy) = (circle.x - other.circle.x, circle.y - other.circle.y);
                dx * dx + dy * dy >= config.min_distance * config.min_distance
            })
    }

    /// The accepted circle fitted to its edge pixels, where that is a circle the configuration admits.
    fn refined(&mut self, drawn: Detection, found: &[Detection]) -> Detection {
        let fitted = |circle: Circle, band: f64, points: &mut Vec<(f64, f64)>| {
            points.clear();
            points.extend(self.structure.pixels().iter().filter_map(|pixel| {
                let point = (f64::from(pixel.x), f64::from(pixel.y));
                (distance_to(&circle, point) <= 2.0 * band).then_some(point)
            }));
            fit_circle(points, circle, band, false)
        };
        // First with room for the error of a circle through three whole pixels, then close.
        let band = self.config.tolerance + 0.5;
        let mut points = std::mem::take(&mut self.around);
        let circle =
            fitted(drawn.circle, 2.0 * band, &mut points).and_then(|rough| fitted(rough, band, &mut points));
        self.around = points;
        circle
            .filter(|circle| self.admits(circle, found))
            .and_then(|circle| {
                let score = self.near.belonging_above(&circle, self.config.theta)?;
                Some(Detection { circle, score })
            })
            .unwrap_or(drawn)
    }

    /// Takes the edge pixels that the circle explains out of `D`.
    fn explain(&mut self, circle: &Circle) {
        let band = self.config.tolerance + 1.5 + 0.01 * circle.radius;
        let near = &mut self.near;
        self.structure.remove(|pixel| {
            let explained = distance_to(circle, (f64::from(pixel.x), f64::from(pixel.y))) <= band;
            if explained {
                near.forget(pixel);
            }
            explained
        });
    }
}

impl<E: EdgeDetector> CircleDetector for Heuristic<E> {
    fn detect_into(&mut self, frame: &GrayImage, found: &mut Vec<Detection>) {
        found.clear();
        let edges = self.edge_detector.detect_edges(frame);
        self.structure.fill(edges.width(), edges.height(), edges.pixels());
        self.near.fill(edges.width(), edges.height(), edges.pixels());

        let theta = self.config.theta;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(self.config.seed);
        for _ in 0..self.config.iterations {
            let Some(pixels) = self.draw(&mut rng) else {
                break;
            };
            let Some(circle) = circle_through(pixels) else {
                continue;
            };
            if !self.admits(&circle, found) || !self.near.promising(&circle, &self.probes) {
                continue;
            }
            let Some(beta) = self.near.belonging_above(&circle, theta) else {
                continue;
            };
            let mut detection = Detection { circle, score: beta };
            if self.config.refine {
                detection = self.refined(detection, found);
            }
            self.explain(&detection.circle);
            found.push(detection);
            if found.len() == self.config.max_circles {
                break;
            }
        }
        found.sort_by(|a, b| b.score.total_cmp(&a.score));
    }
}

/// The circles of a single frame with a radius of `min_radius..=max_radius` pixels, best first.
///
/// For one-off use: the [`Heuristic`] on [`Canny`] edges with the default settings, and up to 32 circles. For a stream
/// of frames build a detector once.
///
/// # Errors
/// [`ConfigError::RadiusRange`] if the range is empty, or its lower end is below 1.
pub fn detect_circles(
    frame: &GrayImage,
    min_radius: f64,
    max_radius: f64,
) -> Result<Vec<Detection>, ConfigError> {
    let config = HeuristicConfig {
        min_radius,
        max_radius,
        max_circles: 32,
        ..HeuristicConfig::default()
    };
    Ok(Heuristic::with_canny(config)?.detect(frame))
}

/// How far the windows reach: 64 diameters, each longer than the one before by the same factor.
fn reaches(min_radius: f64, max_radius: f64) -> Vec<f64> {
    // The 64th root by square roots, which have the same bits on every platform.
    let factor = (0..6).fold(max_radius / min_radius, |root, _| root.sqrt());
    let mut reach = 2.0 * min_radius;
    (0..64)
        .map(|_| {
            reach *= factor;
            reach.ceil()
        })
        .collect()
}

fn distance_to(circle: &Circle, (x, y): (f64, f64)) -> f64 {
    let (dx, dy) = (x - circle.x, y - circle.y);
    ((dx * dx + dy * dy).sqrt() - circle.radius).abs()
}
