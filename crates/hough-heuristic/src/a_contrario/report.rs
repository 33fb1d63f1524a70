//! The report: the proven circles that are no second account of another one, measured.

use image::GrayImage;

use super::budget::{MEASURING, Stage};
use super::directions::UnitCircle;
use super::measure::{self, Measured};
use super::polar::{Polar, Ring};
use super::proof::Proof;
use super::prover::{Prover, Pyramid};
use super::refute;
use super::strongest::RAYS;
use super::{AContrario, Measurement};
use crate::circle::Circle;
use crate::edges::{Vectorized, widest};

/// Noise above which the larger circles are measured at half the size of the frame, gray levels.
const NOISY: f32 = 15.0;
/// Difference below which two outlines count as one, pixels and radii: it allows for their errors
/// and for the width of a drawn line.
const SAME_PIXELS: f32 = 3.0;
const SAME_SHARE: f32 = 0.04;

impl AContrario {
    /// Measures the proven circles, the surest first.
    ///
    /// A circle must reach the least score by the edges that do not lie on a circle reported before
    /// it. A ring across the outlines of others is then not reported, but one inside of another is.
    pub(super) fn report(&mut self, frame: &GrayImage, radii: (f64, f64), noise: f32) {
        let pyramid = Pyramid {
            frame,
            sizes: &self.sizes[..self.depth],
        };
        let rays = self.circle.rays(RAYS);
        self.proofs
            .sort_unstable_by(|a, b| b.certainty.total_cmp(&a.certainty));
        let count = self.proofs.len();
        for index in 0..2 * count {
            let Some(mut proof) = self.proofs.get(index % count).copied() else {
                break;
            };
            // At last those that more speaks against, in the light of the circles that are there.
            if index >= count {
                let crosses = |other: &Ring| refute::crosses(&proof.in_frame(), other);
                if proof.against.is_none() || !self.reported.iter().any(crosses) {
                    continue;
                }
                let mut prover = Prover {
                    pyramid,
                    circle: &self.circle,
                    polar: &mut self.polar,
                    noise,
                    tests: 0.0,
                    proofs: &mut Vec::new(),
                };
                let before = proof.certainty;
                let looks = &mut self.budget.looks;
                proof.weaken(prover.refute(&proof, &self.reported, looks));
                if proof.certainty <= before {
                    continue;
                }
            }
            let proof = &proof;
            let score = proof.score();
            if score < self.config.min_score {
                continue;
            }
            let others = self.reported.iter().copied();
            if Proof::score_of(proof.certainty_beside(rays, others)) < self.config.min_score {
                continue;
            }
            // What is proven is reported, measured or not.
            let over = self.budget.is_late() || self.budget.is_over(Stage::Measurements);
            let measured = if over {
                None
            } else {
                self.budget.looks += MEASURING;
                widest(Measuring {
                    pyramid,
                    proof,
                    circle: &self.circle,
                    polar: &mut self.polar,
                    noise,
                })
            };
            let scale = (1 << proof.depth) as f32;
            let measured = measured.unwrap_or_else(|| Measured::roughly(proof.in_frame(), scale));
            let is_known = |other: &Ring| is_same(&measured.ring, other);
            if self.reported.iter().any(is_known) {
                continue;
            }
            let Ring { x, y, r } = measured.ring;
            let mut circle = Circle {
                x: x.into(),
                y: y.into(),
                radius: r.into(),
            };
            let fits = (radii.0..=radii.1).contains(&circle.radius);
            circle.radius = self.config.known_radius().unwrap_or(circle.radius);
            let region = self.config.region.as_ref();
            if fits && region.is_none_or(|region| region.holds(&circle)) {
                if self.measurements.len() == self.most_reported() {
                    self.budget.left_out = true;
                    break;
                }
                self.measurements.push(Measurement {
                    circle,
                    score,
                    log_false_alarms: -f64::from(proof.certainty),
                    centre_error: measured.centre_error.into(),
                    radius_error: measured.radius_error.into(),
                    axis_ratio: measured.axis_ratio().into(),
                    visible: proof.visible.into(),
                    covered: proof.covered.into(),
                    ellipse: None,
                });
            }
            self.reported.push(measured.ring);
        }
        self.measurements
            .sort_unstable_by(|a, b| a.log_false_alarms.total_cmp(&b.log_false_alarms));
    }
}

/// Returns `true` if two outlines are one.
fn is_same(a: &Ring, b: &Ring) -> bool {
    a.apart(b) < SAME_PIXELS.max(SAME_SHARE * a.r.min(b.r))
}

/// The measurement of a proven circle.
pub(super) struct Measuring<'a> {
    pub(super) pyramid: Pyramid<'a>,
    pub(super) proof: &'a Proof,
    pub(super) circle: &'a UnitCircle,
    pub(super) polar: &'a mut Polar,
    pub(super) noise: f32,
}

impl Vectorized for Measuring<'_> {
    type Output = Option<Measured>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        let pyramid = self.pyramid;
        // The slope over one pixel is lost in noise: over two it is found.
        let finest = usize::from(self.noise > NOISY).min(self.proof.depth);
        let frames = (finest..=self.proof.depth)
            .rev()
            .map(|depth| pyramid.gray(depth));
        let scale = (1 << finest) as f32;
        let noise = self.noise / scale;
        measure::measure(frames, self.circle, self.polar, self.proof, noise)
            .map(|measured| measured.grown(scale))
    }
}
