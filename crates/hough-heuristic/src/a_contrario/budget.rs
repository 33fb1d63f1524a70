//! The limit of work per frame. It is counted, so that a frame is always searched as far.

use std::time::{Duration, Instant};

use super::AContrarioConfig;
use crate::clock;

/// Looks that a draw takes on average over dense texture. All draws share their looks.
const LOOKS_PER_DRAW: u64 = 16;
/// Least size that a budget is computed for, million pixels: a circle costs as much in a small
/// frame as in a large one.
const LEAST_MEGAPIXELS: f64 = 0.25;

/// Cost of a look at all edges around a circle, in looks.
pub(super) const ROUND: u64 = 200;
/// Cost of a proof at one size, in looks.
const PROOF: u64 = 1500;
/// Cost of a measurement, in looks.
pub(super) const MEASURING: u64 = 1500;

/// Looks that each circle found adds: proofs at two sizes, the measurement, and the search.
const CIRCLE: u64 = 2 * PROOF + MEASURING + 3500;
/// Draws that go with them.
const DRAWS_PER_CIRCLE: u64 = 50;

/// Part of the work. Each part has a budget of looks of its own, which begins where that of the
/// part before it ends.
#[derive(Clone, Copy, Debug)]
pub(super) enum Stage {
    Search,
    Proofs,
    Measurements,
}

/// The limits, and the work done so far.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Budget {
    pub(super) draws: u64,
    /// Work done, in units of the time to look at one place.
    pub(super) looks: u64,
    most_draws: u64,
    /// By [`Stage`].
    most_looks: [u64; 3],
    /// Looks and draws of the search that may be spent by the end of this size.
    most_of_size: u64,
    most_draws_of_size: u64,
    pub(super) deadline: Option<Instant>,
    /// Set once the deadline has passed.
    late: bool,
    /// Circles proven beyond doubt.
    pub(super) proven: u64,
    /// Set once circles were left out as too many.
    pub(super) left_out: bool,
    /// Set once any part was cut short.
    pub(super) spent: bool,
    /// Looks at the last reading of the clock, and the most between two readings.
    #[cfg(test)]
    readings: (u64, u64),
}

impl Budget {
    /// For a frame with so many pixels.
    pub(super) fn new(config: &AContrarioConfig, pixels: usize) -> Self {
        let megapixels = pixels as f64 * 1e-6;
        let draws = f64::from(config.draws_per_megapixel) * megapixels.max(LEAST_MEGAPIXELS);
        let most_draws = draws.ceil() as u64;
        let looks = LOOKS_PER_DRAW * most_draws + 4 * (PROOF + MEASURING);
        Self {
            most_draws,
            most_looks: [14, 17, 20].map(|twentieths| looks / 20 * twentieths),
            deadline: config.milliseconds_per_megapixel.and_then(|time| {
                Some(clock::now()? + Duration::from_secs_f64(time * megapixels * 1e-3))
            }),
            ..Self::default()
        }
    }

    /// Makes space for a circle that was found, so that the work grows with their number.
    pub(super) fn grant(&mut self) {
        self.proven += 1;
        self.most_draws += DRAWS_PER_CIRCLE;
        for most in &mut self.most_looks {
            *most += CIRCLE;
        }
        self.most_of_size += CIRCLE;
        self.most_draws_of_size += DRAWS_PER_CIRCLE;
    }

    /// Doubles the work allowed if one more size is searched.
    pub(super) fn extend(&mut self, one_more: bool) {
        let factor = if one_more { 2 } else { 1 };
        self.most_draws *= factor;
        self.most_looks = self.most_looks.map(|most| factor * most);
    }

    /// Begins the search of a size, which leaves half of the work to those after it.
    pub(super) fn begin_size(&mut self, is_last: bool) {
        let share = |most: u64, spent: u64| {
            let left = most.saturating_sub(spent);
            spent + if is_last { left } else { left / 2 }
        };
        self.most_of_size = share(self.most_looks[Stage::Search as usize], self.looks);
        self.most_draws_of_size = share(self.most_draws, self.draws);
    }

    /// Returns `true` if this part of the work is to end.
    #[inline(always)]
    pub(super) fn is_over(&mut self, stage: Stage) -> bool {
        let drawn = matches!(stage, Stage::Search)
            && (self.draws >= self.most_draws_of_size || self.looks >= self.most_of_size);
        let over = drawn || self.late || self.looks >= self.most_looks[stage as usize];
        self.spent |= over;
        over
    }

    /// Reads the clock if there is a deadline, and returns `true` if it has passed.
    pub(super) fn is_late(&mut self) -> bool {
        #[cfg(test)]
        {
            let (last, most) = self.readings;
            self.readings = (self.looks, most.max(self.looks - last));
        }
        self.late |= clock::is_past(self.deadline);
        self.spent |= self.late;
        self.late
    }
}

#[cfg(test)]
mod tests {
    use image::{GrayImage, Luma};

    use crate::a_contrario::{AContrario, AContrarioConfig};
    use crate::detect::CircleDetector;

    /// A look takes some nanoseconds, so that these are well below a millisecond.
    #[test]
    fn little_work_lies_between_two_readings_of_the_clock() {
        let frame = GrayImage::from_fn(640, 480, |x, y| {
            let (dx, dy) = (f64::from(x % 80) - 40.0, f64::from(y % 80) - 40.0);
            let disc = if dx.hypot(dy) < 25.0 { 90 } else { 0 };
            let texture = if x < 320 {
                (x / 7 * 31 + y / 5 * 17) % 64
            } else {
                0
            };
            Luma([(60 + disc + texture) as u8])
        });
        let mut detector = AContrario::new(AContrarioConfig::default()).unwrap();
        assert!(detector.detect(&frame).unwrap().len() >= 24);
        let (_, most) = detector.budget.readings;
        assert!(most > 0 && most < 60_000, "{most}");
    }
}
