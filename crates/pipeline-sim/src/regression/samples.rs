//! Samples of moves and their effect on the image: the data that a regression simulator is fitted
//! to.

use hough_heuristic::Features;
use puma_val2::{JointDelta, Joints};
use rand::{Rng, RngExt};

use crate::cell::ball::Ball;
use crate::cell::geometry::Cell;
use crate::cell::noise::{NOISE, with_noise};
use crate::error::{FitError, QuantityError, amount, at_most};

/// Greatest number of samples of each kind that [`Cell::sample_moves`] draws.
const MOST_SAMPLES: usize = 10_000_000;

/// Moves of `JT1` to draw from, degrees.
///
/// The paper gives the first members of the lists (-5, -1 for `JT1`; -20, -6 for `JT2`; -16, -5 for
/// `JT3`) and their length; the rest continues them symmetrically.
const JT1: [f64; 9] = [-5.0, -1.0, -0.5, -0.2, 0.0, 0.2, 0.5, 1.0, 5.0];
/// Moves of `JT2`, degrees.
const JT2: [f64; 9] = [-20.0, -6.0, -2.0, -0.6, 0.0, 0.6, 2.0, 6.0, 20.0];
/// Moves of `JT3`, degrees.
const JT3: [f64; 9] = [-16.0, -5.0, -1.6, -0.5, 0.0, 0.5, 1.6, 5.0, 16.0];

/// One move of `JT1`, and the ball before and after it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CentreSample {
    /// Features before the move.
    pub before: Features,
    /// Turn of `JT1`, degrees.
    pub d1: f64,
    /// Features after the move.
    pub after: Features,
}

/// One move of `JT2` and `JT3`, and the ball before and after it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ReachSample {
    /// Features before the move.
    pub before: Features,
    /// `JT3` before the move, degrees.
    pub jt3_degrees: f64,
    /// Turn of `JT2`, degrees.
    pub d2: f64,
    /// Turn of `JT3`, degrees.
    pub d3: f64,
    /// Features after the move.
    pub after: Features,
}

/// Refuses a sample that no model can be fitted to or judged on.
pub(super) fn check(index: usize, sample: &ReachSample) -> Result<(), FitError> {
    let numbers = [
        ("x before", sample.before.x),
        ("y before", sample.before.y),
        ("r before", sample.before.r),
        ("JT3", sample.jt3_degrees),
        ("d2", sample.d2),
        ("d3", sample.d3),
        ("y after", sample.after.y),
        ("r after", sample.after.r),
    ];
    for (quantity, value) in numbers {
        let usable = value.is_finite() && (!quantity.starts_with('r') || value > 0.0);
        if !usable {
            return Err(FitError::NotFinite {
                index,
                quantity,
                value,
            });
        }
    }
    Ok(())
}

impl Cell {
    /// Draws a start anywhere in the image: this cell with the ball put there, and the joints.
    ///
    /// y is uniform in 4..140, r log-uniform in 6..60, x uniform in 4..188, `JT3` - 170 uniform in
    /// -20..44 and `JT2` uniform in -125..-30 degrees, `JT1` = 0; kept if the ball counts as seen,
    /// can be reached, and does not lie below the table. `None` after 100 000 tries: a cell in
    /// which nothing can be seen or reached.
    pub fn exploring_start<R: Rng + ?Sized>(&self, rng: &mut R) -> Option<(Self, Joints)> {
        (0..100_000).find_map(|_| {
            let features = Features {
                x: rng.random_range(4.0..188.0),
                y: rng.random_range(4.0..140.0),
                r: rng.random_range(6.0_f64.ln()..60.0_f64.ln()).exp(),
            };
            let jt3 = 170.0 + rng.random_range(-20.0..44.0);
            let jt2 = rng.random_range(-125.0..-30.0);
            let joints =
                Joints::from_degrees([0.0, jt2, jt3, 0.0, Self::REACHING_JT5_DEGREES, 0.0]);
            let mut start = *self;
            start.ball = Ball {
                centre: self.ball_showing(&joints, &features)?,
                ..self.ball
            };
            start.place_ball(start.ball.centre);
            let kept = start.ball.centre.z > start.table + start.ball.radius
                && start.circle(&joints).is_ok()
                && start.reachable();
            kept.then_some((start, joints))
        })
    }

    /// Draws `count` samples of each kind, each from a [`Cell::exploring_start`] of its own and
    /// with a random move of the paper's lists; kept if the arm stays within its working limits and
    /// the ball in sight.
    ///
    /// Features carry normal noise of standard deviation `noise` units. In a cell in which nothing
    /// can be seen or reached the lists are short. 100 000 samples of each kind take about a second
    /// and 13 MB.
    ///
    /// # Errors
    /// [`QuantityError::NotFinite`], [`QuantityError::Negative`] for noise that is not a finite
    /// number of zero or above; [`QuantityError::TooLarge`] for more than ten million samples.
    pub fn sample_moves<R: Rng + ?Sized>(
        &self,
        count: usize,
        noise: f64,
        rng: &mut R,
    ) -> Result<(Vec<CentreSample>, Vec<ReachSample>), QuantityError> {
        amount(NOISE, noise)?;
        let name = "the number of samples of each kind";
        at_most(name, count as f64, MOST_SAMPLES as f64)?;
        let (mut centering, mut reaching) = (Vec::new(), Vec::new());
        for _ in 0..count {
            centering.extend(
                self.sample_move(noise, rng, |rng| {
                    let d1 = JT1[rng.random_range(0..9)];
                    (JointDelta::from_degrees([d1, 0.0, 0.0, 0.0, 0.0, 0.0]), d1)
                })
                .map(|(before, _, d1, after)| CentreSample { before, d1, after }),
            );
            reaching.extend(
                self.sample_move(noise, rng, |rng| {
                    let (d2, d3) = (JT2[rng.random_range(0..9)], JT3[rng.random_range(0..9)]);
                    let delta = JointDelta::from_degrees([0.0, d2, d3, 0.0, 0.0, 0.0]);
                    (delta, (d2, d3))
                })
                .map(|(before, joints, (d2, d3), after)| ReachSample {
                    before,
                    jt3_degrees: joints.degrees()[2],
                    d2,
                    d3,
                    after,
                }),
            );
            if centering.is_empty() && reaching.is_empty() {
                break;
            }
        }
        Ok((centering, reaching))
    }

    /// Tries starts and moves until one keeps the ball in sight and the arm within its limits.
    fn sample_move<R: Rng + ?Sized, M>(
        &self,
        noise: f64,
        rng: &mut R,
        mut draw: impl FnMut(&mut R) -> (JointDelta, M),
    ) -> Option<(Features, Joints, M, Features)> {
        for _ in 0..10_000 {
            let (start, joints) = self.exploring_start(rng)?;
            let (delta, drawn) = draw(rng);
            let after = joints + delta;
            if !start.within_limits(&joints) || !start.within_limits(&after) {
                continue;
            }
            if let (Ok(before), Ok(after)) = (start.features(&joints), start.features(&after)) {
                let before = with_noise(before, noise, rng);
                return Some((before, joints, drawn, with_noise(after, noise, rng)));
            }
        }
        None
    }
}
