//! Proves candidates, each at the size of the frame where its radius is one or two dozen pixels.

use image::GrayImage;

use super::against::Against;
use super::budget::ROUND;
use super::candidate::Candidate;
use super::directions::UnitCircle;
use super::polar::{Gray, Polar, Ring};
use super::proof::{self, Narrow, Proof, Setting};
use super::refute;
use super::strongest::RAYS;
use crate::edges::{Vectorized, widest};

/// Radius from which a circle is proven in the frame halved once more, pixels there.
const LARGE: f32 = 24.0;
/// Radius from which that is done in a noisy frame, pixels there.
const SMALL: f32 = 9.0;
/// Noise from which on a frame counts as noisy, gray levels.
const NOISY: f32 = 8.0;

/// Least radius of a circle that is examined a second time at half the size, pixels there.
const LEAST_SECOND: f32 = 4.0;
/// Certainty from which no larger size is examined, except in noise.
const SURE: f32 = 24.0;
/// Reach of the search for edges in the narrow window, for a doubtful circle, radii.
const NARROW: f32 = 0.15;
/// Least reach of the narrow window next to another outline, pixels.
const LEAST_NARROW_REACH: f32 = 2.0;
/// Least certainty for an examination in the narrow window.
const LEAST_NARROW: f32 = -3.0;
/// Weight from which a candidate is examined there at any certainty.
const LEAST_WEIGHT: f32 = 10.0;
/// Certainty subtracted from a second proof of one candidate: it is one more test.
const SECOND_LOOK: f32 = 1.0;
/// Least certainty of a circle for which evidence against it is sought.
const LEAST_REFUTED: f32 = 0.5;

/// Least distance of a parallel outline, pixels of the size where it is sought.
const LEAST_PARALLEL: f32 = 2.0;
/// Least mean slope of a parallel outline, in slopes of the proven one.
const PARALLEL: f32 = 0.4;

/// The frame and its repeated halvings.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pyramid<'a> {
    pub(super) frame: &'a GrayImage,
    pub(super) sizes: &'a [Size],
}

/// One halving of the frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Size {
    pub(super) gray: Vec<u8>,
    pub(super) width: usize,
    pub(super) height: usize,
}

impl<'a> Pyramid<'a> {
    /// Number of halvings of the frame.
    pub(super) fn depth(&self) -> usize {
        self.sizes.len()
    }

    /// The frame halved `depth` times.
    pub(super) fn gray(&self, depth: usize) -> Gray<'a> {
        match depth.checked_sub(1).and_then(|index| self.sizes.get(index)) {
            None => Gray {
                pixels: self.frame.as_raw(),
                width: self.frame.width() as usize,
                height: self.frame.height() as usize,
            },
            Some(size) => Gray {
                pixels: &size.gray,
                width: size.width,
                height: size.height,
            },
        }
    }
}

/// The data for proofs, and the proofs so far.
pub(super) struct Prover<'a> {
    pub(super) pyramid: Pyramid<'a>,
    pub(super) circle: &'a UnitCircle,
    pub(super) polar: &'a mut Polar,
    /// Deviation of the frame's noise, gray levels.
    pub(super) noise: f32,
    /// Decimal logarithm of the number of circles that might have been tested at the full size.
    pub(super) tests: f32,
    pub(super) proofs: &'a mut Vec<Proof>,
}

impl Prover<'_> {
    /// Proves a candidate as far as it goes; the circle in pixels of the frame if it is beyond
    /// doubt.
    pub(super) fn prove(&mut self, candidate: &Candidate, looks: &mut u64) -> Option<Ring> {
        let coarsest = self.depth_for(candidate.r);
        // A larger size tells exact outlines from others, a smaller one forgives dents and noise:
        // whichever says more.
        let finest = coarsest.saturating_sub(if self.noise > NOISY { 2 } else { 1 });
        let mut best: Option<Proof> = None;
        for depth in (finest..=coarsest).rev() {
            let proof = self.prove_at(depth, &candidate.ring(), None, looks);
            if proof.is_some_and(|proof| best.is_none_or(|best| proof.certainty > best.certainty)) {
                best = proof;
            }
            if self.noise <= NOISY && best.is_some_and(|proof| proof.certainty >= SURE) {
                break;
            }
        }
        // In doubt, a smaller size is asked too: it forgives a smeared outline.
        if coarsest < self.pyramid.depth()
            && candidate.r >= LEAST_SECOND * (2 << coarsest) as f32
            && best.is_none_or(|first| !first.is_beyond_doubt())
        {
            best = Proof::better(
                best,
                self.prove_at(coarsest + 1, &candidate.ring(), None, looks),
                SECOND_LOOK,
            );
        }
        // A thin line is one in a larger size only.
        if finest > 0
            && self.noise <= NOISY
            && candidate.weight >= LEAST_WEIGHT
            && best.is_none_or(|first| first.certainty < SURE)
        {
            let narrow = Some(Narrow::Within(NARROW * candidate.r));
            let finer = self.prove_at(finest - 1, &candidate.ring(), narrow, looks);
            best = Proof::better(best, finer, SECOND_LOOK);
        }
        // A second outline close by may have the stronger edges.
        let certainty = best.map_or(f32::NEG_INFINITY, |proof| proof.certainty);
        if best.is_none_or(|proof| !proof.is_beyond_doubt())
            && (certainty >= LEAST_NARROW || candidate.weight >= LEAST_WEIGHT)
        {
            let narrow = Some(Narrow::Within(NARROW * candidate.r));
            let narrow = self.prove_at(finest, &candidate.ring(), narrow, looks);
            best = Proof::better(best, narrow, SECOND_LOOK);
        }
        self.conclude(best?, looks)
    }

    /// Proves a candidate by the edges that are closer to its outline than to this other one.
    pub(super) fn prove_narrowly(
        &mut self,
        candidate: &Candidate,
        other: &Ring,
        least_covered: f32,
        looks: &mut u64,
    ) -> Option<Ring> {
        let reach = 0.5 * candidate.ring().apart(other);
        let mut depth = self.depth_for(candidate.r).saturating_sub(1);
        while depth > 0 && reach < LEAST_NARROW_REACH * (1 << depth) as f32 {
            depth -= 1;
        }
        let narrow = Narrow::Beside(*other);
        let proof = self
            .prove_at(depth, &candidate.ring(), Some(narrow), looks)
            .filter(|proof| proof.covered >= least_covered);
        self.conclude(Proof::better(None, proof, SECOND_LOOK)?, looks)
    }

    /// A proven circle as its steepest outline on the whole, and the outline parallel to that, if
    /// there is one: of a ring or of a wide line.
    pub(super) fn parallel(&mut self, proof: &Proof, looks: &mut u64) -> Option<[Ring; 2]> {
        *looks += ROUND;
        let ring = proof.in_frame();
        let depth = self.depth_for(ring.r).saturating_sub(1);
        let scale = (1 << depth) as f32;
        let ring = ring.shrunk(scale);
        let window = proof::window_for(&ring, self.noise / scale + 0.3);
        let rays = self.circle.rays(RAYS);
        let gray = self.pyramid.gray(depth);
        self.polar
            .sample(gray, rays, &ring, window.reach, window.half);
        let polar = &*self.polar;
        let steepest = |beside: Option<f32>| {
            let far = |off: f32| beside.is_none_or(|other| (off - other).abs() >= LEAST_PARALLEL);
            polar
                .outward
                .chunks_exact(RAYS)
                .enumerate()
                .map(|(step, slopes)| {
                    (
                        slopes.iter().sum::<f32>().abs(),
                        polar.distance(step as f32),
                    )
                })
                .filter(|&(_, off)| far(off))
                .max_by(|a, b| a.0.total_cmp(&b.0))
        };
        let own = steepest(None)?;
        let other = steepest(Some(own.1)).filter(|other| other.0 >= PARALLEL * own.0)?;
        let at = |off: f32| {
            Ring {
                r: ring.r + off,
                ..ring
            }
            .grown(scale)
        };
        Some([at(own.1), at(other.1)])
    }

    /// Weighs the evidence against a circle, and keeps the proof.
    fn conclude(&mut self, mut proof: Proof, looks: &mut u64) -> Option<Ring> {
        if proof.certainty >= LEAST_REFUTED {
            proof.weaken(self.refute(&proof, &[], looks));
        }
        self.proofs.push(proof);
        proof.is_beyond_doubt().then(|| proof.in_frame())
    }

    /// The proof of a circle in pixels of the frame, in the frame that was halved so many times.
    fn prove_at(
        &mut self,
        depth: usize,
        ring: &Ring,
        narrow: Option<Narrow>,
        looks: &mut u64,
    ) -> Option<Proof> {
        let scale = (1 << depth) as f32;
        let proof = widest(Proving {
            gray: self.pyramid.gray(depth),
            circle: self.circle,
            polar: self.polar,
            start: ring.shrunk(scale),
            setting: Setting {
                noise: self.noise / scale + 0.3,
                // Each size has a quarter of the places that the next larger one has.
                tests: self.tests - 0.602 * depth as f32,
                narrow: narrow.map(|narrow| narrow.shrunk(scale)),
            },
            looks,
        })?;
        Some(Proof { depth, ..proof })
    }

    /// What speaks against a circle, if these other circles are there.
    pub(super) fn refute(&mut self, proof: &Proof, others: &[Ring], looks: &mut u64) -> Against {
        *looks += ROUND;
        let ring = proof.in_frame();
        let depth = self.depth_for(ring.r);
        let scale = (1 << depth) as f32;
        widest(Refuting {
            gray: self.pyramid.gray(depth),
            circle: self.circle,
            polar: self.polar,
            ring: ring.shrunk(scale),
            noise: self.noise / scale + 0.3,
            proof,
            others,
            scale,
        })
    }

    /// Number of halvings of the frame for a circle of this radius.
    fn depth_for(&self, mut r: f32) -> usize {
        let mut depth = 0;
        while depth < self.pyramid.depth()
            && (r >= LARGE || (r >= SMALL && self.noise > NOISY * (1 << depth) as f32))
        {
            depth += 1;
            r *= 0.5;
        }
        depth
    }
}

/// The proof of a candidate.
struct Proving<'a> {
    gray: Gray<'a>,
    circle: &'a UnitCircle,
    polar: &'a mut Polar,
    start: Ring,
    setting: Setting,
    looks: &'a mut u64,
}

impl Vectorized for Proving<'_> {
    type Output = Option<Proof>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        proof::prove(
            self.gray,
            self.circle,
            self.polar,
            self.start,
            &self.setting,
            self.looks,
        )
    }
}

/// The search for evidence against a proven circle.
struct Refuting<'a> {
    gray: Gray<'a>,
    circle: &'a UnitCircle,
    polar: &'a mut Polar,
    ring: Ring,
    noise: f32,
    proof: &'a Proof,
    /// In pixels of the frame, which are so many times smaller.
    others: &'a [Ring],
    scale: f32,
}

impl Vectorized for Refuting<'_> {
    type Output = Against;

    #[inline(always)]
    fn run(self) -> Against {
        let rays = self.circle.rays(RAYS);
        let others = self.others.iter().map(|other| other.shrunk(self.scale));
        refute::against(
            self.gray, rays, self.polar, &self.ring, self.noise, self.proof, others,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Luma;
    use proptest::prelude::*;

    proptest! {
        /// Vectors of any width give the same bits.
        #[test]
        fn wide_vectors_prove_what_plain_code_proves(
            x in 10f32..70.0, y in 10f32..70.0, r in 6f32..24.0, noise in 0f32..40.0, seed: u64,
        ) {
            let frame = GrayImage::from_fn(80, 80, |px, py| {
                let (dx, dy) = (px as f32 - x, py as f32 - y);
                let random = seed.wrapping_mul(u64::from(2 * (80 * py + px) + 1)) >> 40;
                let random = random as f32 / (1u64 << 24) as f32;
                let ball = if (dx * dx + dy * dy).sqrt() < r { 60.0 } else { 170.0 };
                Luma([(ball + noise * (2.0 * random - 1.0)).clamp(0.0, 255.0) as u8])
            });
            let circle = UnitCircle::new();
            let (mut wide, mut plain) = (Polar::default(), Polar::default());
            let of = |polar, looks| Proving {
                gray: Pyramid { frame: &frame, sizes: &[] }.gray(0),
                circle: &circle,
                polar,
                start: Ring { x: x + 0.7, y: y - 0.4, r: r + 0.5 },
                setting: Setting { noise, tests: 5.0, narrow: None },
                looks,
            };
            let (mut looks, mut others) = (0, 0);
            let wide = widest(of(&mut wide, &mut looks));
            let plain = of(&mut plain, &mut others).run();
            prop_assert_eq!(format!("{wide:?}"), format!("{plain:?}"));
        }
    }
}
