//! Circles that passed the first looks, waiting for a closer one.

use super::budget::{Budget, Stage};
use super::chance::log10;
use super::polar::Ring;
use super::prover::Prover;
use super::search::Support;

/// Number of meetings with a circle after which it is skipped.
const MEETINGS: u32 = 3;

/// Covered share of an outline that only its distance from a proven one suggests.
const LEAST_PARALLEL: f32 = 0.8;

/// A circle found at some level, in pixels of the frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub(super) x: f32,
    pub(super) y: f32,
    pub(super) r: f32,
    /// Pixels of the frame per pixel of its level.
    pub(super) scale: f32,
    /// Strength of the evidence, to choose among candidates.
    pub(super) weight: f32,
    /// Set once it has been to the proof.
    pub(super) tried: bool,
    /// Number of meetings.
    met: u32,
}

impl Candidate {
    pub(super) fn new(ring: &Ring, scale: f32, support: Support) -> Self {
        let corner = 0.5 * (scale - 1.0);
        Self {
            x: ring.x * scale + corner,
            y: ring.y * scale + corner,
            r: ring.r * scale,
            scale,
            tried: false,
            met: 0,
            weight: weight(ring.r, support),
        }
    }

    /// The circle, in pixels of the frame.
    pub(super) fn ring(&self) -> Ring {
        Ring {
            x: self.x,
            y: self.y,
            r: self.r,
        }
    }

    /// Makes it this circle, in pixels of the frame.
    fn move_to(&mut self, ring: &Ring) {
        (self.x, self.y, self.r) = (ring.x, ring.y, ring.r);
    }

    /// Returns `true` if both have one outline, as far as their sizes tell.
    fn coincides(&self, other: &Self) -> bool {
        let off = (self.x - other.x).abs() + (self.y - other.y).abs() + (self.r - other.r).abs();
        off < 0.03 * self.r.min(other.r) + 0.5 * self.scale.min(other.scale)
    }

    /// Returns `true` if the circle may be this proven one, met again.
    fn close(&self, other: &Self) -> bool {
        let off = (self.x - other.x).abs() + (self.y - other.y).abs() + (self.r - other.r).abs();
        off < 0.06 * self.r.min(other.r) + 0.75 * self.scale.min(other.scale)
    }

    fn near(&self, other: &Self) -> bool {
        let off = (self.x - other.x).abs() + (self.y - other.y).abs() + (self.r - other.r).abs();
        off < 0.12 * self.r.min(other.r) + 1.0 * self.scale.min(other.scale)
    }
}

/// Kullback-Leibler divergence of the outline's share of edges from that of chance, summed over
/// independent samples of the outline, decimal digits.
fn weight(r: f32, support: Support) -> f32 {
    let independent = (2.0 * r).min(32.0) * support.visible as f32 / 32.0;
    let (share, chance) = (support.share().min(0.999), 0.2);
    if share <= 0.0 {
        return 0.0;
    }
    independent
        * (share * log10(share / chance) + (1.0 - share) * log10((1.0 - share) / (1.0 - chance)))
}

/// The candidates of a frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Collected {
    /// Those that are not proven beyond doubt.
    pub(super) candidates: Vec<Candidate>,
    /// The most of them that are kept.
    pub(super) most: usize,
    /// Those that are, however many.
    proven: Vec<Candidate>,
}

impl Collected {
    pub(super) fn clear(&mut self, most: usize) {
        self.candidates.clear();
        self.proven.clear();
        self.most = most;
    }

    /// The circles proven so far, in pixels of a frame that are `scale` times as large.
    pub(super) fn proven(&self, scale: f32) -> impl Iterator<Item = Ring> {
        self.proven
            .iter()
            .map(move |known| known.ring().shrunk(scale))
    }

    /// Counts a meeting; returns `true` if the circle is proven or has been met often enough.
    pub(super) fn is_known(&mut self, circle: &Candidate, budget: &mut Budget) -> bool {
        budget.looks += self.candidates.len() as u64 / 8;
        let known = self.candidates.iter_mut().find(|known| known.near(circle));
        let often = known.is_some_and(|known| {
            known.met += 1;
            known.met > MEETINGS
        });
        often || self.is_proven(circle, budget) || self.is_met(circle)
    }

    /// Returns `true` if the outline of this circle is that of a proven one.
    pub(super) fn is_proven(&self, circle: &Candidate, budget: &mut Budget) -> bool {
        self.known(circle, budget).is_some()
    }

    /// The proven circle whose outline this one has.
    fn known(&self, circle: &Candidate, budget: &mut Budget) -> Option<Ring> {
        budget.looks += self.proven.len() as u64 / 16;
        let known = self.proven.iter().find(|proven| proven.coincides(circle));
        known.map(Candidate::ring)
    }

    /// Counts a meeting with a proven circle; returns `true` after enough of them.
    fn is_met(&mut self, circle: &Candidate) -> bool {
        let known = self.proven.iter_mut().find(|known| known.close(circle));
        known.is_some_and(|known| {
            known.met += 1;
            known.met > MEETINGS
        })
    }

    /// Keeps the better of this candidate and one near it. Returns `None` if the candidate is not
    /// worth a proof at once, otherwise its place in the list, if it has one.
    pub(super) fn add(
        &mut self,
        candidate: Candidate,
        budget: &mut Budget,
    ) -> Option<Option<usize>> {
        budget.looks += self.candidates.len() as u64 / 8;
        let better = |known: &Candidate| candidate.weight > known.weight;
        let near = self
            .candidates
            .iter()
            .position(|known| known.near(&candidate));
        if let Some(place) = near {
            return better(&self.candidates[place]).then(|| {
                let met = self.candidates[place].met;
                self.candidates[place] = Candidate { met, ..candidate };
                Some(place)
            });
        }
        if self.candidates.len() < self.most {
            self.candidates.push(candidate);
            return Some(Some(self.candidates.len() - 1));
        }
        let weights = self.candidates.iter().map(|known| known.weight).enumerate();
        let (worst, _) = weights.min_by(|a, b| a.1.total_cmp(&b.1))?;
        if better(&self.candidates[worst]) {
            self.candidates[worst] = candidate;
            Some(Some(worst))
        } else {
            Some(None)
        }
    }

    /// Proves a candidate, and moves it from its place, if it has one, to the proven ones; the
    /// circle if it is beyond doubt.
    pub(super) fn settle(
        &mut self,
        place: Option<usize>,
        candidate: &Candidate,
        prover: &mut Prover<'_>,
        budget: &mut Budget,
    ) -> Option<Ring> {
        let mut proven = *candidate;
        let ring = prover.prove(candidate, &mut budget.looks)?;
        proven.move_to(&ring);
        // Drawn to the stronger edges of another outline: this one may still be there.
        if let Some(known) = self.known(&proven, budget) {
            let ring = prover.prove_narrowly(candidate, &known, 0.0, &mut budget.looks)?;
            proven.move_to(&ring);
            if self.is_proven(&proven, budget) {
                return Some(ring);
            }
        }
        if let Some(place) = place {
            self.candidates.swap_remove(place);
        }
        self.proven.push(proven);
        budget.grant();
        Some(proven.ring())
    }

    /// Proves the other outlines of the rings and wide lines whose one outline is proven.
    pub(super) fn prove_parallels(&mut self, prover: &mut Prover<'_>, budget: &mut Budget) {
        for index in 0..prover.proofs.len() {
            if budget.is_late() || budget.is_over(Stage::Proofs) {
                return;
            }
            let proof = prover.proofs[index];
            if !proof.is_beyond_doubt() {
                continue;
            }
            let Some([one, other]) = prover.parallel(&proof, &mut budget.looks) else {
                continue;
            };
            for (ring, beside) in [(one, other), (other, one)] {
                let candidate = Candidate::new(&ring, 1.0, Support::default());
                let looks = &mut budget.looks;
                if self.proven.iter().any(|known| known.coincides(&candidate)) {
                    continue;
                }
                let proven = prover.prove_narrowly(&candidate, &beside, LEAST_PARALLEL, looks);
                if let Some(ring) = proven {
                    self.proven
                        .push(Candidate::new(&ring, 1.0, Support::default()));
                    budget.grant();
                }
            }
        }
    }
}
