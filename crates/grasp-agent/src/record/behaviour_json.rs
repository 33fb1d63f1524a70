//! A learned behaviour as JSON, complete enough for another program to run it.

use hough_heuristic::Features;
use qtable::{Action, QTable, State};
use serde::{Deserialize, Serialize};

use crate::behaviour::policy::Behaviour;
use crate::behaviour::spec::BehaviourSpec;
use crate::error::BehaviourError;
use crate::percept::Percept;

/// Largest table that is read: states times actions.
const MOST_ENTRIES: usize = 1 << 24;

const FORMAT: &str = "grasp-agent behaviour 1";

impl Behaviour {
    /// Returns the behaviour as JSON.
    ///
    /// The object holds the format, the conventions (units, frame size, zero of theta 3), the
    /// specification (inputs with their edges, joints with their steps in degrees, goal, reward)
    /// and `q`, one row of action values per state. States and actions are mixed-radix numbers
    /// whose last input or joint varies fastest. Visit counts are left out.
    /// [`Learned::to_json`](crate::Learned::to_json) writes a whole controller.
    pub fn to_json(&self) -> String {
        pretty(&BehaviourJson::from(self))
    }

    /// Reads a behaviour that [`Behaviour::to_json`], or another program, has written.
    ///
    /// # Errors
    /// [`BehaviourError::Text`] names the fault and its place: text that is not JSON, a missing
    /// part, edges that do not increase, a wrong number of rows or values, a joint that is moved
    /// twice, no goal, another frame size.
    pub fn from_json(text: &str) -> Result<Self, BehaviourError> {
        let json: BehaviourJson = serde_json::from_str(text).map_err(|e| bad(e.to_string()))?;
        json.try_into()
    }
}

/// Serialized form of a [`Behaviour`].
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct BehaviourJson {
    format: String,
    conventions: Conventions,
    #[serde(flatten)]
    spec: BehaviourSpec,
    q: Vec<Vec<f64>>,
}

impl From<&Behaviour> for BehaviourJson {
    fn from(behaviour: &Behaviour) -> Self {
        let table = behaviour.table();
        let rows = (0..table.states()).map(|state| table.row(State(state)).to_vec());
        Self {
            format: FORMAT.into(),
            conventions: Conventions {
                theta3_zero_degrees: behaviour.spec().theta3_zero,
                ..Conventions::default()
            },
            spec: behaviour.spec().clone(),
            q: rows.collect(),
        }
    }
}

impl TryFrom<BehaviourJson> for Behaviour {
    type Error = BehaviourError;

    fn try_from(json: BehaviourJson) -> Result<Self, BehaviourError> {
        check_format(&json.format, FORMAT)?;
        json.conventions.check()?;
        let spec = BehaviourSpec {
            theta3_zero: json.conventions.theta3_zero_degrees,
            ..json.spec
        };
        Self::new(spec, table_of(&json.q)?)
    }
}

/// Builds a table from one row of action values per state.
fn table_of(rows: &[Vec<f64>]) -> Result<QTable, BehaviourError> {
    let (states, actions) = (rows.len(), rows.first().map_or(0, Vec::len));
    if states.saturating_mul(actions) > MOST_ENTRIES {
        return Err(bad(format!(
            "{states} states x {actions} actions exceed the limit of {MOST_ENTRIES} entries"
        )));
    }
    let mut table = QTable::new(states, actions).map_err(|e| bad(e.to_string()))?;
    for (state, row) in rows.iter().enumerate() {
        if row.len() != actions {
            return Err(bad(format!(
                "state {state} has {} values, state 0 has {actions}",
                row.len()
            )));
        }
        for (action, value) in row.iter().enumerate() {
            let set = table.set(State(state), Action(action), *value);
            set.map_err(|e| bad(e.to_string()))?;
        }
    }
    Ok(table)
}

/// Units of a behaviour's numbers: two values for programs, sentences for people.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Conventions {
    /// Width and height of a frame in the units of x, y and r.
    frame: [f64; 2],
    /// `JT3` at which theta 3 is zero, degrees.
    theta3_zero_degrees: f64,
    #[serde(default)]
    words: Vec<String>,
}

impl Default for Conventions {
    fn default() -> Self {
        let words = [
            "X, Y: centre of the ball's outline, measured right and down from the upper left \
             corner of the frame; R: its radius; `frame` gives the frame's width and height in \
             the same units",
            "Theta3: JT3 in degrees, as VAL II prints it, minus theta3_zero_degrees",
            "intervals include their lower end and exclude their upper end; goal intervals \
             include both; the outermost intervals are unbounded",
            "state: index of the combination of intervals, from 0, last input varying fastest",
            "action: index of the combination of joint steps, from 0, last joint varying fastest; \
             steps are degrees added to the joints",
            "at the goal no step is made; elsewhere the action of highest value is chosen among \
             those that keep every joint within its limits, the first one of equals",
        ];
        Self {
            frame: [Features::WIDTH, Features::HEIGHT],
            theta3_zero_degrees: Percept::THETA3_ZERO,
            words: words.map(Into::into).into(),
        }
    }
}

impl Conventions {
    /// Fails for numbers in other units than this crate's.
    fn check(&self) -> Result<(), BehaviourError> {
        let ours = Self::default();
        let differs = |a: f64, b: f64| a.is_nan() || (a - b).abs() > 1e-9;
        if differs(self.frame[0], ours.frame[0]) || differs(self.frame[1], ours.frame[1]) {
            return Err(bad(format!(
                "its frame is {:?} units, expected {:?}: scale x, y and r",
                self.frame, ours.frame
            )));
        }
        Ok(())
    }
}

/// Returns indented JSON. The documents here have text keys only, so writing cannot fail.
pub(crate) fn pretty(document: &impl Serialize) -> String {
    serde_json::to_string_pretty(document).unwrap_or_default()
}

pub(crate) fn bad(what: impl Into<String>) -> BehaviourError {
    BehaviourError::Text { what: what.into() }
}

/// Fails for a document of another format, naming an earlier version of this one.
pub(crate) fn check_format(found: &str, wanted: &str) -> Result<(), BehaviourError> {
    let version = |format: &str| -> Option<u32> { format.rsplit(' ').next()?.parse().ok() };
    let name = |format: &str| format.rsplit_once(' ').map(|(name, _)| name.to_owned());
    if found == wanted {
        Ok(())
    } else if name(found) == name(wanted) && version(found) < version(wanted) {
        Err(bad(format!(
            "made by an earlier version: its format is {found:?}, this version reads {wanted:?}"
        )))
    } else {
        Err(bad(format!(
            "its format is {found:?}, this version reads {wanted:?}"
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn behaviour() -> Behaviour {
        let spec = BehaviourSpec::approaching();
        let mut table = QTable::new(spec.states(), spec.actions()).unwrap();
        for state in 0..90 {
            for action in 0..81 {
                let value = f64::from(state as u32) * 0.1 - 1.0 / (1.0 + f64::from(action as u32));
                table.set(State(state), Action(action), value).unwrap();
            }
        }
        Behaviour::new(spec, table).unwrap()
    }

    #[test]
    fn a_behaviour_comes_back_equal() {
        let behaviour = behaviour();
        assert!(Behaviour::from_json(&behaviour.to_json()).unwrap() == behaviour);
    }

    #[test]
    fn foreign_and_damaged_text_is_refused() {
        let json = behaviour().to_json();
        let other = json.replace("grasp-agent behaviour 1", "other");
        let earlier = json.replace("grasp-agent behaviour 1", "grasp-agent behaviour 0");
        let cases = [
            ("", "EOF"),
            ("{}", "missing field"),
            (&json[..json.len() / 2], "EOF"),
            (&other, "its format is"),
            (&earlier, "made by an earlier version"),
        ];
        for (text, said) in cases {
            let refused = Behaviour::from_json(text).unwrap_err().to_string();
            assert!(refused.contains(said), "{refused} does not say {said}");
        }
    }

    #[test]
    fn behaviours_that_cannot_run_are_refused_with_the_reason() {
        let json = behaviour().to_json();
        // A change of the document, and what is said of it.
        type Change = fn(&mut serde_json::Value);
        let cases: [(Change, &str); 11] = [
            (
                |d| d["moves"][1]["joint"] = "J2".into(),
                "JT2 is moved twice",
            ),
            (
                |d| d["moves"][0]["degrees"] = serde_json::json!([]),
                "JT2 has no steps",
            ),
            (|d| d["moves"] = serde_json::json!([]), "moves no joint"),
            (|d| d["goal"] = serde_json::json!([]), "no goal"),
            (|d| d["goal"][0]["low"] = 90.0.into(), "goal of Y"),
            (|d| d["reward"]["goal"] = serde_json::Value::Null, "null"),
            (|d| d["reward"]["floor"] = (-1.0).into(), "floor"),
            (|d| d["reward"]["terms"] = serde_json::json!([]), "no terms"),
            (|d| d["inputs"] = serde_json::json!(["Y", "R"]), "2 inputs"),
            (
                |d| d["theta3_range"] = serde_json::json!([1.0, -1.0]),
                "from 1 to -1",
            ),
            (|d| d["conventions"]["frame"][0] = 768.0.into(), "768"),
        ];
        for (change, said) in cases {
            let mut document: serde_json::Value = serde_json::from_str(&json).unwrap();
            change(&mut document);
            let refused = Behaviour::from_json(&document.to_string())
                .unwrap_err()
                .to_string();
            assert!(refused.contains(said), "{refused} does not say {said}");
        }
    }
}
