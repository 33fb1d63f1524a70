//! The paper's detector: sample three edge pixels, look at the edge image itself, keep no
//! accumulator.

use std::time::Instant;

use image::GrayImage;

use super::belonging::Probes;
use super::evidence::{Evidence, rank};
use crate::acceptance::Acceptance;
use crate::circle::Circle;
use crate::detect::{CircleDetector, Detection, StageTimes, Stages};
use crate::edges::{Canny, EdgeDetector, EdgeMap};
use crate::error::ConfigError;
use crate::error::require;
use crate::region::Region;
use crate::sampling::{Draw, Sampler, Sampling};

/// The settings of [`Heuristic`].
///
/// The defaults suit the paper's frames of 768x576 pixels with one ball of radius 20 to 290 px amid
/// moderate clutter.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct HeuristicConfig {
    /// The offset θ that β must exceed (default 0.65; 0..1, both excluded). Lower: balls more
    /// hidden are found, and more circles that are none.
    pub theta: f64,
    /// How many triples are drawn at most per frame (default 60000; at least 1). Bounds the time;
    /// more finds fainter and smaller balls amid more clutter.
    pub iterations: u32,
    /// The smallest radius, pixels (default 15; 1..=max_radius). Below about 15 px, with a
    /// tolerance of 1, corners and texture begin to pass for circles.
    pub min_radius: f64,
    /// The largest radius, pixels (default 300; min_radius..=100000). If it equals `min_radius` the
    /// radius is known: draws are of two pixels, and only the centre is fitted.
    pub max_radius: f64,
    /// How far an edge pixel may lie from a pixel of the circle to match it, pixels (default 1;
    /// 0..=8). Larger: rounder than round is forgiven, and texture matches more by chance.
    pub tolerance: f64,
    /// How many circles to look for (default 1; at least 1). The search ends with the last one
    /// found; if there are fewer in the frame it uses all of `iterations`.
    pub max_circles: usize,
    /// The least distance between the centres of two circles found, pixels (default 8; at least 0).
    /// 0 allows concentric ones.
    pub min_distance: f64,
    /// Where the centre may lie (default None: anywhere, even outside the frame).
    pub region: Option<Region>,
    /// Whether to fit an accepted circle to its edge pixels by least squares (default true). Beyond
    /// the paper: three whole pixels give the centre to about a pixel, the fit to a twentieth.
    pub refine: bool,
    /// Where draws come from (default [`Sampling::Near`]).
    pub sampling: Sampling,
    /// The seed of the draws (default 1). They begin anew with every frame, so that what is found
    /// depends on the configuration and the frame alone.
    pub seed: u64,
}

impl Default for HeuristicConfig {
    fn default() -> Self {
        let Acceptance {
            theta,
            tolerance,
            min_radius,
            max_radius,
            max_circles,
            min_distance,
            region,
            refine,
        } = Acceptance::default();
        Self {
            theta,
            iterations: 60_000,
            min_radius,
            max_radius,
            tolerance,
            max_circles,
            min_distance,
            region,
            refine,
            sampling: Sampling::default(),
            seed: 1,
        }
    }
}

impl HeuristicConfig {
    fn acceptance(&self) -> Acceptance {
        Acceptance {
            theta: self.theta,
            tolerance: self.tolerance,
            min_radius: self.min_radius,
            max_radius: self.max_radius,
            max_circles: self.max_circles,
            min_distance: self.min_distance,
            region: self.region,
            refine: self.refine,
        }
    }
}

/// The heuristic of section 2.1 of the paper, for circles.
///
/// All edge pixels form the structure `D`. Until the budget is spent: draw three of them, solve for
/// the circle through them, and count how many pixels of that circle are edges. Their share is the
/// *belonging* β; a circle with β above the offset θ is there. Its edge pixels are then taken out
/// of `D`, and the search goes on for the next.
///
/// **How β is counted.** The estimated circle is rasterised by the midpoint rule into a thin
/// outline of about 5.7 pixels per pixel of radius. A pixel of it matches when an edge pixel lies
/// within `tolerance`. β is the share of the matching pixels in all pixels of the outline; those
/// that lie outside the frame count as pixels and never match, so a ball cut in half by the border
/// has a β of at most about one half.
///
/// **Beyond the paper.** A hopeless draw is mostly turned away after a look at 8 to 32 pixels of
/// its outline, which can delay a circle whose β barely exceeds θ but never lets in one that does
/// not; [`Sampling::Near`]; and the final fit.
///
/// The score of a [`Detection`] is β of the circle as reported. It means the same at every radius.
#[derive(Clone, Debug)]
pub struct Heuristic<E = Canny> {
    config: HeuristicConfig,
    edge_detector: E,
    probes: Probes,
    sampler: Sampler,
    evidence: Evidence,
    candidates: Option<Vec<Circle>>,
    times: StageTimes,
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
        require(
            "iterations",
            config.iterations.into(),
            "at least 1",
            config.iterations > 0,
        )?;
        let accept = config.acceptance();
        Ok(Self {
            evidence: Evidence::new(accept)?,
            edge_detector,
            probes: Probes::new(config.theta),
            sampler: Sampler::new(config.sampling, &accept, config.seed),
            candidates: None,
            times: StageTimes::default(),
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

    /// The memory that the circle search holds, bytes, edges not included.
    pub fn memory(&self) -> usize {
        self.evidence.memory()
    }
}

impl<E: EdgeDetector> CircleDetector for Heuristic<E> {
    fn detect_into(&mut self, frame: &GrayImage, found: &mut Vec<Detection>) {
        found.clear();
        if self.check_frame(frame.width(), frame.height()).is_err() {
            return;
        }
        let start = Instant::now();
        let edges = self.edge_detector.detect_edges(frame);
        let with_edges = Instant::now();
        let evidence = &mut self.evidence;
        evidence.fill(edges);
        let with_structure = Instant::now();

        if let Some(candidates) = &mut self.candidates {
            candidates.clear();
        }
        self.sampler.restart();
        for _ in 0..self.config.iterations {
            let circle = match self.sampler.draw(&evidence.structure) {
                Draw::Exhausted => break,
                Draw::Nothing => continue,
                Draw::Circle(circle) => circle,
            };
            if !evidence.acceptance.admits(&circle, found)
                || !evidence.near.promising(&circle, &self.probes)
            {
                continue;
            }
            if let Some(candidates) = &mut self.candidates {
                candidates.push(circle);
            }
            if let Some(detection) = evidence.check(circle) {
                evidence.accept(edges, detection, found);
                if found.len() == self.config.max_circles {
                    break;
                }
            }
        }
        rank(found);
        self.times = StageTimes {
            edges: with_edges - start,
            structure: with_structure - with_edges,
            search: with_structure.elapsed(),
        };
    }

    fn check_frame(&self, width: u32, height: u32) -> Result<(), ConfigError> {
        self.evidence.acceptance.check_frame(width, height)
    }

    fn keep_candidates(&mut self, keep: bool) {
        self.candidates = keep.then(Vec::new);
    }

    fn stages(&self) -> Option<Stages<'_>> {
        Some(Stages {
            edges: self.edges(),
            candidates: self.candidates.as_deref().unwrap_or_default(),
            times: self.times,
            tolerance: self.config.tolerance,
        })
    }
}
