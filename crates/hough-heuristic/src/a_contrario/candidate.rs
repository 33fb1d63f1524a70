//! Circles that passed the first looks, waiting for a closer one.

use super::budget::Budget;
use super::polar::Ring;
use super::proof::log10;
use super::search::Support;

/// Number of meetings with a circle after which it is skipped.
const MEETINGS: u32 = 3;

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

    fn near(&self, other: &Self) -> bool {
        let off = (self.x - other.x).abs() + (self.y - other.y).abs() + (self.r - other.r).abs();
        off < 0.12 * self.r.min(other.r) + 1.0 * self.scale.min(other.scale)
    }
}

/// Divergence of the outline's edges from those of chance, summed over the outline.
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
    pub(super) candidates: Vec<Candidate>,
    /// The most that are kept.
    pub(super) most: usize,
}

impl Collected {
    pub(super) fn clear(&mut self, most: usize) {
        self.candidates.clear();
        self.most = most;
    }

    /// Counts a meeting; returns `true` if nearly this circle has been met often enough.
    pub(super) fn is_known(&mut self, circle: &Candidate, budget: &mut Budget) -> bool {
        budget.looks += self.candidates.len() as u64 / 8;
        let known = self.candidates.iter_mut().find(|known| known.near(circle));
        known.is_some_and(|known| {
            known.met += 1;
            known.met > MEETINGS
        })
    }

    /// Keeps the better of nearly equal candidates; returns its index if it was kept.
    pub(super) fn add(&mut self, candidate: Candidate, budget: &mut Budget) -> Option<usize> {
        budget.looks += self.candidates.len() as u64 / 8;
        let better = |known: &Candidate| candidate.weight > known.weight;
        let place = if let Some(place) = self
            .candidates
            .iter()
            .position(|known| known.near(&candidate))
        {
            place
        } else if self.candidates.len() < self.most {
            self.candidates.push(candidate);
            return Some(self.candidates.len() - 1);
        } else {
            let weights = self.candidates.iter().map(|known| known.weight).enumerate();
            weights.min_by(|a, b| a.1.total_cmp(&b.1))?.0
        };
        better(&self.candidates[place]).then(|| {
            let met = self.candidates[place].met;
            self.candidates[place] = Candidate { met, ..candidate };
            place
        })
    }
}
