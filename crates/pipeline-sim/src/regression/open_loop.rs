//! How far a model drifts from the plant when it is believed for several moves.

use puma_val2::{Joint, JointDelta};
use rand::{Rng, RngExt};

use crate::cell::geometry::Cell;
use crate::cell::moves::MoveLists;
use crate::error::QuantityError;
use crate::error::at_most;
use crate::regression::reach_model::ReachModel;
use crate::regression::samples::exploring_start;

/// Errors of a model after some moves in a row without a look at the plant, feature units.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct OpenLoopError {
    /// Moves in a row.
    pub moves: usize,
    /// Runs that were counted.
    pub runs: usize,
    /// Runs that ended before because the model had no prediction (it placed the ball behind the
    /// camera).
    pub lost: usize,
    /// Mean absolute error of y.
    pub y_mean: f64,
    /// Mean absolute error of r.
    pub r_mean: f64,
    /// Median absolute error of y.
    pub y_median: f64,
    /// Median absolute error of r.
    pub r_median: f64,
}

impl ReachModel {
    /// Most moves in a row that errors are told for.
    pub const MOST_MOVES: usize = 10_000;
    /// Most moves of all runs together.
    const MOST_ERRORS: f64 = 1e8;

    /// As [`ReachModel::open_loop_error`].
    ///
    /// # Errors
    /// [`QuantityError::TooLarge`] for more than [`ReachModel::MOST_MOVES`] moves, or a hundred
    /// million in all runs; [`QuantityError::NotPositive`] without a run.
    pub fn try_open_loop_error<R: Rng + ?Sized>(
        &self,
        cell: &Cell,
        moves: usize,
        runs: usize,
        rng: &mut R,
    ) -> Result<Vec<OpenLoopError>, QuantityError> {
        at_most(
            "the number of moves in a row",
            moves as f64,
            Self::MOST_MOVES as f64,
        )?;
        if runs == 0 {
            return Err(QuantityError::NotPositive {
                quantity: "the number of runs".to_owned(),
                value: 0.0,
            });
        }
        let all = moves.max(1) as f64 * runs as f64;
        at_most("the number of moves of all runs", all, Self::MOST_ERRORS)?;
        Ok(self.open_loop_error(cell, moves, runs, rng))
    }

    /// Compares model and plant over runs of up to `moves` random moves from the paper's lists,
    /// starting from [`exploring_start`]s; entry k holds the errors after k + 1 moves.
    ///
    /// A run goes on while the plant keeps the ball in sight and the arm within its limits (moves
    /// that do not are not taken); the model gets its own last prediction as its next input. More
    /// than [`ReachModel::MOST_MOVES`] count as that many ([`ReachModel::try_open_loop_error`]
    /// refuses them).
    pub fn open_loop_error<R: Rng + ?Sized>(
        &self,
        cell: &Cell,
        moves: usize,
        runs: usize,
        rng: &mut R,
    ) -> Vec<OpenLoopError> {
        let lists = MoveLists::paper();
        let moves = moves.min(Self::MOST_MOVES);
        let mut errors: Vec<(Vec<f64>, Vec<f64>)> = vec![Default::default(); moves];
        let mut lost = vec![0; moves];
        for _ in 0..runs {
            let Some((start, mut joints)) = exploring_start(cell, rng) else {
                break;
            };
            let Some(mut believed) = start.features(&joints) else {
                continue;
            };
            for (k, (y, r)) in errors.iter_mut().enumerate() {
                let Some((d2, d3, there)) = (0..100).find_map(|_| {
                    let (d2, d3) = (
                        lists.jt2[rng.random_range(0..9)],
                        lists.jt3[rng.random_range(0..9)],
                    );
                    let after = joints + JointDelta::from_degrees([0.0, d2, d3, 0.0, 0.0, 0.0]);
                    let seen = start
                        .within_limits(&after)
                        .then(|| start.features(&after))
                        .flatten()?;
                    Some((d2, d3, (after, seen)))
                }) else {
                    break;
                };
                let Some(after) =
                    self.predict_onward(&believed, joints[Joint::J3].to_degrees(), d2, d3)
                else {
                    lost[k..].iter_mut().for_each(|runs| *runs += 1);
                    break;
                };
                believed = after;
                joints = there.0;
                y.push((believed.y - there.1.y).abs());
                r.push((believed.r - there.1.r).abs());
            }
        }
        let summed = |values: &mut Vec<f64>| {
            values.sort_by(f64::total_cmp);
            let median = values.get(values.len() / 2).copied().unwrap_or(f64::NAN);
            (values.iter().sum::<f64>() / values.len() as f64, median)
        };
        errors
            .iter_mut()
            .enumerate()
            .map(|(k, (y, r))| {
                let runs = y.len();
                let ((y_mean, y_median), (r_mean, r_median)) = (summed(y), summed(r));
                OpenLoopError {
                    moves: k + 1,
                    runs,
                    lost: lost[k],
                    y_mean,
                    r_mean,
                    y_median,
                    r_median,
                }
            })
            .collect()
    }
}
