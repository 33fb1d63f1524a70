//! The paper's controller as text: both behaviours, and everything else that choosing by them
//! takes.

use std::fmt::Write as _;

use puma_val2::{Joint, PumaParams};

use crate::behaviour::policy::Behaviour;
use crate::behaviour::policy::LOST_WEIGHT;
use crate::behaviour::preset::BehaviourPair;
use crate::controllers::learned::Learned;
use crate::error::BehaviourError;
use crate::limits::JointLimits;
use crate::record::export::{Document, Remarks, bad, check_format, rounded, text_of};

const FORMAT: &str = "grasp-agent policy 1";

/// What the JSON holds.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct Policy {
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
    "when an action is chosen its weight w becomes 2 w + 1; when the ball is lost after it, or the hand comes too near to something or to \
     the ball too fast and the move is taken back, lost_weight is added",
    "a behaviour that is at its goal makes no step and chooses nothing",
];

impl Policy {
    pub(crate) fn of(learned: &Learned, limits: &JointLimits) -> Self {
        let (centering, approaching) = learned.kappa();
        Self {
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
            centering: Document::of(learned.centering()),
            approaching: Document::of(learned.approaching()),
        }
    }

    pub(crate) fn into_learned(self) -> Result<(Learned, JointLimits), BehaviourError> {
        check_format(&self.format, FORMAT)?;
        let behaviours = [
            self.centering.into_behaviour()?,
            self.approaching.into_behaviour()?,
        ];
        assembled(self.limits_degrees, &self.loop_breaker, behaviours)
    }
}

/// The controller of its parts, if they go together.
fn assembled(
    limits_degrees: [[f64; 2]; 6],
    breaker: &LoopBreaker,
    [centering, approaching]: [Behaviour; 2],
) -> Result<(Learned, JointLimits), BehaviourError> {
    for (joint, [low, high]) in Joint::ALL.into_iter().zip(limits_degrees) {
        if !(low.is_finite() && high.is_finite() && low <= high) {
            return Err(bad(format!(
                "the limits of {joint} are {low} to {high} degrees"
            )));
        }
        // The ranges of both presets of the arm.
        let range = PumaParams::unimation().ranges[joint.index()];
        let (min, max) = (
            rounded(range.min.to_degrees()),
            rounded(range.max.to_degrees()),
        );
        if low < min || high > max {
            return Err(bad(format!(
                "the limits of {joint} are {low} to {high} degrees; its range is {min} to {max}"
            )));
        }
    }
    for kappa in [breaker.centering, breaker.approaching] {
        if !(kappa.is_finite() && kappa >= 0.0) {
            return Err(bad(format!(
                "a loop breaker is {kappa}; it must be 0 or above"
            )));
        }
    }
    if breaker.lost_weight != LOST_WEIGHT {
        return Err(bad(format!(
            "its lost_weight is {}; only {LOST_WEIGHT} can be used here",
            breaker.lost_weight
        )));
    }
    let joint_of_both = centering.spec().moves.iter().find(|steps| {
        approaching
            .spec()
            .moves
            .iter()
            .any(|s| s.joint == steps.joint)
    });
    if let Some(steps) = joint_of_both {
        return Err(bad(format!("both behaviours move {}", steps.joint)));
    }
    let limits =
        JointLimits(limits_degrees.map(|[low, high]| (low.to_radians(), high.to_radians())));
    let learned =
        Learned::new(centering, approaching).with_kappa(breaker.centering, breaker.approaching);
    Ok((learned, limits))
}

impl Learned {
    /// The controller as JSON, complete enough that another program can run it: both behaviours as
    /// [`Behaviour::to_json`] writes them, the loop breakers, and `limits`, the ranges that the
    /// joints are kept in. Learning at work is not part of it.
    pub fn to_json(&self, limits: &JointLimits) -> String {
        text_of(&Policy::of(self, limits))
    }

    /// Reads what [`Learned::to_json`] wrote, or another program in the same form: a frozen
    /// controller, and the limits, which come back to 1e-7 degrees.
    ///
    /// # Errors
    /// [`BehaviourError::Text`] for what [`Behaviour::from_json`] refuses, two behaviours that move
    /// the same joint, limits that are no ranges or wider than the arm's own
    /// ([`PumaParams::unimation`]), and loop breakers below zero or other than this one.
    pub fn from_json(text: &str) -> Result<(Self, JointLimits), BehaviourError> {
        let policy: Policy = serde_json::from_str(text).map_err(|e| bad(e.to_string()))?;
        policy.into_learned()
    }

    /// Centering and approaching as CSV tables, as [`Behaviour::to_csv`] writes them, with loop
    /// breakers and limits among the remarks before them; [`Learned::from_csv`] reads both.
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
        [
            (self.centering(), centering),
            (self.approaching(), approaching),
        ]
        .map(|(behaviour, kappa)| {
            format!("{remarks}# loop_breaker {kappa}\n{}", behaviour.to_csv())
        })
    }

    /// Reads the two tables of [`Learned::to_csv`], or another program's in the same form, for the
    /// behaviours of `pair`: a frozen controller, and the limits, which come back to 1e-7 degrees.
    /// The tables hold edges, goals and values, `pair` the rest: names and rewards.
    ///
    /// # Errors
    /// [`BehaviourError::Text`] for what [`Behaviour::from_csv`] and [`Learned::from_json`] refuse,
    /// for a remark that is missing or said twice (frame and zero of theta 3, goal, limits, loop
    /// breaker, `lost_weight`), and for limits that are not the same in both tables.
    pub fn from_csv(
        pair: BehaviourPair,
        tables: [&str; 2],
    ) -> Result<(Self, JointLimits), BehaviourError> {
        let [first, second] = tables.map(Remarks);
        let mut limits_degrees = [[0.0; 2]; 6];
        for (joint, limits) in Joint::ALL.into_iter().zip(&mut limits_degrees) {
            let what = format!("limits_degrees of {joint}: ");
            let said = first.only(&what)?;
            if second.only(&what)? != said {
                return Err(bad(format!(
                    "the limits of {joint} differ in the two tables"
                )));
            }
            let Some((low, high)) = said.split_once(" to ") else {
                return Err(bad(format!("the limits of {joint} are {said:?}")));
            };
            *limits = [number(low)?, number(high)?];
        }
        let mut breakers = [0.0; 2];
        for (remarks, kappa) in [&first, &second].into_iter().zip(&mut breakers) {
            *kappa = number(remarks.only("loop_breaker ")?)?;
        }
        let lost_weight = first.only("lost_weight ")?;
        if second.only("lost_weight ")? != lost_weight {
            return Err(bad("lost_weight differs in the two tables"));
        }
        let [centering, approaching] = breakers;
        let breaker = LoopBreaker {
            centering,
            approaching,
            lost_weight: lost_weight
                .parse()
                .map_err(|e| bad(format!("lost_weight: {e}")))?,
        };
        for remarks in [&first, &second] {
            remarks.only("frame ")?;
            if remarks.goals().next().is_none() {
                return Err(bad("there is no remark `# at the goal ...`"));
            }
        }
        let [centering, approaching] = tables;
        let behaviours = [
            Behaviour::from_csv(pair.centering, centering)?,
            Behaviour::from_csv(pair.approaching, approaching)?,
        ];
        assembled(limits_degrees, &breaker, behaviours)
    }
}

fn number(text: &str) -> Result<f64, BehaviourError> {
    text.trim()
        .parse()
        .map_err(|e| bad(format!("{text:?}: {e}")))
}

#[cfg(test)]
mod tests {
    use super::*;
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
        assert!(
            centering.contains("# loop_breaker 12.5\n")
                && approaching.contains("# loop_breaker 30\n")
        );
        for table in [&centering, &approaching] {
            assert!(
                table.contains("# limits_degrees of JT3: 120 to 215\n")
                    && table.contains("# lost_weight 50\n")
            );
        }
        let pair = BehaviourPair::paper_mended();
        assert!(
            Behaviour::from_csv(pair.centering.clone(), &centering).unwrap()
                == *learned.centering()
        );
        assert!(
            Behaviour::from_csv(pair.approaching.clone(), &approaching).unwrap()
                == *learned.approaching()
        );
        let (now, limits) = Learned::from_csv(pair, [&centering, &approaching]).unwrap();
        assert!(
            now.centering() == learned.centering() && now.approaching() == learned.approaching()
        );
        assert_eq!((now.kappa(), limits), ((12.5, 30.0), JointLimits::paper()));
        assert_eq!(now.to_csv(&limits), [centering, approaching]);
    }

    #[test]
    fn tables_that_cannot_be_run_are_refused_with_the_reason() {
        let tables = learned().to_csv(&JointLimits::paper());
        let refused = |old: &str, new: &str| {
            let [centering, approaching] = &tables;
            let changed = approaching.replace(old, new);
            assert_ne!(changed, *approaching, "{old}");
            Learned::from_csv(BehaviourPair::paper_mended(), [centering, &changed])
                .unwrap_err()
                .to_string()
        };
        let cases = [
            ("JT3: 120 to 215", "JT3: 300 to 215", "limits of JT3 differ"),
            (
                "# limits_degrees of JT5",
                "# limits of JT5",
                "limits_degrees of JT5",
            ),
            (
                "# loop_breaker 30",
                "# loop_breaker -1",
                "loop breaker is -1",
            ),
            (
                "# loop_breaker 30",
                "# loop_breaker NaN",
                "loop breaker is NaN",
            ),
            (
                "# loop_breaker 30",
                "# loop_breaker 30\n# loop_breaker 31",
                "said twice",
            ),
            (
                "# lost_weight 50",
                "# lost_weight 51",
                "lost_weight differs",
            ),
            ("# frame 192 x 144", "# frame 768 x 576", "frame"),
            (
                "theta3_zero_degrees 170",
                "theta3_zero_degrees 180",
                "JT3 = 180",
            ),
            ("# frame 192", "# size 192", "frame"),
            ("# at the goal ", "# in the goal ", "at the goal"),
            ("goal R is from 32 to 34", "goal R is from 32 to 35", "goal"),
            ("# at the goal R is from", "# in the goal R is from", "goal"),
            ("JT2+", "JT1+", "not those of the behaviour"),
        ];
        for (old, new, said) in cases {
            let refused = refused(old, new);
            assert!(refused.contains(said), "{refused} does not say {said}");
        }
        // The same change in both tables.
        let both = |old: &str, new: &str| {
            let changed = [&tables[0], &tables[1]].map(|table| table.replace(old, new));
            let read = Learned::from_csv(BehaviourPair::paper_mended(), [&changed[0], &changed[1]]);
            read.unwrap_err().to_string()
        };
        assert!(
            both("JT3: 120 to 215", "JT3: 300 to 215").contains("limits of JT3 are 300 to 215")
        );
        assert!(both("JT3: 120 to 215", "JT3: many").contains("limits of JT3 are \"many\""));
        assert!(both("lost_weight 50", "lost_weight 3").contains("lost_weight is 3"));
        let mut pair = BehaviourPair::paper_mended();
        pair.approaching.reward.terms.clear();
        let read = Learned::from_csv(pair, [&tables[0], &tables[1]]);
        assert!(read.unwrap_err().to_string().contains("no terms"));
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
