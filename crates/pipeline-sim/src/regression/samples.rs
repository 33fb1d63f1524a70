//! Moves and what they did to the image: the data that a regression simulator is fitted to.

use hough_heuristic::Features;
use puma_val2::{JointDelta, Joints};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

use crate::cell::ball::Ball;
use crate::cell::geometry::Cell;
use crate::cell::moves::MoveLists;
use crate::error::QuantityError;
use crate::error::{amount, at_most};
use crate::regression::least_squares::FitError;

/// What errors call the noise on features.
pub(crate) const NOISE: &str = "standard deviation of the features' noise (units)";

/// Most samples of each kind that [`try_sample_moves`] does not take for a mistake.
pub const MOST_SAMPLES: usize = 10_000_000;

/// One move of `JT2` and `JT3`, and the ball before and after it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ReachSample {
    /// What the image showed before the move.
    pub before: Features,
    /// `JT3` before the move, degrees.
    pub jt3_degrees: f64,
    /// By how much `JT2` turned, degrees.
    pub d2: f64,
    /// By how much `JT3` turned, degrees.
    pub d3: f64,
    /// What the image showed after the move.
    pub after: Features,
}

/// Refuses a sample that no model can be fitted to or judged on.
pub(crate) fn check(index: usize, sample: &ReachSample) -> Result<(), FitError> {
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

/// One move of `JT1`, and the ball before and after it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CentreSample {
    /// What the image showed before the move.
    pub before: Features,
    /// By how much `JT1` turned, degrees.
    pub d1: f64,
    /// What the image showed after the move.
    pub after: Features,
}

/// A ball in sight and an arm that can reach it, anywhere in the image: `cell` with the ball put
/// there, and the joints.
///
/// Distribution: y uniform in 4..140, r log-uniform in 6..60, x uniform in 4..188, `JT3` - 170
/// uniform in -20..44 and `JT2` uniform in -125..-30 degrees, `JT1` = 0; kept if the ball counts as
/// seen, can be reached, and does not lie below the table. `None` if 100 000 tries bring nothing: a
/// cell in which nothing can be seen or reached.
pub fn exploring_start<R: Rng + ?Sized>(cell: &Cell, rng: &mut R) -> Option<(Cell, Joints)> {
    (0..100_000).find_map(|_| {
        let features = Features {
            x: rng.random_range(4.0..188.0),
            y: rng.random_range(4.0..140.0),
            r: rng.random_range(6.0_f64.ln()..60.0_f64.ln()).exp(),
        };
        let jt3 = 170.0 + rng.random_range(-20.0..44.0);
        let jt2 = rng.random_range(-125.0..-30.0);
        let joints = Joints::from_degrees([0.0, jt2, jt3, 0.0, Cell::REACHING_JT5_DEGREES, 0.0]);
        let mut start = *cell;
        start.ball = Ball {
            centre: cell.ball_showing(&joints, &features)?,
            ..cell.ball
        };
        start.place_ball(start.ball.centre);
        let kept = start.ball.centre.z > start.table + start.ball.radius
            && start.circle(&joints).is_some()
            && start.reachable();
        kept.then_some((start, joints))
    })
}

/// Draws `count` samples of each kind in `cell`, each from an [`exploring_start`] of its own and
/// with a move from the [`MoveLists`] of the paper; kept if the arm stays within its working limits
/// and the ball in sight.
///
/// Features carry normal noise of standard deviation `noise` units ([`with_noise`]). In a cell in
/// which nothing can be seen or reached the vectors come back short; with noise that is no finite
/// number they come back empty. A hundred thousand samples of each kind take about a second and 13
/// MB; any number is drawn that is asked for. [`try_sample_moves`] refuses what makes no sense.
pub fn sample_moves<R: Rng + ?Sized>(
    cell: &Cell,
    count: usize,
    noise: f64,
    rng: &mut R,
) -> (Vec<CentreSample>, Vec<ReachSample>) {
    if !noise.is_finite() {
        return (Vec::new(), Vec::new());
    }
    let moves = MoveLists::paper();
    let (mut centring, mut reaching) = (Vec::new(), Vec::new());
    for _ in 0..count {
        centring.extend(
            tried_sample(cell, noise, rng, |rng| {
                let d1 = moves.jt1[rng.random_range(0..9)];
                (JointDelta::from_degrees([d1, 0.0, 0.0, 0.0, 0.0, 0.0]), d1)
            })
            .map(|(before, _, d1, after)| CentreSample { before, d1, after }),
        );
        reaching.extend(
            tried_sample(cell, noise, rng, |rng| {
                let (d2, d3) = (
                    moves.jt2[rng.random_range(0..9)],
                    moves.jt3[rng.random_range(0..9)],
                );
                (
                    JointDelta::from_degrees([0.0, d2, d3, 0.0, 0.0, 0.0]),
                    (d2, d3),
                )
            })
            .map(|(before, joints, (d2, d3), after)| ReachSample {
                before,
                jt3_degrees: joints.degrees()[2],
                d2,
                d3,
                after,
            }),
        );
        if centring.is_empty() && reaching.is_empty() {
            break;
        }
    }
    (centring, reaching)
}

/// As [`sample_moves`].
///
/// # Errors
/// [`QuantityError::NotFinite`], [`QuantityError::Negative`] for noise that is no finite number of
/// zero or above; [`QuantityError::TooLarge`] for more than ten million samples of each kind, which
/// would fill 1.3 GB.
pub fn try_sample_moves<R: Rng + ?Sized>(
    cell: &Cell,
    count: usize,
    noise: f64,
    rng: &mut R,
) -> Result<(Vec<CentreSample>, Vec<ReachSample>), QuantityError> {
    amount(NOISE, noise)?;
    at_most(
        "the number of samples of each kind",
        count as f64,
        MOST_SAMPLES as f64,
    )?;
    Ok(sample_moves(cell, count, noise, rng))
}

/// Starts and moves until one keeps the ball in sight and the arm within its limits.
fn tried_sample<R: Rng + ?Sized, M>(
    cell: &Cell,
    noise: f64,
    rng: &mut R,
    mut draw: impl FnMut(&mut R) -> (JointDelta, M),
) -> Option<(Features, Joints, M, Features)> {
    for _ in 0..10_000 {
        // Where there is no start there is no sample, however often one asks.
        let (start, joints) = exploring_start(cell, rng)?;
        let (delta, drawn) = draw(rng);
        let after = joints + delta;
        if !start.within_limits(&joints) || !start.within_limits(&after) {
            continue;
        }
        if let (Some(before), Some(after)) = (start.features(&joints), start.features(&after)) {
            let before = with_noise(before, noise, rng);
            return Some((before, joints, drawn, with_noise(after, noise, rng)));
        }
    }
    None
}

/// `features` with normal noise of standard deviation `sigma` units on each, whose sign does not
/// count; the radius stays above a tenth of a unit. With a `sigma` that is no finite number, none
/// of the three is a number.
pub fn with_noise<R: Rng + ?Sized>(features: Features, sigma: f64, rng: &mut R) -> Features {
    if sigma == 0.0 {
        return features;
    }
    if !sigma.is_finite() {
        let [x, y, r] = [f64::NAN; 3];
        return Features { x, y, r };
    }
    let sigma = sigma.abs();
    let mut draw = || -> f64 { StandardNormal.sample(rng) };
    Features {
        x: features.x + sigma * draw(),
        y: features.y + sigma * draw(),
        r: (features.r + sigma * draw()).max(0.1),
    }
}
