//! The paper's controller as text: both behaviours, and everything else that choosing by them takes.

use std::fmt::Write as _;

use puma_val2::Joint;

use crate::behaviour::LOST_WEIGHT;
use crate::export::{Document, bad, check_format, rounded, text_of};
use crate::{BehaviourError, JointLimits, Learned};

const FORMAT: &str = "grasp-agent policy 1";

/// What the JSON holds.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
struct Policy {
    format: String,
    #[serde(default)]
    words: Vec<String>,
    /// Lowest and highest angle of each joint, `JT1` first.
    limits_degrees: [[f64; 2]; 6],
    loop_breaker: LoopBreaker,
    centering: Document,
    approaching: Document,
}

#[derive(Debug, serde::Serialize, serde::Deserialize)]
struct LoopBreaker {
    /// What choosing an action again costs, units of Q.
    centering: f64,
    approaching: f64,
    /// What is added to the weight of an action that lost the ball.
    lost_weight: u32,
}

const WORDS: [&str; 5] = [
    "in every cycle each behaviour chooses an action by its own inputs, and all joints make their steps together, until both are at their goals",
    "limits_degrees: lowest and highest angle of each joint, JT1 first; an action that leads out of them is not chosen",
    "loop_breaker: in each run every action of every state has a weight, at first 0; from its value is taken the behaviour's number times the weight",
    "when an action is chosen its weight w becomes 2 w + 1; when the ball is lost after it, lost_weight is added",
    "a behaviour that is at its goal makes no step and chooses nothing",
];

impl Learned {
    /// The controller as JSON, complete enough that another program can run it: both behaviours as [`Behaviour::to_json`] writes them, the
    /// loop breakers, and `limits`, the ranges that the joints are kept in. Learning at work is not part of it.
    ///
    /// [`Behaviour::to_json`]: crate::Behaviour::to_json
    pub fn to_json(&self, limits: &JointLimits) -> String {
        let (centering, approaching) = self.kappa();
        text_of(&Policy {
            format: FORMAT.into(),
            words: WORDS.map(Into::into).into(),
            limits_degrees: limits
                .0
                .map(|(low, high)| [low, high].map(|end| rounded(end.to_degrees()))),
            loop_breaker: LoopBreaker {
                centering,
                approaching,
                lost_weight: LOST_WEIGHT,
            },
            centering: Document::of(self.centering()),
            approaching: Document::of(self.approaching()),
        })
    }

    /// Centering and approaching as CSV tables, as [`Behaviour::to_csv`] writes them, with loop breakers and limits among the remarks before
    /// them; [`Behaviour::from_csv`] reads each, without those.
    ///
    /// [`Behaviour::to_csv`]: crate::Behaviour::to_csv
    /// [`Behaviour::from_csv`]: crate::Behaviour::from_csv
    pub fn to_csv(&self, limits: &JointLimits) -> [String; 2] {
        let mut remarks = String::new();
        for word in WORDS {
            let _ = writeln!(remarks, "# {word}");
        }
        let _ = writeln!(remarks, "# lost_weight {LOST_WEIGHT}");
        for (joint, (low, high)) in Joint::ALL.into_iter().zip(limits.0) {
            let [low, high] = [low, high].map(|end| rounded(end.to_degrees()));
            let _ = writeln!(remarks, "# limits_degrees of {joint}: {low} to {high}");
        }
        let (centering, approaching) = self.kappa();
        [(self.centering(), centering), (self.approaching(), approaching)]
            .map(|(behaviour, kappa)| format!("{remarks}# loop_breaker {kappa}\n{}", behaviour.to_csv()))
    }

    /// Reads what [`Learned::to_json`] wrote, or another program in the same form: a frozen controller, and the limits, which come back to
    /// 1e-7 degrees.
    ///
    /// # Errors
    /// [`BehaviourError::Text`] for what [`Behaviour::from_json`] refuses, two behaviours that move the same joint, limits that are no
    /// ranges, and loop breakers below zero or other than this one.
    ///
    /// [`Behaviour::from_json`]: crate::Behaviour::from_json
    pub fn from_json(text: &str) -> Result<(Self, JointLimits), BehaviourError> {
        let policy: Policy = serde_json::from_str(text).map_err(|e| bad(e.to_string()))?;
        check_format(&policy.format, FORMAT)?;
        for (joint, [low, high]) in Joint::ALL.into_iter().zip(policy.limits_degrees) {
            if !(low.is_finite() && high.is_finite() && low <= high) {
                return Err(bad(format!("the limits of {joint} are {low} to {high} degrees")));
            }
        }
        let limits = JointLimits(
            policy
                .limits_degrees
                .map(|[low, high]| (low.to_radians(), high.to_radians())),
        );
        let LoopBreaker {
            centering: of_centering,
            approaching: of_approaching,
            lost_weight,
        } = policy.loop_breaker;
        for kappa in [of_centering, of_approaching] {
            if !(kappa.is_finite() && kappa >= 0.0) {
                return Err(bad(format!("a loop breaker is {kappa}; it must be 0 or above")));
            }
        }
        if lost_weight != LOST_WEIGHT {
            return Err(bad(format!(
                "its lost_weight is {lost_weight}; only {LOST_WEIGHT} can be used here"
            )));
        }
        let centering = policy.centering.into_behaviour()?;
        let approaching = policy.approaching.into_behaviour()?;
        let joint_of_both = centering
            .spec()
            .moves
            .iter()
            .find(|steps| approaching.spec().moves.iter().any(|s| s.joint == steps.joint));
        if let Some(steps) = joint_of_both {
            return Err(bad(format!("both behaviours move {}", steps.joint)));
        }
        let learned = Self::new(centering, approaching).with_kappa(of_centering, of_approaching);
        Ok((learned, limits))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Behaviour, BehaviourPair};
    use qtable::{Action, QTable, State};

    fn learned() -> Learned {
        let taught = |spec: crate::BehaviourSpec| {
            let mut table = QTable::new(spec.states(), spec.actions()).unwrap();
            for state in 0..spec.states() {
                let action = (7 * state + 3) % spec.actions();
                table
                    .set(State(state), Action(action), 0.1 + state as f64 / 3.0)
                    .unwrap();
            }
            Behaviour::new(spec, table).unwrap()
        };
        let pair = BehaviourPair::paper_mended();
        Learned::new(taught(pair.centering), taught(pair.approaching)).with_kappa(12.5, 30.0)
    }

    #[test]
    fn a_policy_comes_back_with_loop_breakers_and_limits() {
        let (then, limits) = (learned(), JointLimits::paper());
        let (now, read) = Learned::from_json(&then.to_json(&limits)).unwrap();
        assert!(now.centering() == then.centering() && now.approaching() == then.approaching());
        assert_eq!(now.kappa(), (12.5, 30.0));
        assert_eq!(read, limits);
        // And again, to the letter.
        assert_eq!(now.to_json(&read), then.to_json(&limits));
    }

    #[test]
    fn the_tables_say_what_choosing_by_them_takes_and_come_back_equal() {
        let learned = learned();
        let [centering, approaching] = learned.to_csv(&JointLimits::paper());
        assert!(centering.contains("# loop_breaker 12.5\n") && approaching.contains("# loop_breaker 30\n"));
        for table in [&centering, &approaching] {
            assert!(
                table.contains("# limits_degrees of JT3: 120 to 215\n")
                    && table.contains("# lost_weight 50\n")
            );
        }
        let pair = BehaviourPair::paper_mended();
        assert!(Behaviour::from_csv(pair.centering, &centering).unwrap() == *learned.centering());
        assert!(Behaviour::from_csv(pair.approaching, &approaching).unwrap() == *learned.approaching());
    }

    #[test]
    fn a_policy_that_cannot_be_run_is_refused_with_the_reason() {
        type Change = fn(&mut serde_json::Value);
        let cases: [(Change, &str); 7] = [
            (|d| d["format"] = "grasp-agent policy 2".into(), "policy 2"),
            (|d| d["limits_degrees"][2][0] = 300.0.into(), "limits of JT3"),
            (|d| d["loop_breaker"]["centering"] = (-1.0).into(), "loop breaker"),
            (
                |d| d["loop_breaker"]["lost_weight"] = 3.into(),
                "lost_weight is 3",
            ),
            (
                |d| d["centering"]["moves"][0]["joint"] = "J3".into(),
                "both behaviours move JT3",
            ),
            (|d| d["approaching"]["goal"] = serde_json::json!([]), "no goal"),
            (
                |d| {
                    d["approaching"]["q"].as_array_mut().unwrap().pop();
                },
                "89x81",
            ),
        ];
        let json = learned().to_json(&JointLimits::paper());
        for (change, said) in cases {
            let mut document: serde_json::Value = serde_json::from_str(&json).unwrap();
            change(&mut document);
            let refused = Learned::from_json(&document.to_string()).unwrap_err().to_string();
            assert!(refused.contains(said), "{refused} does not say {said}");
        }
        assert!(Learned::from_json(&json[..json.len() / 2]).is_err());
    }
}
