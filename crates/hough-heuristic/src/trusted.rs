//! The detector whose score can be trusted.

mod candidate;
mod config;
mod directions;
mod fit;
mod halve;
mod level;
mod measure;
mod polar;
mod prover;
mod proof;
mod search;

use image::GrayImage;

pub use config::TrustedConfig;

use crate::edges::{Maxima, Vectorized, noise_deviation, widest};
use crate::{Circle, CircleDetector, ConfigError, Detection};
use candidate::Collected;
use directions::UnitCircle;
use level::Level;
use polar::{Grey, Polar, Ring};
use proof::Proof;
use prover::{Prover, Pyramid, Size};
use search::{Budget, Outline, Search};

/// Finds circles at several sizes of the frame and proves each at the full size.
#[derive(Clone, Debug)]
pub struct Trusted {
    config: TrustedConfig,
    circle: UnitCircle,
    outline: Outline,
    maxima: Maxima,
    sizes: Vec<Size>,
    level: Level,
    collected: Collected,
    polar: Polar,
    proofs: Vec<Proof>,
    budget: Budget,
}

/// Development.
pub(crate) fn tune(index: usize, default: f32) -> f32 {
    static T: std::sync::OnceLock<Vec<Option<f32>>> = std::sync::OnceLock::new();
    T.get_or_init(|| {
        let mut v = vec![None; 64];
        for part in std::env::var("TUNE").unwrap_or_default().split(',') {
            if let Some((k, x)) = part.split_once('=') {
                v[k.parse::<usize>().unwrap_or(63)] = x.parse().ok();
            }
        }
        v
    })[index]
        .unwrap_or(default)
}

impl Trusted {
    /// A detector with these settings.
    ///
    /// # Errors
    /// The first parameter outside its range.
    pub fn new(config: TrustedConfig) -> Result<Self, ConfigError> {
        config.check()?;
        let circle = UnitCircle::new();
        Ok(Self {
            outline: Outline::new(&circle),
            circle,
            maxima: Maxima::new(0.8),
            sizes: Vec::new(),
            level: Level::default(),
            collected: Collected::default(),
            polar: Polar::default(),
            proofs: Vec::new(),
            budget: Budget::default(),
            config,
        })
    }

    /// The settings the detector was built with.
    pub fn config(&self) -> &TrustedConfig {
        &self.config
    }

    /// (draws, looks) for development.
    pub fn spent(&self) -> [u64; 5] {
        [
            self.budget.draws,
            self.budget.looks,
            self.budget.passed,
            self.budget.added,
            self.proofs.len() as u64,
        ]
    }

    /// For development.
    pub fn candidates(&self) -> Vec<(Circle, f32, f32, f32)> {
        self.collected
            .candidates
            .iter()
            .map(|c| {
                let circle = Circle {
                    x: c.x.into(),
                    y: c.y.into(),
                    radius: c.r.into(),
                };
                (circle, c.support.share(), c.weight, c.scale)
            })
            .collect()
    }

    /// For development.
    pub fn proofs(&self) -> Vec<(Circle, f32, [f32; 8])> {
        self.proofs
            .iter()
            .map(|p| (circle_of(&p.ring), p.certainty, p.features))
            .collect()
    }

    fn shrink(&mut self, frame: &GrayImage) {
        let mut depth = 0;
        let (mut width, mut height) = (frame.width() as usize, frame.height() as usize);
        while width.min(height) >= 80 && f64::from(1 << depth) * 8.0 <= self.config.max_radius && depth < 5 {
            depth += 1;
            (width, height) = (width / 2, height / 2);
        }
        self.sizes.resize(depth, Size::default());
        for index in 0..depth {
            let (before, rest) = self.sizes.split_at_mut(index);
            let (grey, width) = before
                .last()
                .map_or((frame.as_raw(), frame.width() as usize), |size| {
                    (&size.grey, size.width)
                });
            let size = &mut rest[0];
            (size.width, size.height) = halve::halve(grey, width, &mut size.grey);
        }
    }
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
        self.search.run(self.level, self.collected, self.prover, self.budget);
    }
}

/// The measurement of a proven circle.
struct Measuring<'a> {
    pyramid: Pyramid<'a>,
    depth: usize,
    circle: &'a UnitCircle,
    polar: &'a mut Polar,
    start: Ring,
    noise: f32,
}

impl Vectorized for Measuring<'_> {
    type Output = Option<measure::Measured>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        let pyramid = self.pyramid;
        let frames = (0..=self.depth).rev().map(|depth| pyramid.grey(depth));
        measure::measure(frames, self.circle, self.polar, self.start, self.noise)
    }
}

fn circle_of(ring: &Ring) -> Circle {
    Circle {
        x: ring.x.into(),
        y: ring.y.into(),
        radius: ring.r.into(),
    }
}

impl CircleDetector for Trusted {
    fn detect_into(&mut self, frame: &GrayImage, found: &mut Vec<Detection>) {
        found.clear();
        self.proofs.clear();
        if frame.width() < 12 || frame.height() < 12 {
            return;
        }
        let noise = noise_deviation(frame.as_raw(), frame.width() as usize);
        self.shrink(frame);
        let pixels = frame.len() as f64;
        self.budget = Budget {
            most_looks: (pixels * f64::from(tune(40, 3.0))) as u64 + 10_000,
            ..Budget::default()
        };
        self.collected.clear(tune(3, 192.0) as usize);

        let config = &self.config;
        let finest = usize::from(config.min_radius >= 8.0 && !self.sizes.is_empty());
        let pyramid = Pyramid {
            frame,
            sizes: &self.sizes,
        };
        let mut prover = Prover {
            pyramid,
            circle: &self.circle,
            polar: &mut self.polar,
            noise,
            tests: (pixels * f64::from(tune(26, 16.0))).log10() as f32,
            proofs: &mut self.proofs,
        };
        for depth in (finest..=self.sizes.len()).rev() {
            let scale = (1 << depth) as f32;
            let Grey { pixels: grey, width, height } = pyramid.grey(depth);
            let contrast =
                (2.3 * tune(2, 8.0)).max(tune(18, 3.5) * (noise / scale + 0.3) * self.maxima.noise_gain());
            let candidates = self.maxima.find(grey, width, contrast);
            self.level.fill(width, height, candidates);
            for proof in prover.proofs.iter().filter(|proof| proof.certainty >= tune(28, 6.0)) {
                let ring = proof.ring.grown((1 << proof.depth) as f32).shrunk(scale);
                self.outline
                    .explain(&self.circle, &mut self.level, &ring, &mut self.budget.looks);
            }
            let top = depth == self.sizes.len();
            let search = Search {
                circle: &self.circle,
                outline: &self.outline,
                radii: (
                    (config.min_radius as f32 / scale).max(if depth == finest { 3.2 } else { tune(19, 8.0) }),
                    (config.max_radius as f32 / scale).min(if top { f32::MAX } else { tune(29, 20.0) }),
                ),
                scale,
                seed: config.seed,
                mirror_slack: if noise > tune(24, 12.0) {
                    0.35
                } else {
                    tune(6, 0.2)
                },
            };
            widest(Searching {
                search,
                prover: &mut prover,
                level: &mut self.level,
                collected: &mut self.collected,
                budget: &mut self.budget,
            });
        }
        for candidate in self.collected.candidates.iter().filter(|candidate| !candidate.tried) {
            prover.prove(candidate);
        }
        self.proofs.sort_by(|a, b| b.certainty.total_cmp(&a.certainty));
        for proof in &mut self.proofs {
            let score = f64::from((proof.certainty / (proof.certainty.abs() + 3.0)).max(0.0));
            let rough = proof.ring.grown((1 << proof.depth) as f32);
            if score < config.min_score || found.len() >= config.max_circles {
                proof.ring = rough;
                continue;
            }
            let taken = found.iter().any(|other| {
                let circle = circle_of(&rough);
                let off = (circle.x - other.circle.x).hypot(circle.y - other.circle.y);
                off < 0.5 * (circle.radius.min(other.circle.radius))
                    && (circle.radius - other.circle.radius).abs() < 0.4 * circle.radius.max(other.circle.radius)
            });
            if taken {
                proof.ring = rough;
                continue;
            }
            let measured = widest(Measuring {
                pyramid,
                depth: proof.depth,
                circle: &self.circle,
                polar: &mut self.polar,
                start: proof.ring,
                noise,
            });
            proof.ring = measured.map_or(rough, |measured| measured.ring);
            let circle = circle_of(&proof.ring);
            let fits = circle.radius >= config.min_radius && circle.radius <= config.max_radius;
            let placed = config.region.as_ref().is_none_or(|region| region.holds(&circle));
            if fits && placed {
                found.push(Detection { circle, score });
            }
        }
    }
}
