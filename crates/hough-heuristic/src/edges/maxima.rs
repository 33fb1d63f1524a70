//! The maxima of the gradient across edges, without hysteresis.

use std::time::Instant;

use super::rows::{Candidate, Finding, Passes, Rows, UNITS};
use super::smoothing::{noise_gain, smoothing_weights};
use super::widest;
#[cfg(feature = "parallel")]
use crate::clock;

/// Finds the pixels whose gradient is a maximum across the edge.
#[derive(Clone, Debug)]
pub(crate) struct Maxima {
    pub(super) passes: Passes,
    noise_gain: f32,
    pub(super) rows: Rows,
    candidates: Vec<Candidate>,
    #[cfg(feature = "parallel")]
    strips: Vec<Strip>,
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
            candidates: Vec::new(),
            #[cfg(feature = "parallel")]
            strips: Vec::new(),
        }
    }

    /// The deviation of each part of the gradient under white noise of deviation 1.
    pub(crate) fn noise_gain(&self) -> f32 {
        self.noise_gain
    }

    /// The maxima found last.
    pub(crate) fn found(&self) -> &[Candidate] {
        &self.candidates
    }

    /// The maxima above `threshold`, in gray levels of Sobel's gradient, row by row; none in a
    /// frame below 3x3, or if the deadline passes before they are all found.
    pub(crate) fn find(
        &mut self,
        gray: &[u8],
        width: usize,
        threshold: f32,
        deadline: Option<Instant>,
    ) -> &[Candidate] {
        self.passes.low = squared(threshold);
        if width < 3 || gray.len() < 3 * width {
            self.candidates.clear();
            return &self.candidates;
        }
        #[cfg(feature = "parallel")]
        if self.find_in_strips(gray, width, deadline) {
            return &self.candidates;
        }
        self.find_at_once(gray, width, &mut [], deadline)
    }

    /// The maxima above the low threshold of a frame of at least 3x3 pixels, marked in `marks` as
    /// weak or, above the high one, strong.
    pub(super) fn mark(
        &mut self,
        gray: &[u8],
        width: usize,
        (low, high): (f32, f32),
        marks: &mut [u8],
    ) -> &[Candidate] {
        (self.passes.low, self.passes.high) = (squared(low), squared(high));
        self.find_at_once(gray, width, marks, None)
    }

    fn find_at_once(
        &mut self,
        gray: &[u8],
        width: usize,
        marks: &mut [u8],
        deadline: Option<Instant>,
    ) -> &[Candidate] {
        self.candidates.clear();
        widest(Finding {
            passes: &self.passes,
            gray,
            width,
            rows: &mut self.rows,
            marks,
            found: &mut self.candidates,
            deadline,
        });
        &self.candidates
    }
}

/// A threshold as the passes compare it: squared, in units of their own.
pub(super) fn squared(threshold: f32) -> i32 {
    let threshold = threshold * UNITS;
    (threshold * threshold) as i32
}

/// A part of the rows, with what is needed to work on it.
#[cfg(feature = "parallel")]
#[derive(Clone, Debug, Default)]
struct Strip {
    rows: Rows,
    candidates: Vec<Candidate>,
}

/// Strips of fewer pixels are not worth a thread's waking.
#[cfg(feature = "parallel")]
const LEAST_STRIP: usize = if cfg!(test) { 300 } else { 400_000 };

/// Nor are strips of fewer rows.
#[cfg(feature = "parallel")]
const LEAST_ROWS: usize = 4;

#[cfg(feature = "parallel")]
impl Maxima {
    /// Finds the candidates of large frames, a strip of rows on each thread; false if the frame is
    /// too small for that.
    fn find_in_strips(&mut self, gray: &[u8], width: usize, deadline: Option<Instant>) -> bool {
        use rayon::prelude::*;

        let height = gray.len() / width;
        let count = rayon::current_num_threads()
            .min(gray.len() / LEAST_STRIP)
            .min(height / LEAST_ROWS);
        if count < 2 {
            return false;
        }
        // A row's candidates depend on so many rows on either side: one for the maxima, one for
        // Sobel's kernel, and the smoothing.
        let around = self.passes.weights.len() + 1;
        let passes = &self.passes;
        self.strips
            .resize_with(count.max(self.strips.len()), Strip::default);
        let strips = self.strips[..count].par_iter_mut().enumerate();
        strips.for_each(|(index, Strip { rows, candidates })| {
            let own = index * height / count..(index + 1) * height / count;
            let first = own.start.saturating_sub(around);
            let end = (own.end + around).min(height);
            candidates.clear();
            widest(Finding {
                passes,
                gray: &gray[first * width..end * width],
                width,
                rows,
                marks: &mut [],
                found: candidates,
                deadline,
            });
            candidates.retain_mut(|candidate| {
                candidate.pixel.y += first as u32;
                own.contains(&(candidate.pixel.y as usize))
            });
        });
        self.candidates.clear();
        if !clock::is_past(deadline) {
            let found = self.strips[..count]
                .iter()
                .flat_map(|strip| &strip.candidates);
            self.candidates.extend(found);
        }
        true
    }
}

#[cfg(all(test, feature = "parallel"))]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn strips_give_what_the_whole_frame_gives(
            width in 3usize..60, height in 3usize..90, threads in 2usize..7,
            roughness in 1u8..=255, seed: u64, sigma in 0f32..=2.0,
        ) {
            let mut state = seed | 1;
            let gray: Vec<u8> = (0..width * height).map(|index| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                let step = if (index % width + index / width) % 23 < 11 { 90 } else { 0 };
                ((state >> 56) as u8 % roughness).saturating_add(step)
            }).collect();
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let (mut strips, mut whole) = (Maxima::new(sigma), Maxima::new(sigma));
            (strips.passes.low, whole.passes.low) = (squared(20.0), squared(20.0));
            let split = pool.install(|| strips.find_in_strips(&gray, width, None));
            prop_assert_eq!(split, gray.len() >= 2 * LEAST_STRIP && height >= 2 * LEAST_ROWS);
            if split {
                whole.find_at_once(&gray, width, &mut [], None);
                prop_assert_eq!(&strips.candidates, &whole.candidates);
            }
        }
    }
}
