//! Working limits: the ranges that a task keeps the joints in, and its longest steps.

use puma_val2::{Arm, Joint, JointDelta, Joints, Kinematics};
use serde::{Deserialize, Serialize};

/// Range that a task keeps each joint in, radians (low, high), `JT1` first; both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointLimits(pub [(f64, f64); 6]);

impl JointLimits {
    /// Largest turns of `JT1` to `JT3` in one move of the paper's behaviours (section 3.1),
    /// radians: 5, 20 and 16 degrees.
    pub const PAPER_STEPS: [f64; 3] =
        [5_f64.to_radians(), 20_f64.to_radians(), 16_f64.to_radians()];

    /// Limits of the reaching task, degrees (low, high), `JT1` first.
    pub const PAPER_DEGREES: [(f64, f64); 6] = [
        (-160.0, 160.0),
        (-150.0, -20.0),
        (120.0, 215.0),
        (-110.0, 170.0),
        (-100.0, 100.0),
        (-266.0, 266.0),
    ];

    /// Returns the limits of the reaching task, [`JointLimits::PAPER_DEGREES`].
    pub fn paper() -> Self {
        Self(Self::PAPER_DEGREES.map(|(low, high)| (low.to_radians(), high.to_radians())))
    }

    /// Returns the largest share of `delta`, up to `most`, that leads from `from` to a pose within
    /// the limits; 0 from a pose outside them.
    pub(crate) fn share_within(&self, from: &Joints, delta: &JointDelta, most: f64) -> f64 {
        let shares = Joint::ALL.into_iter().map(|joint| {
            let (low, high) = self.0[joint.index()];
            let turn = delta[joint];
            let way = if turn > 0.0 {
                high - from[joint]
            } else {
                from[joint] - low
            };
            match way / turn.abs() {
                _ if turn == 0.0 => most,
                // `min` turns NaN into a number.
                share if share.is_nan() => 0.0,
                share => share,
            }
        });
        shares.fold(most, f64::min).max(0.0)
    }

    /// Checks that every range is one.
    pub(crate) fn check(&self, name: impl Fn(Joint) -> String) -> Result<(), String> {
        for (joint, (low, high)) in Joint::ALL.into_iter().zip(self.0) {
            if !(low.is_finite() && high.is_finite() && low <= high) {
                let name = name(joint);
                return Err(format!("the limits of {name} are {low} to {high} radians"));
            }
        }
        Ok(())
    }

    /// Returns `true` if every joint is in its range, to a millionth of a degree.
    pub fn admit(&self, joints: &Joints) -> bool {
        const SLACK: f64 = 2e-8;
        self.0
            .iter()
            .zip(joints.0)
            .all(|(&(low, high), angle)| (low - SLACK..=high + SLACK).contains(&angle))
    }

    /// Returns the pose nearest to `joints` in which every joint is in its range; NaN stays NaN.
    pub fn nearest(&self, joints: &Joints) -> Joints {
        Joints(std::array::from_fn(|i| {
            let (low, high) = self.0[i];
            // Not `clamp`, which panics on a range that is none, nor `min` and `max`, which turn
            // NaN into a number.
            match joints.0[i] {
                angle if angle < low => low,
                angle if angle > high => high,
                angle => angle,
            }
        }))
    }

    /// Shortens `wanted` (`JT1` to `JT3`, radians) until no joint turns farther than `most` allows,
    /// keeping its direction; joints that would leave their range from `joints` stop at its end.
    ///
    /// Returns a move of NaN, which no limits admit, if `wanted` is not finite or a step is NaN.
    pub fn step(&self, joints: &Joints, wanted: [f64; 3], most: &[f64; 3]) -> JointDelta {
        let shares = wanted
            .iter()
            .zip(most)
            .map(|(wanted, most)| most / wanted.abs());
        // `min` turns NaN into a number.
        let known = wanted.iter().all(|v| v.is_finite()) && !most.iter().any(|v| v.is_nan());
        let share = if known {
            shares.fold(1.0, f64::min)
        } else {
            f64::NAN
        };
        let mut target = *joints;
        for (i, wanted) in wanted.into_iter().enumerate() {
            target.0[i] += share * wanted;
        }
        let reached = self.nearest(&target);
        JointDelta(std::array::from_fn(|i| {
            if i < 3 {
                reached.0[i] - joints.0[i]
            } else {
                0.0
            }
        }))
    }
}

/// Checks the longest steps of a continuous controller, `JT1` first.
pub(crate) fn check_steps(steps: &[f64; 3], arm: &Arm) -> Result<(), String> {
    let mut steps = arm.names().into_iter().zip(steps);
    steps.try_for_each(|(name, most)| {
        crate::checked::above_zero(&format!("the longest step of {name}"), *most)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_keep_their_direction_and_end_within_the_limits() {
        let (at, limits) = (
            Joints::from_degrees([0.0, -26.0, 180.0, 0.0, 45.0, 0.0]),
            JointLimits::paper(),
        );
        let wanted = [10.0_f64, 16.0, -3.0].map(f64::to_radians);
        let delta = limits
            .step(&at, wanted, &JointLimits::PAPER_STEPS)
            .degrees();
        let expected = [5.0, 6.0, -1.5, 0.0, 0.0, 0.0];
        let close = delta
            .iter()
            .zip(expected)
            .all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(close, "{delta:?}");
        assert!(limits.nearest(&Joints([f64::NAN; 6])).0[0].is_nan());
        let (nan, turn) = (f64::NAN, 0.01);
        for (steps, wanted) in [
            (JointLimits::PAPER_STEPS, [nan, turn, turn]),
            (JointLimits::PAPER_STEPS, [f64::INFINITY, turn, turn]),
            ([nan, 1.0, 1.0], [turn; 3]),
        ] {
            let delta = limits.step(&at, wanted, &steps);
            assert!(!limits.admit(&(at + delta)), "{wanted:?}: {delta:?}");
        }
    }

    #[test]
    fn limits_that_are_no_numbers_leave_no_share_of_a_move() {
        let (limits, lift) = (JointLimits::paper(), JointDelta::of(Joint::J2, -0.2));
        let at = Joints::from_degrees([0.0, -100.0, 200.0, 0.0, 45.0, 0.0]);
        assert!((limits.share_within(&at, &lift, 1.0) - 1.0).abs() < 1e-12);
        let mut none = limits;
        none.0[1].0 = f64::NAN;
        assert!(none.share_within(&at, &lift, 1.0).abs() < 1e-12);
    }
}
