//! Samples of moves and their effect on the image: the data that a regression simulator is fitted
//! to.

use hough_heuristic::Features;
use puma_val2::{JointDelta, Joints};
use rand::{Rng, RngExt};

use crate::cell::ball::Ball;
use crate::cell::geometry::Cell;
use crate::cell::noise::with_noise;
use crate::error::{QuantityError, amount, at_most, finite, positive};

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

/// One move, and the ball before and after it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MoveSample {
    /// Features before the move.
    pub before: Features,
    /// `JT3` before the move, degrees.
    pub jt3_degrees: f64,
    /// Turns of `JT1`, `JT2` and `JT3`, degrees.
    pub turns: [f64; 3],
    /// Features after the move.
    pub after: Features,
}

impl MoveSample {
    /// Draws a move of the paper's lists, degrees of `JT1` to `JT3`: of `JT1` alone if `waist` is
    /// set, otherwise of `JT2` and `JT3`.
    pub fn draw_turns<R: Rng + ?Sized>(waist: bool, rng: &mut R) -> [f64; 3] {
        if waist {
            return [JT1[rng.random_range(0..9)], 0.0, 0.0];
        }
        let d2 = JT2[rng.random_range(0..9)];
        [0.0, d2, JT3[rng.random_range(0..9)]]
    }

    /// Refuses a sample that no model can be fitted to or judged on.
    pub(super) fn check(&self, index: usize) -> Result<(), QuantityError> {
        let [d1, d2, d3] = self.turns;
        for (quantity, value) in [
            ("x before", self.before.x),
            ("y before", self.before.y),
            ("JT3", self.jt3_degrees),
            ("d1", d1),
            ("d2", d2),
            ("d3", d3),
            ("x after", self.after.x),
            ("y after", self.after.y),
        ] {
            if !value.is_finite() {
                finite(format!("sample {index}: {quantity}"), value)?;
            }
        }
        for (quantity, r) in [("r before", self.before.r), ("r after", self.after.r)] {
            if !(r.is_finite() && r > 0.0) {
                positive(format!("sample {index}: {quantity}"), r)?;
            }
        }
        Ok(())
    }
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
            let camera = self.camera_pose(&joints);
            let ball = Ball {
                centre: self.ball_at(&camera, &features)?,
                ..self.ball
            };
            let kept = ball.centre.z > self.table + ball.radius && {
                let there = Self { ball, ..*self };
                there.circle_from(&camera).is_ok() && there.reachable()
            };
            kept.then(|| {
                let mut start = *self;
                start.place_ball(ball.centre);
                (start, joints)
            })
        })
    }

    /// Draws `count` samples of moves of `JT1` (centering), and as many of moves of `JT2` and `JT3`
    /// (approaching); returns them in this order. Each sample has its own
    /// [`Cell::exploring_start`] and a random move of the paper's lists. It is kept if the arm
    /// stays within its working limits and the ball in sight.
    ///
    /// Features carry normal noise of standard deviation `noise` feature units. The lists are
    /// shorter in a cell in which nothing can be seen or reached. 100 000 samples of each kind take
    /// about a second and 13 MB.
    ///
    /// # Errors
    /// [`QuantityError::Value`] for noise that is not a finite number of zero or above, and for
    /// more than ten million samples.
    pub fn sample_moves<R: Rng + ?Sized>(
        &self,
        count: usize,
        noise: f64,
        rng: &mut R,
    ) -> Result<(Vec<MoveSample>, Vec<MoveSample>), QuantityError> {
        amount("standard deviation of the noise (units)", noise)?;
        let name = "the number of samples of each kind";
        at_most(name, count as f64, MOST_SAMPLES as f64)?;
        let (mut centering, mut reaching) = (Vec::new(), Vec::new());
        for _ in 0..count {
            centering.extend(self.sample_move(noise, rng, true));
            reaching.extend(self.sample_move(noise, rng, false));
            if centering.is_empty() && reaching.is_empty() {
                break;
            }
        }
        Ok((centering, reaching))
    }

    /// Tries starts and moves until one keeps the ball in sight and the arm within its limits.
    fn sample_move<R: Rng + ?Sized>(
        &self,
        noise: f64,
        rng: &mut R,
        waist: bool,
    ) -> Option<MoveSample> {
        for _ in 0..10_000 {
            let (start, joints) = self.exploring_start(rng)?;
            let turns = MoveSample::draw_turns(waist, rng);
            let [d1, d2, d3] = turns;
            let after = joints + JointDelta::from_degrees([d1, d2, d3, 0.0, 0.0, 0.0]);
            if !start.within_limits(&joints) || !start.within_limits(&after) {
                continue;
            }
            if let (Ok(before), Ok(after)) = (start.features(&joints), start.features(&after)) {
                let jt3_degrees = joints.degrees()[2];
                let before = with_noise(before, noise, rng);
                let after = with_noise(after, noise, rng);
                return Some(MoveSample {
                    before,
                    jt3_degrees,
                    turns,
                    after,
                });
            }
        }
        None
    }
}
