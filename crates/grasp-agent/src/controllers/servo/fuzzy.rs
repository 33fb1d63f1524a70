//! A fuzzy controller by a table of rules, without a model.

use hough_heuristic::Features;
use nalgebra::Vector3;

/// Peaks of the triangular sets of an error in x or y, feature units: far below, below, right,
/// above, far above. The outer two go on as shoulders.
const ERRORS: [f64; 5] = [-60.0, -20.0, 0.0, 20.0, 60.0];
/// Peaks of the sets of the distance, over that at the goal: near, right, far, very far.
const DISTANCES: [f64; 4] = [0.6, 1.0, 1.8, 3.2];

/// Turns of `JT1`, degrees, for each set of the error in x and of the distance.
const JT1: [[f64; 4]; 5] = [
    [-2.5, -4.5, -7.0, -12.0],
    [-0.5, -1.0, -2.0, -4.0],
    [0.0, 0.0, 0.0, 0.0],
    [0.5, 1.0, 1.5, 3.0],
    [2.5, 4.5, 7.0, 12.0],
];
/// Turns of `JT2`, degrees, for each set of the error in y and of the distance.
const JT2: [[f64; 4]; 5] = [
    [-8.0, -2.0, 8.0, 46.0],
    [-6.0, -1.0, 11.0, 47.0],
    [-4.5, 0.0, 13.0, 49.0],
    [-5.0, 1.0, 14.0, 51.0],
    [-4.0, 2.0, 20.0, 54.0],
];
/// Turns of `JT3`, degrees, for each set of the error in y and of the distance.
const JT3: [[f64; 4]; 5] = [
    [4.5, 5.0, 6.0, -9.0],
    [4.0, 1.5, 0.5, -18.0],
    [2.0, 0.0, -3.0, -21.0],
    [2.0, -1.5, -5.0, -28.0],
    [-3.0, -4.5, -13.0, -35.0],
];

/// Returns the turns of `JT1` to `JT3` at gain 1 by the 20 rules of each joint: Sugeno's inference
/// of order 0 with the product as conjunction.
///
/// A ball that is far beside its place in x is not approached: the more x is *far below* or *far
/// above*, the less the rules of `JT2` and `JT3` act.
pub(crate) fn turns(goal: &Features, seen: &Features) -> Option<Vector3<f64>> {
    let x = degrees(&ERRORS, goal.x - seen.x);
    let y = degrees(&ERRORS, goal.y - seen.y);
    let distance = degrees(&DISTANCES, goal.r / seen.r);
    let infer = |rules: &[[f64; 4]; 5], error: &[f64; 5]| -> f64 {
        let rule = |(row, degree): (&[f64; 4], &f64)| {
            let turns: f64 = row.iter().zip(&distance).map(|(turn, d)| turn * d).sum();
            degree * turns
        };
        rules.iter().zip(error).map(rule).sum::<f64>().to_radians()
    };
    let beside = 1.0 - 0.8 * (x[0] + x[4]);
    let turns = Vector3::new(
        infer(&JT1, &x),
        beside * infer(&JT2, &y),
        beside * infer(&JT3, &y),
    );
    turns.iter().all(|turn| turn.is_finite()).then_some(turns)
}

/// Returns the degree to which a value belongs to each of the triangular sets with these peaks,
/// ascending; the sum is 1.
fn degrees<const N: usize>(peaks: &[f64; N], value: f64) -> [f64; N] {
    let value = value.clamp(peaks[0], peaks[N - 1]);
    std::array::from_fn(|i| {
        let from = |other: usize| (value - peaks[other]) / (peaks[i] - peaks[other]);
        if value >= peaks[i] && i + 1 < N {
            from(i + 1).max(0.0)
        } else if i > 0 {
            from(i - 1).clamp(0.0, 1.0)
        } else {
            1.0
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn degrees_of_membership_add_up_to_one_and_peak_at_their_sets() {
        for value in [-90.0, -60.0, -41.0, -3.0, 0.0, 12.5, 60.0, 61.0] {
            let degrees = degrees(&ERRORS, value);
            let sum: f64 = degrees.iter().sum();
            assert!((sum - 1.0).abs() < 1e-12, "{value}: {degrees:?}");
        }
        assert!((degrees(&ERRORS, 20.0)[3] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_ball_at_the_goal_asks_for_no_turn() {
        let goal = Features::new(103.5, 78.0, 33.0);
        assert_eq!(turns(&goal, &goal), Some(Vector3::zeros()));
    }
}
