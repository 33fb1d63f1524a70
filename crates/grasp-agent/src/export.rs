//! Learned behaviours as text, complete enough that another program can run them.

use std::fmt::Write as _;

use qtable::{Action, QTable, State};

use crate::{Behaviour, BehaviourError, BehaviourSpec};

/// Most states times actions that are read from text.
const MOST_ENTRIES: usize = 1 << 24;

impl Behaviour {
    /// The behaviour as JSON: its name; the inputs with their edges and goal intervals; the joints with their steps in degrees; the goal;
    /// the reward; and `q`, a row of values for every state.
    ///
    /// A state is a mixed-radix number of the intervals that the inputs lie in, the last input varying fastest, and an action one of the
    /// joints' steps, the last joint varying fastest. An interval is closed below and open above, but for goal intervals, which are closed at
    /// both ends. How often each pair was visited is not part of it.
    pub fn to_json(&self) -> String {
        let rows = (0..self.table().states()).map(|state| self.table().row(State(state)).to_vec());
        let document = document::Document {
            format: document::FORMAT.into(),
            spec: self.spec().clone(),
            q: rows.collect(),
        };
        // Plain data with text keys and finite numbers: there is nothing that could not be written.
        serde_json::to_string_pretty(&document).unwrap_or_default()
    }

    /// Reads what [`Behaviour::to_json`] wrote, or another program in the same form.
    ///
    /// # Errors
    /// [`BehaviourError::Text`], with the place where there is one: no JSON, a missing part, edges that do not increase, a number that is not
    /// finite, a wrong number of rows or values.
    pub fn from_json(text: &str) -> Result<Self, BehaviourError> {
        let document: document::Document = serde_json::from_str(text).map_err(|e| bad(e.to_string()))?;
        if document.format != document::FORMAT {
            return Err(bad(format!(
                "its format is {:?}; {:?} is read here",
                document.format,
                document::FORMAT
            )));
        }
        let q: Vec<&[f64]> = document.q.iter().map(Vec::as_slice).collect();
        of_rows(document.spec, &q)
    }

    /// The values as a CSV table: a column for the lower and upper end of each input's interval (empty where it has none), a column for each
    /// action, headed by its joint steps in degrees, and `best`, the number of the best action (from 0); a row for every state.
    pub fn to_csv(&self) -> String {
        let spec = self.spec();
        let mut csv = String::new();
        for input in &spec.inputs {
            let _ = write!(csv, "{input:?} from,{input:?} to,");
        }
        for action in 0..spec.actions() {
            let degrees = spec.delta(Action(action)).degrees();
            let steps: Vec<String> = spec
                .moves
                .iter()
                .map(|steps| format!("{}{:+}", steps.joint, rounded(degrees[steps.joint.index()])))
                .collect();
            let _ = write!(csv, "{},", steps.join(" "));
        }
        csv += "best\n";
        for state in (0..spec.states()).map(State) {
            for (intervals, bin) in spec.space.quantities().iter().zip(spec.space.bins(state)) {
                let (low, high) = intervals
                    .bounds(bin)
                    .unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
                for end in [low, high] {
                    let _ = if end.is_finite() {
                        write!(csv, "{end},")
                    } else {
                        write!(csv, ",")
                    };
                }
            }
            for value in self.table().row(state) {
                let _ = write!(csv, "{value},");
            }
            let _ = writeln!(csv, "{}", self.table().best(state).0);
        }
        csv
    }

    /// Reads the values of a CSV table of [`Behaviour::to_csv`] for the behaviour `spec`.
    ///
    /// # Errors
    /// [`BehaviourError::Text`], with the line: intervals or actions that are not those of `spec`, a value that is no finite number, a wrong
    /// number of lines or columns.
    pub fn from_csv(spec: BehaviourSpec, text: &str) -> Result<Self, BehaviourError> {
        let blank = Self::new(spec, blank_table(shape_of(text)?)?)?;
        let (expected, ends, actions) = (
            blank.to_csv(),
            2 * blank.spec().inputs.len(),
            blank.spec().actions(),
        );
        let mut lines = text.lines().zip(expected.lines()).enumerate();
        if let Some((_, (found, wanted))) = lines.next()
            && found.trim_end() != wanted
        {
            return Err(bad("line 1: inputs or actions are not those of the behaviour"));
        }
        let mut rows = Vec::new();
        for (number, (found, wanted)) in lines {
            let line = number + 1;
            let fields: Vec<&str> = found.trim_end().split(',').collect();
            if fields.len() != ends + actions + 1 {
                return Err(bad(format!(
                    "line {line}: {} columns where {} are needed",
                    fields.len(),
                    ends + actions + 1
                )));
            }
            if !fields[..ends].iter().copied().eq(wanted.split(',').take(ends)) {
                return Err(bad(format!(
                    "line {line}: intervals are not those of the behaviour"
                )));
            }
            let values = fields[ends..ends + actions]
                .iter()
                .map(|field| field.parse::<f64>());
            let row: Result<Vec<f64>, _> = values.collect();
            rows.push(row.map_err(|e| bad(format!("line {line}: {e}")))?);
        }
        let rows: Vec<&[f64]> = rows.iter().map(Vec::as_slice).collect();
        of_rows(blank.spec().clone(), &rows)
    }
}

/// Seven digits: the angles of the steps went to radians and back.
fn rounded(degrees: f64) -> f64 {
    (degrees * 1e7).round() / 1e7
}

fn bad(what: impl Into<String>) -> BehaviourError {
    BehaviourError::Text { what: what.into() }
}

/// States and actions that a CSV table has lines and columns for; whether they are the right ones is checked later.
fn shape_of(text: &str) -> Result<(usize, usize), BehaviourError> {
    let header = text.lines().next().ok_or_else(|| bad("there is nothing"))?;
    let actions = header.split(',').filter(|name| name.starts_with("JT")).count();
    Ok((text.lines().count().saturating_sub(1), actions))
}

fn blank_table((states, actions): (usize, usize)) -> Result<QTable, BehaviourError> {
    if states.saturating_mul(actions) > MOST_ENTRIES {
        return Err(bad(format!("{states} states x {actions} actions are too many")));
    }
    QTable::new(states, actions).map_err(|e| bad(e.to_string()))
}

/// A behaviour of rows of values.
fn of_rows(spec: BehaviourSpec, rows: &[&[f64]]) -> Result<Behaviour, BehaviourError> {
    let actions = rows.first().map_or(0, |row| row.len());
    let mut table = blank_table((rows.len(), actions))?;
    for (state, row) in rows.iter().enumerate() {
        if row.len() != actions {
            return Err(bad(format!(
                "state {state} has {} values where others have {actions}",
                row.len()
            )));
        }
        for (action, value) in row.iter().enumerate() {
            table
                .set(State(state), Action(action), *value)
                .map_err(|e| bad(e.to_string()))?;
        }
    }
    if spec.moves.iter().any(|steps| steps.degrees.is_empty()) {
        return Err(bad("a joint has no steps"));
    }
    if spec.inputs.len() != spec.space.quantities().len() {
        return Err(bad(format!(
            "there are {} inputs and intervals for {}",
            spec.inputs.len(),
            spec.space.quantities().len()
        )));
    }
    Behaviour::new(spec, table)
}

mod document {
    use super::BehaviourSpec;

    pub(super) const FORMAT: &str = "grasp-agent behaviour 1";

    /// What the JSON holds.
    #[derive(serde::Serialize, serde::Deserialize)]
    pub(super) struct Document {
        pub(super) format: String,
        #[serde(flatten)]
        pub(super) spec: BehaviourSpec,
        pub(super) q: Vec<Vec<f64>>,
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
    fn json_and_csv_come_back_equal() {
        let behaviour = behaviour();
        assert!(Behaviour::from_json(&behaviour.to_json()).unwrap() == behaviour);
        let csv = behaviour.to_csv();
        assert_eq!(csv.lines().count(), 91);
        assert!(Behaviour::from_csv(BehaviourSpec::approaching(), &csv).unwrap() == behaviour);
    }

    #[test]
    fn foreign_and_damaged_text_is_refused_with_its_place() {
        let (json, csv) = (behaviour().to_json(), behaviour().to_csv());
        for text in [
            "",
            "{}",
            &json[..json.len() / 2],
            &json.replace("grasp-agent behaviour 1", "other"),
        ] {
            assert!(
                matches!(Behaviour::from_json(text), Err(BehaviourError::Text { .. })),
                "{text:.40}"
            );
        }
        let of = |text: &str| {
            Behaviour::from_csv(BehaviourSpec::approaching(), text)
                .unwrap_err()
                .to_string()
        };
        assert!(of("").contains("nothing"));
        assert!(of(&csv.replace("JT2-20 ", "JT2-21 ")).contains("line 1"));
        let broken = csv.lines().enumerate().map(|(i, line)| {
            if i == 7 {
                line.replace('.', "?")
            } else {
                line.into()
            }
        });
        assert!(of(&broken.collect::<Vec<String>>().join("\n")).contains("line 8"));
        assert!(of(&csv.lines().take(50).collect::<Vec<_>>().join("\n")).contains("49x81"));
        let other = Behaviour::from_csv(BehaviourSpec::centering(), &csv);
        assert!(matches!(other, Err(BehaviourError::Shape { .. })));
    }
}
