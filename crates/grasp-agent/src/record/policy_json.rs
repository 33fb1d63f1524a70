//! The paper's controller as JSON: two behaviours, their repetition penalty and the joint limits.

use puma_val2::{Joint, PumaParams};
use serde::{Deserialize, Serialize};

use crate::behaviour::policy::{Behaviour, LOST_WEIGHT};
use crate::controllers::learned::Learned;
use crate::error::BehaviourError;
use crate::limits::JointLimits;
use crate::record::behaviour_json::{BehaviourJson, bad, check_format, pretty};

const FORMAT: &str = "grasp-agent policy 1";

/// Serialized form of a [`Learned`], with the limits that it keeps the joints in where it is a
/// document of its own.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct PolicyJson {
    format: String,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    words: Vec<String>,
    /// Lowest and highest angle of each joint, `JT1` first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    limits_degrees: Option<[[f64; 2]; 6]>,
    loop_breaker: LoopBreaker,
    centering: BehaviourJson,
    approaching: BehaviourJson,
}

#[derive(Debug, Serialize, Deserialize)]
struct LoopBreaker {
    /// Repetition penalty of each behaviour, units of Q.
    centering: f64,
    approaching: f64,
    /// Weight added to an action that lost the ball.
    lost_weight: u32,
}

const WORDS: [&str; 5] = [
    "in every cycle each behaviour chooses an action by its own inputs; all joints make their \
     steps together, until both behaviours are at their goals",
    "limits_degrees: lowest and highest angle of each joint, JT1 first; actions that leave them \
     are not chosen",
    "loop_breaker: each run starts with a weight of 0 for every action of every state; the \
     behaviour's number times the weight is subtracted from the action's value",
    "choosing an action changes its weight w to 2 w + 1; lost_weight is added when the ball is \
     lost after it, or when supervision takes the move back",
    "a behaviour at its goal makes no step",
];

impl Learned {
    /// Returns the controller as JSON, complete enough for another program to run it.
    ///
    /// The object holds both behaviours as [`Behaviour::to_json`](crate::Behaviour::to_json)
    /// writes them, the repetition penalties (`loop_breaker`), and `limits`. Learning at work is
    /// left out.
    pub fn to_json(&self, limits: &JointLimits) -> String {
        let degrees = |(low, high): (f64, f64)| [low, high].map(|end| rounded(end.to_degrees()));
        pretty(&PolicyJson {
            words: WORDS.map(Into::into).into(),
            limits_degrees: Some(limits.0.map(degrees)),
            ..self.clone().into()
        })
    }

    /// Reads a controller that [`Learned::to_json`], or another program, has written.
    ///
    /// Returns the controller, frozen, and its limits, exact to 1e-7 degrees.
    ///
    /// # Errors
    /// [`BehaviourError::Text`] for anything that
    /// [`Behaviour::from_json`](crate::Behaviour::from_json) refuses, two behaviours that move the
    /// same joint, limits that are no ranges or wider than the arm's
    /// ([`PumaParams::unimation`]), negative repetition penalties, and another `lost_weight`.
    pub fn from_json(text: &str) -> Result<(Self, JointLimits), BehaviourError> {
        let policy: PolicyJson = serde_json::from_str(text).map_err(|e| bad(e.to_string()))?;
        let limits = policy.limits_degrees;
        let limits = limits_of(limits.ok_or_else(|| bad("missing field `limits_degrees`"))?)?;
        Ok((policy.try_into()?, limits))
    }
}

/// Leaves out the joint limits and learning at work.
impl From<Learned> for PolicyJson {
    fn from(learned: Learned) -> Self {
        let (centering, approaching) = learned.kappa();
        Self {
            format: FORMAT.into(),
            words: Vec::new(),
            limits_degrees: None,
            loop_breaker: LoopBreaker {
                centering,
                approaching,
                lost_weight: LOST_WEIGHT,
            },
            centering: learned.centering().into(),
            approaching: learned.approaching().into(),
        }
    }
}

impl TryFrom<PolicyJson> for Learned {
    type Error = BehaviourError;

    fn try_from(json: PolicyJson) -> Result<Self, BehaviourError> {
        check_format(&json.format, FORMAT)?;
        let breaker = json.loop_breaker;
        for kappa in [breaker.centering, breaker.approaching] {
            if kappa.is_nan() || kappa < 0.0 {
                return Err(bad(format!(
                    "a loop breaker is {kappa}, expected 0 or more"
                )));
            }
        }
        if breaker.lost_weight != LOST_WEIGHT {
            return Err(bad(format!(
                "its lost_weight is {}, expected {LOST_WEIGHT}",
                breaker.lost_weight
            )));
        }
        let centering: Behaviour = json.centering.try_into()?;
        let approaching: Behaviour = json.approaching.try_into()?;
        let others = &approaching.spec().moves;
        let mut moves = centering.spec().moves.iter();
        if let Some(steps) = moves.find(|steps| others.iter().any(|s| s.joint == steps.joint)) {
            return Err(bad(format!("both behaviours move {}", steps.joint)));
        }
        Ok(Self::new(centering, approaching).with_kappa(breaker.centering, breaker.approaching))
    }
}

/// Rounds to seven digits, to undo the way through radians.
fn rounded(degrees: f64) -> f64 {
    (degrees * 1e7).round() / 1e7
}

fn limits_of(limits_degrees: [[f64; 2]; 6]) -> Result<JointLimits, BehaviourError> {
    let arm = PumaParams::unimation();
    for (joint, [low, high]) in Joint::ALL.into_iter().zip(limits_degrees) {
        if !(low.is_finite() && high.is_finite() && low <= high) {
            return Err(bad(format!(
                "the limits of {joint} are {low} to {high} degrees"
            )));
        }
        let range = arm.ranges[joint.index()];
        let [min, max] = [range.min, range.max].map(|end| rounded(end.to_degrees()));
        if low < min || high > max {
            return Err(bad(format!(
                "the limits of {joint} are {low} to {high} degrees; its range is {min} to {max}"
            )));
        }
    }
    let radians = |[low, high]: [f64; 2]| (low.to_radians(), high.to_radians());
    Ok(JointLimits(limits_degrees.map(radians)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::behaviour::preset::BehaviourPair;
    use crate::behaviour::spec::BehaviourSpec;
    use qtable::{Action, QTable, State};

    fn learned() -> Learned {
        let taught = |spec: BehaviourSpec| {
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
    fn a_policy_comes_back_with_penalties_and_limits() {
        let (then, limits) = (learned(), JointLimits::paper());
        let (now, read) = Learned::from_json(&then.to_json(&limits)).unwrap();
        assert!(now.centering() == then.centering() && now.approaching() == then.approaching());
        assert_eq!(now.kappa(), (12.5, 30.0));
        assert_eq!(read, limits);
        // And again, to the letter.
        assert_eq!(now.to_json(&read), then.to_json(&limits));
    }

    #[test]
    fn a_policy_that_cannot_be_run_is_refused_with_the_reason() {
        type Change = fn(&mut serde_json::Value);
        let cases: [(Change, &str); 8] = [
            (|d| d["format"] = "grasp-agent policy 2".into(), "policy 2"),
            (
                |d| d["limits_degrees"][2][0] = 300.0.into(),
                "limits of JT3",
            ),
            (
                |d| d["limits_degrees"][1] = serde_json::json!([-1e9, 1e9]),
                "its range is -225 to 45",
            ),
            (
                |d| d["loop_breaker"]["centering"] = (-1.0).into(),
                "loop breaker",
            ),
            (
                |d| d["loop_breaker"]["lost_weight"] = 3.into(),
                "lost_weight is 3",
            ),
            (
                |d| d["centering"]["moves"][0]["joint"] = "J3".into(),
                "both behaviours move JT3",
            ),
            (
                |d| d["approaching"]["goal"] = serde_json::json!([]),
                "no goal",
            ),
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
            let refused = Learned::from_json(&document.to_string())
                .unwrap_err()
                .to_string();
            assert!(refused.contains(said), "{refused} does not say {said}");
        }
        assert!(Learned::from_json(&json[..json.len() / 2]).is_err());
    }
}
