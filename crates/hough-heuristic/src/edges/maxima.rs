//! The maxima of the gradient across edges, without hysteresis: what a detector wants that looks for order itself.

use super::canny::{noise_gain, smoothing_weights};
use super::dispatch;
use super::rows::{Candidate, Passes, Rows, UNITS};

/// Finds the pixels whose gradient is a maximum across the edge.
#[derive(Clone, Debug)]
pub(crate) struct Maxima {
    passes: Passes,
    noise_gain: f32,
    rows: Rows,
    marks: Vec<u8>,
    candidates: Vec<Candidate>,
    squares: Vec<i32>,
}

impl Maxima {
    /// For frames smoothed by a Gaussian of deviation `sigma`, pixels (0..=2).
    pub(crate) fn new(sigma: f32) -> Self {
        let weights = smoothing_weights(sigma);
        Self {
            noise_gain: noise_gain(&weights),
            passes: Passes {
                weights,
                low: 0,
                high: i32::MAX,
            },
            rows: Rows::default(),
            marks: Vec::new(),
            candidates: Vec::new(),
            squares: Vec::new(),
        }
    }

    /// The deviation of each part of the gradient under white noise of deviation 1.
    pub(crate) fn noise_gain(&self) -> f32 {
        self.noise_gain
    }

    /// The maxima above `threshold`, in grey levels of Sobel's gradient, row by row, and of more than `most` only the strongest; none in a
    /// frame below 3x3.
    pub(crate) fn find(&mut self, grey: &[u8], width: usize, threshold: f32, most: usize) -> &[Candidate] {
        self.candidates.clear();
        let height = grey.len().checked_div(width).unwrap_or(0);
        if width >= 3 && height >= 3 {
            let threshold = threshold * UNITS;
            self.passes.low = (threshold * threshold) as i32;
            self.marks.resize(grey.len(), 0);
            dispatch::candidates(
                &self.passes,
                grey,
                width,
                &mut self.rows,
                &mut self.marks,
                &mut self.candidates,
            );
        }
        if self.candidates.len() > most {
            self.squares.clear();
            self.squares.extend(
                self.candidates
                    .iter()
                    .map(|candidate| candidate.gradient.square()),
            );
            let rank = self.squares.len() - most;
            let (_, &mut least, _) = self.squares.select_nth_unstable(rank);
            self.candidates
                .retain(|candidate| candidate.gradient.square() >= least);
        }
        &self.candidates
    }
}
