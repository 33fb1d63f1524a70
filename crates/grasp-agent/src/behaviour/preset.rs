//! Pairs of behaviours: the paper's, and a finer one.

use qtable::Error;
use serde::{Deserialize, Serialize};

use crate::behaviour::reward::Reward;
use crate::behaviour::spec::{BehaviourSpec, GoalInterval};

/// The two behaviours of a [`Learned`](crate::Learned) controller, as data.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BehaviourPair {
    /// Turns `JT1` by x and r.
    pub centering: BehaviourSpec,
    /// Turns `JT2` and `JT3` by y, r and theta 3.
    pub approaching: BehaviourSpec,
}

impl BehaviourPair {
    /// Returns the paper's behaviours as printed: 42 states by 9 actions, 90 by 81, and the rewards
    /// of Eq. 5 and 6, which do not teach the goal (see [`Reward`]).
    pub fn paper_literal() -> Self {
        Self {
            centering: BehaviourSpec::centering().with_reward(Reward::centering_literal()),
            approaching: BehaviourSpec::approaching().with_reward(Reward::approaching_literal()),
        }
    }

    /// Returns the paper's behaviours with the mends of [`Reward::mended`].
    pub fn paper_mended() -> Self {
        Self {
            centering: BehaviourSpec::centering(),
            approaching: BehaviourSpec::approaching(),
        }
    }

    /// Returns [`BehaviourPair::paper_mended`] with [`BehaviourSpec::approaching_fine`]: 540
    /// states, and a lost ball that stays lost.
    pub fn fine() -> Self {
        Self {
            approaching: BehaviourSpec::approaching_fine(),
            ..Self::paper_mended()
        }
    }

    /// Returns the pair with another goal interval of y for approaching.
    ///
    /// # Errors
    /// Ends that are not finite or not in order.
    pub fn with_y_goal(self, goal: GoalInterval) -> Result<Self, Error> {
        Ok(Self {
            approaching: self.approaching.with_y_goal(goal)?,
            ..self
        })
    }

    /// Returns the goal of both behaviours, for [`AgentConfig::goal`](crate::AgentConfig::goal).
    pub fn goal(&self) -> Vec<GoalInterval> {
        [&self.centering, &self.approaching]
            .into_iter()
            .flat_map(|spec| spec.goal.iter().copied())
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::percept::Input;
    use crate::run::config::AgentConfig;
    use crate::sight::camera_model::CameraModel;
    use hough_heuristic::Features;
    use puma_val2::Joints;

    #[test]
    fn the_presets_differ_in_what_their_names_say() {
        let [literal, mended, fine] = [
            BehaviourPair::paper_literal(),
            BehaviourPair::paper_mended(),
            BehaviourPair::fine(),
        ];
        for (pair, states) in [(&literal, 90), (&mended, 90), (&fine, 540)] {
            assert_eq!((pair.centering.states(), pair.centering.actions()), (42, 9));
            assert_eq!(
                (pair.approaching.states(), pair.approaching.actions()),
                (states, 81)
            );
        }
        assert!(!literal.approaching.reward.absorbing && mended.approaching.reward.absorbing);
        assert_eq!(literal.approaching.space, mended.approaching.space);
        let lost = mended.approaching.reward.lost;
        assert_eq!(
            fine.approaching.reward,
            Reward {
                lost: 10.0 * lost,
                ..mended.approaching.reward
            }
        );
    }

    /// From the gripper to the ball after the paper's turn of the fifth joint, at the worst place
    /// of the goal, metres.
    fn worst_miss(goal: GoalInterval) -> f64 {
        let model = CameraModel::paper();
        let GoalInterval { low, high, .. } = goal;
        let mut worst: f64 = 0.0;
        for (x, y, r) in [99.0, 108.0]
            .into_iter()
            .flat_map(|x| [low, high].map(|y| (x, y)))
            .flat_map(|(x, y)| [32.0, 34.0].map(|r| (x, y, r)))
        {
            let pose = |jt5| Joints::from_degrees([0.0, -53.0, 186.2, 0.0, jt5, 0.0]);
            let ball = model.locate(&pose(45.0), &Features::new(x, y, r)).unwrap();
            worst = worst.max((model.tool_point(&pose(45.0 - 18.01)) - ball).norm());
        }
        worst
    }

    #[test]
    fn the_gripper_comes_nearer_with_the_narrower_goal() {
        let (narrow, wide) = (
            worst_miss(GoalInterval::Y),
            worst_miss(GoalInterval::Y_SECTION_4),
        );
        assert!(narrow < 0.0065, "{narrow}");
        assert!((0.0100..0.0110).contains(&wide), "{wide}");
    }

    #[test]
    fn both_goals_of_y_fit_every_preset_and_the_agent() {
        for pair in [
            BehaviourPair::paper_literal(),
            BehaviourPair::paper_mended(),
            BehaviourPair::fine(),
        ] {
            let states = pair.approaching.states();
            for goal in [GoalInterval::Y, GoalInterval::Y_SECTION_4] {
                let pair = pair.clone().with_y_goal(goal).unwrap();
                assert!(pair.approaching.states() <= states);
                let of_y: Vec<_> = pair
                    .goal()
                    .into_iter()
                    .filter(|i| i.input == Input::Y)
                    .collect();
                assert_eq!(of_y, [goal]);
            }
        }
        let config = AgentConfig::paper([Joints::default()]);
        assert_eq!(BehaviourPair::paper_mended().goal(), config.goal);
    }
}
