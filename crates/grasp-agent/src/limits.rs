//! Ranges that a task keeps the joints in, and the longest steps.

use puma_val2::{Joint, JointDelta, Joints};

#[cfg(feature = "serde")]
use crate::checked::above_zero;
use crate::checked::checked;

/// The range that a task keeps each joint in, radians (low, high), `JT1` first; closed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(remote = "Self")
)]
pub struct JointLimits(pub [(f64, f64); 6]);

checked!(JointLimits);

impl JointLimits {
    /// The reaching task's: -160..160, -150..-20, 120..215, -110..170, -100..100, -266..266
    /// degrees.
    pub fn paper() -> Self {
        Self(
            [
                (-160.0_f64, 160.0_f64),
                (-150.0, -20.0),
                (120.0, 215.0),
                (-110.0, 170.0),
                (-100.0, 100.0),
                (-266.0, 266.0),
            ]
            .map(|(low, high)| (low.to_radians(), high.to_radians())),
        )
    }

    /// Whether they are ranges; if not, why.
    pub(crate) fn check(&self) -> Result<(), String> {
        for (joint, (low, high)) in Joint::ALL.into_iter().zip(self.0) {
            if !(low.is_finite() && high.is_finite() && low <= high) {
                return Err(format!("the limits of {joint} are {low} to {high} radians"));
            }
        }
        Ok(())
    }

    /// Whether every joint is in its range, to a millionth of a degree.
    pub fn admit(&self, joints: &Joints) -> bool {
        const SLACK: f64 = 2e-8;
        self.0
            .iter()
            .zip(joints.0)
            .all(|(&(low, high), angle)| (low - SLACK..=high + SLACK).contains(&angle))
    }

    /// The pose nearest to `joints` in which every joint is in its range; NaN stays NaN.
    pub fn nearest(&self, joints: &Joints) -> Joints {
        Joints(std::array::from_fn(|i| {
            let (low, high) = self.0[i];
            // Not `clamp`, which panics on a range that is none, nor `min` and `max`, which make a
            // number of NaN.
            match joints.0[i] {
                angle if angle < low => low,
                angle if angle > high => high,
                angle => angle,
            }
        }))
    }
}

/// The farthest that a continuous controller turns each joint in one cycle, radians, `JT1` first.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(remote = "Self")
)]
pub struct StepLimits(pub [f64; 3]);

checked!(StepLimits);

impl StepLimits {
    /// The largest steps of the paper's behaviours (section 3.1): 5, 20 and 16 degrees.
    pub fn paper() -> Self {
        Self([5.0_f64, 20.0, 16.0].map(f64::to_radians))
    }

    /// Whether they are steps; if not, why.
    #[cfg(feature = "serde")]
    pub(crate) fn check(&self) -> Result<(), String> {
        let steps = Joint::ALL.into_iter().zip(self.0);
        steps
            .into_iter()
            .try_for_each(|(joint, most)| above_zero(&format!("the longest step of {joint}"), most))
    }

    /// The longest move in the direction of `wanted` (JT1, JT2, JT3, radians), no longer than that,
    /// in which no joint turns farther than it may; joints that would leave `limits` stop there. Of
    /// what is not finite, or steps that are NaN, a move that is NaN, which no limits admit.
    pub fn apply(&self, wanted: [f64; 3], joints: &Joints, limits: &JointLimits) -> JointDelta {
        let shares = wanted
            .iter()
            .zip(self.0)
            .map(|(wanted, most)| most / wanted.abs());
        // `min` makes a number of NaN.
        let known = wanted.iter().all(|v| v.is_finite()) && !self.0.iter().any(|v| v.is_nan());
        let share = if known {
            shares.fold(1.0, f64::min)
        } else {
            f64::NAN
        };
        let mut target = *joints;
        for (i, wanted) in wanted.into_iter().enumerate() {
            target.0[i] += share * wanted;
        }
        let reached = limits.nearest(&target);
        JointDelta(std::array::from_fn(|i| {
            if i < 3 {
                reached.0[i] - joints.0[i]
            } else {
                0.0
            }
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_keep_their_direction_and_end_within_the_limits() {
        let at = Joints::from_degrees([0.0, -26.0, 180.0, 0.0, 45.0, 0.0]);
        let wanted = [10.0_f64, 16.0, -3.0].map(f64::to_radians);
        let delta = StepLimits::paper()
            .apply(wanted, &at, &JointLimits::paper())
            .degrees();
        let expected = [5.0, 6.0, -1.5, 0.0, 0.0, 0.0];
        assert!(
            delta
                .iter()
                .zip(expected)
                .all(|(a, b)| (a - b).abs() < 1e-9),
            "{delta:?}"
        );
        assert!(JointLimits::paper().nearest(&Joints([f64::NAN; 6])).0[0].is_nan());
        let (nan, turn) = (f64::NAN, 0.01);
        for (steps, wanted) in [
            (StepLimits::paper(), [nan, turn, turn]),
            (StepLimits::paper(), [f64::INFINITY, turn, turn]),
            (StepLimits([nan, 1.0, 1.0]), [turn; 3]),
        ] {
            let delta = steps.apply(wanted, &at, &JointLimits::paper());
            assert!(
                !JointLimits::paper().admit(&(at + delta)),
                "{wanted:?}: {delta:?}"
            );
        }
    }
}
