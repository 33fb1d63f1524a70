//! The reward module (section 3.2 of the paper, Eq. 5 and 6).

use serde::{Deserialize, Serialize};

use crate::percept::{Input, Percept};

/// A reward of the paper's form, as data.
///
/// Arriving at the goal pays `goal`, losing the ball pays `lost`. Any other step pays the sum of
/// `weight / |value - target|` over all terms if at least one of them came closer to its target,
/// and nothing otherwise. With one term (x, 100, 103) this is Eq. 5, with the two terms (y, 20, 78)
/// and (r, 50, 33) it is Eq. 6.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reward {
    /// Pay for arriving at the goal (default 100).
    pub goal: f64,
    /// Pay for losing the ball (default -100).
    pub lost: f64,
    /// Terms that pay for coming closer.
    pub terms: Vec<RewardTerm>,
    /// Least denominator of a term, in the units of its input (default 1; 0 in the paper's formulas
    /// as printed).
    ///
    /// At 0 the reward grows without bound near a target, and is infinite on it.
    pub floor: f64,
    /// `true` if the goal is absorbing: once reached, it is kept (default; `false` in the paper's
    /// formulas as printed).
    ///
    /// A goal that only ends the episode is worth 100, and near it, going away and coming back pays
    /// more than that. An absorbing goal pays 100 at every step to come, 100 / (1 - gamma) in all.
    pub absorbing: bool,
}

/// One term of a [`Reward`]: `weight / |input - target|`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RewardTerm {
    /// Quantity that should come closer.
    pub input: Input,
    /// Pay at a distance of 1.
    pub weight: f64,
    /// Value that the quantity should reach.
    pub target: f64,
}

impl RewardTerm {
    const fn new(input: Input, weight: f64, target: f64) -> Self {
        Self {
            input,
            weight,
            target,
        }
    }

    fn distance(&self, percept: &Percept) -> f64 {
        (self.input.of(percept) - self.target).abs()
    }
}

impl Reward {
    /// Returns Eq. 5 of the paper as printed.
    pub fn centering_literal() -> Self {
        Self::literal([RewardTerm::new(Input::X, 100.0, 103.0)])
    }

    /// Returns Eq. 6 of the paper as printed.
    pub fn approaching_literal() -> Self {
        Self::literal([
            RewardTerm::new(Input::Y, 20.0, 78.0),
            RewardTerm::new(Input::R, 50.0, 33.0),
        ])
    }

    fn literal<const N: usize>(terms: [RewardTerm; N]) -> Self {
        Self {
            goal: 100.0,
            lost: -100.0,
            terms: terms.into(),
            floor: 0.0,
            absorbing: false,
        }
    }

    /// Applies the two mends without which the reward does not teach the goal: denominators of at
    /// least 1, and an absorbing goal.
    #[must_use]
    pub fn mended(self) -> Self {
        Self {
            floor: 1.0,
            absorbing: true,
            ..self
        }
    }

    pub(crate) fn check(&self) -> Result<(), String> {
        let of_terms = self
            .terms
            .iter()
            .flat_map(|term| [term.weight, term.target]);
        if let Some(number) = of_terms
            .chain([self.goal, self.lost, self.floor])
            .find(|number| !number.is_finite())
        {
            return Err(format!("its reward has {number} in it"));
        }
        if self.floor < 0.0 {
            return Err(format!(
                "the floor of its reward is {}, below 0",
                self.floor
            ));
        }
        if self.terms.is_empty() {
            return Err("its reward has no terms: nothing pays for coming closer".into());
        }
        Ok(())
    }

    /// Returns the value of arriving at the goal under the discount factor `gamma`.
    pub fn arrival(&self, gamma: f64) -> f64 {
        if self.absorbing {
            self.goal / (1.0 - gamma)
        } else {
            self.goal
        }
    }

    /// Returns the pay for a step from `before` to `after`, neither of them lost or at the goal.
    pub fn step(&self, before: &Percept, after: &Percept) -> f64 {
        let closer = |term: &RewardTerm| term.distance(after) < term.distance(before);
        if self.terms.iter().any(closer) {
            self.terms
                .iter()
                .map(|term| term.weight / term.distance(after).max(self.floor))
                .sum()
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hough_heuristic::Features;

    fn percept(x: f64, y: f64, r: f64) -> Percept {
        Percept {
            features: Features::new(x, y, r),
            theta3: 0.0,
        }
    }

    #[test]
    fn equation_5_pays_for_coming_closer_only() {
        let reward = Reward::centering_literal();
        let near = |x| percept(x, 0.0, 0.0);
        assert!((reward.step(&near(60.0), &near(78.0)) - 4.0).abs() < 1e-12);
        assert!(reward.step(&near(78.0), &near(60.0)).abs() < 1e-12);
        assert!(reward.step(&near(78.0), &near(78.0)).abs() < 1e-12);
    }

    #[test]
    fn equation_6_pays_both_terms_when_either_comes_closer() {
        let reward = Reward::approaching_literal();
        let pays = reward.step(&percept(0.0, 40.0, 20.0), &percept(0.0, 38.0, 23.0));
        assert!((pays - (20.0 / 40.0 + 50.0 / 10.0)).abs() < 1e-12);
        let away = reward.step(&percept(0.0, 40.0, 20.0), &percept(0.0, 30.0, 10.0));
        assert!(away.abs() < 1e-12);
    }

    #[test]
    fn the_literal_reward_has_poles_and_the_mended_one_has_none() {
        let (before, on_target) = (percept(0.0, 60.0, 20.0), percept(0.0, 78.0, 20.0));
        let literal = Reward::approaching_literal();
        assert!(literal.step(&before, &on_target).is_infinite());
        let mended = literal.mended();
        assert!((mended.step(&before, &on_target) - (20.0 + 50.0 / 13.0)).abs() < 1e-12);
        assert!((mended.arrival(0.9) - 1000.0).abs() < 1e-9);
    }
}
