//! The a contrario detector.

mod against;
mod arcs;
mod budget;
mod candidate;
mod chains;
mod chance;
mod config;
mod consensus;
mod directions;
mod ellipse;
mod ellipses;
mod fit;
mod halve;
mod leaving;
mod level;
mod listed;
mod measure;
mod measurement;
mod part;
mod partners;
mod patch;
mod polar;
mod proof;
mod prover;
mod refute;
mod report;
mod rings;
mod search;
mod small;
mod stages;
mod strongest;
mod thin;
mod track;
#[cfg(test)]
mod twins;

use image::GrayImage;

pub use config::AContrarioConfig;
pub use measurement::{Effort, MeasuredEllipse, Measurement};
pub use rings::Rings;

use crate::detect::{CircleDetector, Detection, FrameRefused};
use crate::edges::{ROW_STEP, Vectorized, noise_deviation, widest};
use crate::error::ConfigError;
use budget::{Budget, Stage};
use candidate::Collected;
use chance::log10;
use directions::UnitCircle;
use level::Level;
use listed::Edges;
use polar::{Polar, Ring};
use proof::Proof;
use prover::{Prover, Pyramid, Size};
use search::{Outline, Search};

/// An *a contrario* detector: finds an unknown number of circles, each with the number of false
/// alarms that bounds its chance origin, and with the standard errors of its measurement.
///
/// **A contrario.** A detection is accepted for being unlikely under a model of chance, not for
/// passing a threshold tuned to a scene. The *number of false alarms* (NFA) of a circle is the
/// expected number of circles at least as good in a frame of pure chance (Desolneux, Moisan and
/// Morel, 2000; for circles Akinlar and Topal, 2013). Small is good.
///
/// **Search.** The paper's idea stays: draw edge points, solve for the circle, check the image
/// itself, keep no accumulator. The draws are *pairs* of points on one row or column whose
/// gradients mirror one another, on the frame halved several times, smallest size first. An edge
/// that no circle explains is followed for a few pixels, and the circle of that *arc* is tried too.
/// A circle whose outline runs along edges is fitted and becomes a candidate.
///
/// **Proof.** A candidate is examined at the size where its radius is 12 to 24 px (smaller ones at
/// the full size; in noise from 4.5 px on), at twice that size if there is one (in noise also at
/// four times) and, in doubt, at half of it and in a narrow window; the best result counts. In
/// doubt it begins once more at the circle that most of the edges around the candidate agree on, as
/// in RANSAC. On each
/// of 64 rays across the outline, the strongest edge along it is sought within a third of the
/// radius (3 to 8 px) on either side. Under the model of chance that edge lies anywhere in the
/// window, so it lies within the tolerance (a quarter or half a pixel, in noise and on soft edges
/// up to 1.2 px) with a known probability, however textured the picture. The NFA is the number of
/// distinguishable circles in the frame times Hoeffding's bound on the probability of so many edges
/// on the outline. Where it is surer, only edges that run along the outline to 7 degrees count,
/// which chance makes rarer. Samples that overlap count in part, a ray without any edge counts a
/// quarter, and a circle of which more than a tenth lies outside the frame has a thousandfold NFA.
///
/// **Score.** `c / (c + 1)`, where `c` is minus the decimal logarithm of the NFA, or 0 if that is
/// negative. 0.5 stands for at most one false alarm in 10 frames of pure chance, 0.67 for one in
/// 100, 0.8 for one in 10,000. The bound is loose. Real frames contain more than chance:
/// wheels, holes, fingertips and letters are round and score high. Lamps do not: an edge with an
/// overexposed inner side does not count if the light falls off around it.
///
/// **Evidence against.** Parts of other things are round as well. A ray without the outline refutes
/// the circle if both sides of it have the level of the thing or both that of the ground, or if it
/// lies between two straight lines along which the outline goes on, as that of a finger does. A
/// thing in front excuses a gap: at its borders the levels change along the outline. A share `s` of
/// refuted rays leaves `(1 - 3 s)^1.5` of `c`. Each end at which the outline goes on off the circle
/// takes 4 from `c`. A circle is dropped if an ellipse or a polygon explains the edges better, if
/// most of the gap has no edge at all, or if the frame cuts it and little of the rest is seen.
///
/// **Several circles.** Circles may lie inside one another and across one another. Each must be
/// proven by edges that no surer circle explains, and its outline must differ from any other by 3
/// px and 4 % of the radius. Next to a proven outline the other one of a thin ring is sought.
///
/// **Measurement.** The circle is followed down to the full size (in strong noise to half of it)
/// and fitted there, weighted by the slope. The inward bias that blur gives a ball that darkens
/// towards its limb is removed.
///
/// **Ellipses.** With [`min_axis_ratio`](AContrarioConfig::min_axis_ratio) below 1, ellipses are
/// fitted to edges that hang together. Around each, the frame is drawn so that the ellipse becomes
/// a circle, which is measured and proven like any other; the NFA counts 100 shapes at each place.
/// Of two outlines that share half of their edges the surer is reported.
///
/// ```
/// use hough_heuristic::image::{GrayImage, Luma};
/// use hough_heuristic::{CircleDetector, AContrario, AContrarioConfig};
///
/// let frame = GrayImage::from_fn(320, 240, |x, y| {
///     let inside = |cx: f64, cy: f64, r: f64| (f64::from(x) - cx).hypot(f64::from(y) - cy) < r;
///     Luma([if inside(100.0, 70.0, 28.0) || inside(220.5, 150.2, 14.0) { 40 } else { 200 }])
/// });
/// let mut detector = AContrario::new(AContrarioConfig::default())?;
/// assert_eq!(detector.detect(&frame)?.len(), 2);
/// let ball = detector.measurements()[0];
/// assert!((ball.circle.x - 100.0).abs() < 0.1 && ball.score > 0.8 && ball.centre_error < 0.1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct AContrario {
    config: AContrarioConfig,
    circle: UnitCircle,
    outline: Outline,
    /// Of the coarser sizes, one after the other, and of the finest.
    edges: [Edges; 2],
    /// Halved frames, as many as any frame needed so far.
    sizes: Vec<Size>,
    /// Number of them that belong to the last frame.
    depth: usize,
    collected: Collected,
    polar: Polar,
    proofs: Vec<Proof>,
    measurements: Vec<Measurement>,
    found: Vec<Detection>,
    /// The outlines that were measured.
    reported: Vec<Ring>,
    budget: Budget,
    /// The part of the frame that is searched, if it is not all of it.
    window: GrayImage,
    shown: stages::Shown,
}

impl AContrario {
    /// Builds a detector with these settings.
    ///
    /// # Errors
    /// The first parameter outside its range.
    pub fn new(config: AContrarioConfig) -> Result<Self, ConfigError> {
        config.check()?;
        let circle = UnitCircle::new();
        Ok(Self {
            outline: Outline::new(&circle),
            circle,
            edges: [Edges::new(), Edges::new()],
            sizes: Vec::new(),
            depth: 0,
            collected: Collected::default(),
            polar: Polar::default(),
            proofs: Vec::new(),
            measurements: Vec::new(),
            found: Vec::new(),
            reported: Vec::new(),
            budget: Budget::default(),
            window: GrayImage::default(),
            shown: stages::Shown::default(),
            config,
        })
    }

    /// Returns the measurements of the circles found last, in the order of the detections.
    pub fn measurements(&self) -> &[Measurement] {
        &self.measurements
    }

    /// Returns the work that the last frame took.
    pub fn effort(&self) -> Effort {
        Effort {
            draws: self.budget.draws,
            looks: self.budget.looks,
            proven: self.budget.proven,
            ended_by_budget: self.budget.spent,
            ended_by_count: self.budget.left_out,
        }
    }

    /// Lists the measurements as detections.
    fn list(&mut self) {
        self.found.clear();
        let detections = self.measurements.iter().map(|measurement| Detection {
            circle: measurement.circle,
            score: measurement.score,
        });
        self.found.extend(detections);
    }

    /// Finds the circles of a frame with radii in this range, or about the one radius, into
    /// `measurements`. Those below the radius `first` are sought only if small closed outlines are
    /// seen.
    fn find(&mut self, frame: &GrayImage, radii: (f64, f64), first: f64) {
        self.proofs.clear();
        self.measurements.clear();
        self.reported.clear();
        self.collected.clear(CANDIDATES);
        self.budget = Budget::default();
        if frame.width() < LEAST_SIDE || frame.height() < LEAST_SIDE {
            return;
        }
        self.budget = Budget::new(&self.config, frame.len());
        let radii = if radii.0 < radii.1 {
            radii
        } else {
            let slack = 1.0 + 0.05 * radii.0;
            (radii.0 - slack, radii.1 + slack)
        };
        // Large frames have enough pixels in half of those rows.
        let rows = if frame.len() < 200_000 {
            ROW_STEP
        } else {
            2 * ROW_STEP
        };
        let noise = noise_deviation(frame.as_raw(), frame.width() as usize, rows);
        self.shrink(frame, radii.1);
        self.prove(frame, radii, first, noise);
        self.report(frame, radii, noise);
        if self.config.min_axis_ratio < 1.0 {
            self.find_ellipses(frame, radii, noise);
        }
    }

    /// Halves the frame until the largest circles are small.
    fn shrink(&mut self, frame: &GrayImage, max_radius: f64) {
        let mut depth = 0;
        let mut side = frame.width().min(frame.height());
        while side >= 80 && f64::from(1 << depth) * 8.0 <= max_radius && depth < DEEPEST {
            depth += 1;
            side /= 2;
        }
        self.depth = depth;
        self.sizes
            .resize(depth.max(self.sizes.len()), Size::default());
        for index in 0..depth {
            let (before, rest) = self.sizes.split_at_mut(index);
            let (gray, width) = before
                .last()
                .map_or((frame.as_raw(), frame.width() as usize), |size| {
                    (&size.gray, size.width)
                });
            let size = &mut rest[0];
            (size.width, size.height) = halve::halve(gray, width, &mut size.gray);
        }
    }

    /// Collects candidates from the smallest size to the largest, and proves them.
    fn prove(&mut self, frame: &GrayImage, radii: (f64, f64), first: f64, noise: f32) {
        let least = radii.0;
        // A frame that is not halved is searched at the full size anyway.
        let first = if self.depth > 0 { first } else { least };
        let radii = (least.max(first), radii.1);
        let pyramid = Pyramid {
            frame,
            sizes: &self.sizes[..self.depth],
        };
        let mut prover = Prover {
            pyramid,
            circle: &self.circle,
            polar: &mut self.polar,
            noise,
            tests: log10((frame.len() * RADII * (self.depth + 1)) as f32),
            proofs: &mut self.proofs,
        };
        let smallest = pyramid.depth();
        let finest = usize::from(radii.0 >= 8.0 && smallest > 0);
        let contrast = self.config.contrast as f32;
        let deadline = self.budget.deadline;
        let mirror_slack = if noise > 12.0 { 0.35 } else { 0.28 };
        let edges_of = |depth: usize, edges: &mut Edges, asks: bool| {
            let noise = noise / (1 << depth) as f32 + ROUNDING;
            let least = NOISE_FACTOR * noise * edges.maxima.noise_gain();
            let threshold = (STEP_GAIN * contrast).max(least);
            let asked = asks.then_some((&self.outline, mirror_slack));
            edges.find(pyramid.gray(depth), threshold, deadline, asked);
        };
        let mut search =
            |depth, edges: &mut Edges, radii: (f64, f64), budget: &mut Budget, last| {
                let scale = (1 << depth) as f32;
                let least = if depth <= finest { 3.2 } else { 8.0 };
                // Smaller sizes have the larger circles; but short arcs of them are exact in the
                // larger ones only.
                let (most, most_of_arcs) = if depth == smallest {
                    (f32::MAX, f32::MAX)
                } else {
                    (20.0, 60.0)
                };
                budget.begin_size(last);
                let mut listed = None;
                loop {
                    let proofs = prover.proofs.iter().filter(|proof| proof.is_beyond_doubt());
                    edges.found.clear();
                    edges
                        .found
                        .extend(proofs.map(|proof| proof.in_frame().shrunk(scale)));
                    if let Some(before) = listed {
                        let shapes = (&self.outline, &self.circle);
                        let news = self.collected.proven(scale).skip(before);
                        if !edges.list_rest(shapes, news, deadline, &mut budget.looks) {
                            return;
                        }
                    }
                    listed = Some(listed.map_or(0, |_| self.collected.proven(scale).count()));
                    let level = &mut edges.level;
                    for ring in &edges.found {
                        self.outline
                            .explain(&self.circle, level, ring, &mut budget.looks);
                    }
                    widest(Searching {
                        search: Search {
                            circle: &self.circle,
                            outline: &self.outline,
                            radii: (
                                (radii.0 as f32 / scale).max(least),
                                (radii.1 as f32 / scale).min(most),
                            ),
                            most_radius: (radii.1 as f32 / scale).min(most_of_arcs),
                            scale,
                            seed: self.config.seed,
                            mirror_slack,
                        },
                        prover: &mut prover,
                        level,
                        collected: &mut self.collected,
                        budget,
                    });
                }
            };
        let [coarse, fine] = &mut self.edges;
        (coarse.late, fine.late, fine.small) = (false, false, false);
        // The edges of the finest size take about as long as all that is done at the others, and
        // come last so that a deadline leaves the circles of these.
        both(
            frame.len() >= LARGE_FRAME,
            || {
                for depth in (finest + 1..=smallest).rev() {
                    edges_of(depth, coarse, false);
                    search(depth, coarse, radii, &mut self.budget, false);
                }
            },
            || edges_of(finest, fine, least < radii.0),
        );
        let small = fine.small;
        self.budget.extend(small);
        search(finest, fine, radii, &mut self.budget, !small);
        if small {
            edges_of(0, fine, false);
            search(0, fine, (least, first), &mut self.budget, true);
        }
        self.budget.spent |= fine.late || coarse.late;
        let found = &mut self.collected;
        found
            .candidates
            .sort_unstable_by(|a, b| b.weight.total_cmp(&a.weight));
        for index in 0..found.candidates.len() {
            if self.budget.is_late() || self.budget.is_over(Stage::Proofs) {
                break;
            }
            let candidate = found.candidates[index];
            if !candidate.tried && !found.is_proven(&candidate, &mut self.budget) {
                found.settle(None, &candidate, &mut prover, &mut self.budget);
            }
        }
        found.prove_parallels(&mut prover, &mut self.budget);
    }
}

impl CircleDetector for AContrario {
    fn detect(&mut self, frame: &GrayImage) -> Result<&[Detection], FrameRefused> {
        self.measurements.clear();
        self.budget = Budget::default();
        self.find_in_region(frame)?;
        self.choose();
        self.list();
        Ok(&self.found)
    }
}

/// Returns the circles of a single frame with radii of `min_radius..=max_radius` pixels, best
/// first, and the work that they took: there may be more circles if
/// [`ended_by_budget`](Effort::ended_by_budget) is set.
///
/// Runs [`AContrario`] with its default settings. For a stream of frames build a detector once.
///
/// # Errors
/// [`ConfigError::RadiusRange`] if the range is empty, [`ConfigError::OutOfRange`] if its lower end
/// is below 4.
pub fn detect_circles(
    frame: &GrayImage,
    min_radius: f64,
    max_radius: f64,
) -> Result<(Vec<Detection>, Effort), ConfigError> {
    let config = AContrarioConfig {
        min_radius: Some(min_radius),
        max_radius: Some(max_radius),
        ..AContrarioConfig::default()
    };
    let mut detector = AContrario::new(config)?;
    // Without a region of interest no frame is refused.
    let found = detector.detect(frame).unwrap_or_default().to_vec();
    Ok((found, detector.effort()))
}

/// Frames with a shorter side hold nothing, pixels.
const LEAST_SIDE: u32 = 12;
/// Largest number of halvings of a frame.
const DEEPEST: usize = 5;
/// Frames of so many pixels are worth a second thread.
const LARGE_FRAME: usize = 1_000_000;
/// The most candidates of a frame.
const CANDIDATES: usize = 192;
/// Gradient of a step of one gray level.
const STEP_GAIN: f32 = 2.3;
/// The threshold in deviations of the noise.
const NOISE_FACTOR: f32 = 3.5;
/// Noise that rounding adds at each size, gray levels.
const ROUNDING: f32 = 0.3;
/// Circles about one place that differ noticeably, at each size.
const RADII: usize = 12;

/// Runs two functions, on two threads if `apart` is set and the feature `parallel` is on.
fn both(apart: bool, one: impl FnOnce() + Send, other: impl FnOnce() + Send) {
    #[cfg(feature = "parallel")]
    if apart {
        rayon::join(one, other);
        return;
    }
    let _ = apart;
    one();
    other();
}

/// The search of a level.
struct Searching<'a, 'b> {
    search: Search<'a>,
    prover: &'a mut Prover<'b>,
    level: &'a mut Level,
    collected: &'a mut Collected,
    budget: &'a mut Budget,
}

impl Vectorized for Searching<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.search
            .run(self.level, self.collected, self.prover, self.budget);
        self.search
            .follow_arcs(self.level, self.collected, self.prover, self.budget);
    }
}
