//! Circles that passed the first looks, waiting for a closer one.

use super::polar::Ring;
use super::search::{Budget, Support};

/// A circle found at some level, in pixels of the frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub(super) x: f32,
    pub(super) y: f32,
    pub(super) r: f32,
    /// Pixels of the frame per pixel of its level.
    pub(super) scale: f32,
    pub(super) support: Support,
    /// How much speaks for it, to choose among candidates.
    pub(super) weight: f32,
}

impl Candidate {
    pub(super) fn new(ring: &Ring, scale: f32, support: Support) -> Self {
        let corner = 0.5 * (scale - 1.0);
        Self {
            x: ring.x * scale + corner,
            y: ring.y * scale + corner,
            r: ring.r * scale,
            scale,
            support,
            weight: {
                let n = (ring.r * super::tune(21, 2.0)).min(32.0) * support.visible as f32 / 32.0;
                let (q, p) = (support.share().min(0.999), super::tune(22, 0.2));
                n * (q * (q / p).ln() + (1.0 - q) * ((1.0 - q) / (1.0 - p)).ln())
            },
        }
    }

    /// The ring at a level of this scale.
    pub(super) fn ring(&self, scale: f32) -> Ring {
        let corner = 0.5 * (scale - 1.0);
        Ring {
            x: (self.x - corner) / scale,
            y: (self.y - corner) / scale,
            r: self.r / scale,
        }
    }

    fn near(&self, other: &Self) -> bool {
        let off = (self.x - other.x).abs() + (self.y - other.y).abs() + (self.r - other.r).abs();
        off < super::tune(8, 0.12) * self.r.min(other.r) + 1.0 * self.scale.min(other.scale)
    }
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

    /// Keeps the better of those that are nearly one.
    pub(super) fn add(&mut self, candidate: Candidate, budget: &mut Budget) {
        budget.looks += self.candidates.len() as u64 / 4;
        if let Some(known) = self.candidates.iter_mut().find(|known| known.near(&candidate)) {
            if candidate.weight > known.weight {
                *known = candidate;
            }
        } else if self.candidates.len() < self.most {
            self.candidates.push(candidate);
        } else if let Some(worst) = self
            .candidates
            .iter_mut()
            .min_by(|a, b| a.weight.total_cmp(&b.weight))
            && worst.weight < candidate.weight
        {
            *worst = candidate;
        }
    }
}
