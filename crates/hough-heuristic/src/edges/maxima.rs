//! The maxima of the gradient across edges, without hysteresis: what a detector wants that looks
//! for order itself.

use super::dispatch;
use super::rows::{Candidate, Passes, Rows, UNITS};
use super::smoothing::{noise_gain, smoothing_weights};

/// Finds the pixels whose gradient is a maximum across the edge.
#[derive(Clone, Debug)]
pub(crate) struct Maxima {
    passes: Passes,
    noise_gain: f32,
    rows: Rows,
    candidates: Vec<Candidate>,
    squares: Vec<i32>,
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
            squares: Vec::new(),
            #[cfg(feature = "parallel")]
            strips: Vec::new(),
        }
    }

    /// The deviation of each part of the gradient under white noise of deviation 1.
    pub(crate) fn noise_gain(&self) -> f32 {
        self.noise_gain
    }

    /// The maxima above `threshold`, in gray levels of Sobel's gradient, row by row, and of more
    /// than `most` only the strongest; none in a frame below 3x3.
    pub(crate) fn find(
        &mut self,
        gray: &[u8],
        width: usize,
        threshold: f32,
        most: usize,
    ) -> &[Candidate] {
        self.candidates.clear();
        let height = gray.len().checked_div(width).unwrap_or(0);
        if width >= 3 && height >= 3 {
            let threshold = threshold * UNITS;
            self.passes.low = (threshold * threshold) as i32;
            #[cfg(feature = "parallel")]
            let found = self.find_in_strips(gray, width);
            #[cfg(not(feature = "parallel"))]
            let found = false;
            if !found {
                self.find_at_once(gray, width);
            }
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

    fn find_at_once(&mut self, gray: &[u8], width: usize) {
        dispatch::candidates(
            &self.passes,
            gray,
            width,
            &mut self.rows,
            &mut [],
            &mut self.candidates,
        );
    }
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
    fn find_in_strips(&mut self, gray: &[u8], width: usize) -> bool {
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
        let strips = &mut self.strips[..count];
        strips
            .par_iter_mut()
            .enumerate()
            .for_each(|(index, strip)| {
                let own = index * height / count..(index + 1) * height / count;
                let (first, end) = (
                    own.start.saturating_sub(around),
                    (own.end + around).min(height),
                );
                let part = &gray[first * width..end * width];
                let Strip { rows, candidates } = strip;
                candidates.clear();
                dispatch::candidates(passes, part, width, rows, &mut [], candidates);
                candidates.retain_mut(|candidate| {
                    candidate.pixel.y += first as u32;
                    own.contains(&(candidate.pixel.y as usize))
                });
            });
        for strip in strips {
            self.candidates.extend_from_slice(&strip.candidates);
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
            let low = 20.0 * UNITS;
            (strips.passes.low, whole.passes.low) = ((low * low) as i32, (low * low) as i32);
            let split = pool.install(|| strips.find_in_strips(&gray, width));
            prop_assert_eq!(split, gray.len() >= 2 * LEAST_STRIP && height >= 2 * LEAST_ROWS);
            if split {
                whole.find_at_once(&gray, width);
                prop_assert_eq!(&strips.candidates, &whole.candidates);
            }
        }
    }
}
