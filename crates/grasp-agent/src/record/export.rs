//! Learned behaviours as text, complete enough that another program can run them.

use std::fmt::Write as _;

use hough_heuristic::Features;
use qtable::{Action, QTable, State};

use crate::behaviour::policy::Behaviour;
use crate::behaviour::spec::{BehaviourSpec, GoalInterval};
use crate::error::BehaviourError;
use crate::percept::THETA3_ZERO;
use crate::record::numbers::Whole;

/// Most states times actions that are read from text.
const MOST_ENTRIES: usize = 1 << 24;

impl Behaviour {
    /// The behaviour as JSON: its name; the units and conventions, with the frame's size and the
    /// zero of theta 3; the inputs with their edges and goal intervals; the joints with their steps
    /// in degrees; the goal; the reward; and `q`, a row of values for every state.
    ///
    /// A state is a mixed-radix number of the intervals that the inputs lie in, the last input
    /// varying fastest, and an action one of the joints' steps, the last joint varying fastest. An
    /// interval is closed below and open above, but for goal intervals, which are closed at both
    /// ends. How often each pair was visited is not part of it. What else a controller needs is in
    /// [`Learned::to_json`](crate::Learned::to_json).
    pub fn to_json(&self) -> String {
        text_of(&Document::of(self))
    }

    /// Reads what [`Behaviour::to_json`] wrote, or another program in the same form.
    ///
    /// # Errors
    /// [`BehaviourError::Text`], with the place where there is one: no JSON, a missing part, edges
    /// that do not increase, a number that is not finite, a wrong number of rows or values, a joint
    /// that is moved twice, no goal, another frame or zero of theta 3 than here.
    pub fn from_json(text: &str) -> Result<Self, BehaviourError> {
        let document: Document = serde_json::from_str(text).map_err(|e| bad(e.to_string()))?;
        document.into_behaviour()
    }

    /// The values as a CSV table: a column for the lower and upper end of each input's interval
    /// (empty where it has none), a column for each action, headed by its joint steps in degrees,
    /// and `best`, the number of the best action (from 0); a row for every state. Before them stand
    /// lines that begin with `#`: units, conventions and the goal.
    pub fn to_csv(&self) -> String {
        let spec = self.spec();
        let mut csv = format!("# behaviour {}\n", spec.name.replace('\n', " "));
        for line in Conventions::default().lines() {
            let _ = writeln!(csv, "# {line}");
        }
        for interval in &spec.goal {
            let _ = writeln!(csv, "# at the goal {}", goal_line(interval));
        }
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
    /// [`BehaviourError::Text`], with the line: intervals or actions that are not those of `spec`,
    /// a value that is no finite number, a wrong number of lines or columns, remarks that state
    /// another frame, zero of theta 3 or goal; and what [`Behaviour::from_json`] refuses of `spec`.
    pub fn from_csv(spec: BehaviourSpec, text: &str) -> Result<Self, BehaviourError> {
        let blank = Self::new(spec, blank_table(shape_of(text)?)?)?;
        Remarks(text).check(blank.spec())?;
        let expected = blank.to_csv();
        let (ends, actions) = (2 * blank.spec().inputs.len(), blank.spec().actions());
        let mut lines = table_lines(text).zip(table_lines(&expected));
        if let Some(((line, found), (_, wanted))) = lines.next()
            && found != wanted
        {
            return Err(bad(format!(
                "line {line}: inputs or actions are not those of the behaviour"
            )));
        }
        let mut rows = Vec::new();
        for ((line, found), (_, wanted)) in lines {
            let fields: Vec<&str> = found.split(',').collect();
            if fields.len() != ends + actions + 1 {
                return Err(bad(format!(
                    "line {line}: {} columns where {} are needed",
                    fields.len(),
                    ends + actions + 1
                )));
            }
            if !fields[..ends]
                .iter()
                .copied()
                .eq(wanted.split(',').take(ends))
            {
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

/// The remarks of a CSV table: its lines that begin with `#`.
pub(crate) struct Remarks<'a>(pub(crate) &'a str);

impl<'a> Remarks<'a> {
    /// What the remarks that begin with `what` go on with.
    fn about(&self, what: &str) -> impl Iterator<Item = &'a str> {
        let remarks = self.0.lines().filter_map(|line| line.strip_prefix("# "));
        remarks.filter_map(move |remark| remark.strip_prefix(what).map(str::trim_end))
    }

    /// What the only remark that begins with `what` goes on with.
    pub(crate) fn only(&self, what: &str) -> Result<&'a str, BehaviourError> {
        let mut about = self.about(what);
        match (about.next(), about.next()) {
            (Some(said), None) => Ok(said),
            (Some(_), Some(_)) => Err(bad(format!("`# {what}...` is said twice"))),
            (None, _) => Err(bad(format!("there is no remark `# {what}...`"))),
        }
    }

    /// The goal intervals in words.
    pub(crate) fn goals(&self) -> impl Iterator<Item = &'a str> {
        self.about("at the goal ")
            .filter(|said| said.contains(" is from "))
    }

    /// Fails if the remarks state other conventions, or another goal than that of `spec`. What they
    /// leave out is as it is here.
    fn check(&self, spec: &BehaviourSpec) -> Result<(), BehaviourError> {
        if let Some(said) = self.about("frame ").next() {
            let conventions = Conventions::of_line(said);
            conventions
                .ok_or_else(|| bad(format!("its frame is {said:?}")))?
                .check()?;
        }
        let mut goals = self.goals().peekable();
        if goals.peek().is_some() && !goals.eq(spec.goal.iter().map(goal_line)) {
            return Err(bad("its goal is not that of the behaviour"));
        }
        Ok(())
    }
}

/// A goal interval in words.
fn goal_line(GoalInterval { input, low, high }: &GoalInterval) -> String {
    format!("{input:?} is from {low} to {high}, both ends included")
}

/// The lines of a CSV table that are no remarks, with their numbers in the text, from 1.
fn table_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let lines = text
        .lines()
        .zip(1..)
        .map(|(line, number)| (number, line.trim_end()));
    lines.filter(|(_, line)| !line.starts_with('#'))
}

/// Seven digits: the angles of the steps went to radians and back.
pub(crate) fn rounded(degrees: f64) -> f64 {
    (degrees * 1e7).round() / 1e7
}

/// Plain data with text keys: there is nothing that could not be written.
pub(crate) fn text_of(document: &impl serde::Serialize) -> String {
    serde_json::to_string_pretty(&Whole(document)).unwrap_or_default()
}

/// The same in one line.
pub(crate) fn plain_text_of(document: &impl serde::Serialize) -> String {
    serde_json::to_string(&Whole(document)).unwrap_or_default()
}

pub(crate) fn bad(what: impl Into<String>) -> BehaviourError {
    BehaviourError::Text { what: what.into() }
}

/// States and actions that a CSV table has lines and columns for; whether they are the right ones
/// is checked later.
fn shape_of(text: &str) -> Result<(usize, usize), BehaviourError> {
    let mut lines = table_lines(text);
    let (_, header) = lines.next().ok_or_else(|| bad("there is nothing"))?;
    let actions = header
        .split(',')
        .filter(|name| name.starts_with("JT"))
        .count();
    Ok((lines.count(), actions))
}

fn blank_table((states, actions): (usize, usize)) -> Result<QTable, BehaviourError> {
    if states.saturating_mul(actions) > MOST_ENTRIES {
        return Err(bad(format!(
            "{states} states x {actions} actions are too many"
        )));
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
    spec.check().map_err(bad)?;
    Behaviour::new(spec, table)
}

/// What the numbers of a behaviour mean: two that a program needs, and words for who writes it.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct Conventions {
    /// Width and height of a frame in the units of x, y and r.
    frame: [f64; 2],
    /// `JT3` where theta 3 is zero.
    theta3_zero_degrees: f64,
    #[serde(default)]
    words: Vec<String>,
}

impl Default for Conventions {
    fn default() -> Self {
        let words = [
            "X, Y: centre of the ball's outline from the upper left corner of the frame, right and down; R: its radius; in units of which a frame is \
             as wide and as high as `frame` says",
            "Theta3: JT3 in degrees, as VAL II prints it, less theta3_zero_degrees",
            "an interval is closed below and open above; a goal interval is closed at both ends; the outer ones have no end",
            "states: a number for each combination of intervals, the last input varying fastest, from 0",
            "actions: a number for each combination of steps, degrees added to the joints, the last joint varying fastest, from 0",
            "at the goal nothing is to be done; elsewhere the action with the highest value is made, the first of several equal ones, among those \
             that keep every joint within its limits",
        ];
        Self {
            frame: [Features::WIDTH, Features::HEIGHT],
            theta3_zero_degrees: THETA3_ZERO,
            words: words.map(Into::into).into(),
        }
    }
}

impl Conventions {
    fn lines(&self) -> impl Iterator<Item = String> {
        let [width, height] = self.frame;
        let numbers = format!(
            "frame {width} x {height}; theta3_zero_degrees {}",
            self.theta3_zero_degrees
        );
        std::iter::once(numbers).chain(self.words.clone())
    }

    /// The numbers of the first of [`Conventions::lines`], behind the word `frame`.
    fn of_line(line: &str) -> Option<Self> {
        let (frame, zero) = line.split_once("; theta3_zero_degrees ")?;
        let (width, height) = frame.split_once(" x ")?;
        Some(Self {
            frame: [width.parse().ok()?, height.parse().ok()?],
            theta3_zero_degrees: zero.parse().ok()?,
            words: Vec::new(),
        })
    }

    /// Numbers with other conventions than these mean something else.
    fn check(&self) -> Result<(), BehaviourError> {
        let ours = Self::default();
        let differs = |a: f64, b: f64| a.is_nan() || (a - b).abs() > 1e-9;
        if differs(self.frame[0], ours.frame[0]) || differs(self.frame[1], ours.frame[1]) {
            return Err(bad(format!(
                "its frame is {:?} where {:?} is used here; scale x, y and r",
                self.frame, ours.frame
            )));
        }
        if differs(self.theta3_zero_degrees, ours.theta3_zero_degrees) {
            return Err(bad(format!(
                "its theta 3 is zero at JT3 = {} degrees, which is {} here; shift its edges",
                self.theta3_zero_degrees, ours.theta3_zero_degrees
            )));
        }
        Ok(())
    }
}

const FORMAT: &str = "grasp-agent behaviour 1";

/// What the JSON holds.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct Document {
    format: String,
    conventions: Conventions,
    #[serde(flatten)]
    spec: BehaviourSpec,
    q: Vec<Vec<f64>>,
}

impl Document {
    pub(crate) fn of(behaviour: &Behaviour) -> Self {
        let table = behaviour.table();
        Self {
            format: FORMAT.into(),
            conventions: Conventions::default(),
            spec: behaviour.spec().clone(),
            q: (0..table.states())
                .map(|state| table.row(State(state)).to_vec())
                .collect(),
        }
    }

    pub(crate) fn into_behaviour(self) -> Result<Behaviour, BehaviourError> {
        check_format(&self.format, FORMAT)?;
        self.conventions.check()?;
        let q: Vec<&[f64]> = self.q.iter().map(Vec::as_slice).collect();
        of_rows(self.spec, &q)
    }
}

pub(crate) fn check_format(found: &str, wanted: &str) -> Result<(), BehaviourError> {
    if found == wanted {
        Ok(())
    } else {
        Err(bad(format!(
            "its format is {found:?}; {wanted:?} is read here"
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
    fn json_and_csv_come_back_equal() {
        let behaviour = behaviour();
        assert!(Behaviour::from_json(&behaviour.to_json()).unwrap() == behaviour);
        let csv = behaviour.to_csv();
        assert_eq!(
            csv.lines().filter(|line| !line.starts_with('#')).count(),
            91
        );
        assert!(csv.contains("# frame 192 x 144; theta3_zero_degrees 170\n"));
        assert!(csv.contains("# at the goal R is from 32 to 34, both ends included\n"));
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
        let header = csv.lines().take_while(|line| line.starts_with('#')).count() + 1;
        let refused = of(&csv.replace("JT2-20 ", "JT2-21 "));
        assert!(refused.contains(&format!("line {header}:")), "{refused}");
        let broken = csv.lines().enumerate().map(|(i, line)| {
            if i == header + 6 {
                line.replace('.', "?")
            } else {
                line.into()
            }
        });
        let refused = of(&broken.collect::<Vec<String>>().join("\n"));
        assert!(
            refused.contains(&format!("line {}:", header + 7)),
            "{refused}"
        );
        let cut = csv.lines().take(header + 49).collect::<Vec<_>>().join("\n");
        assert!(of(&cut).contains("49x81"));
        let other = Behaviour::from_csv(BehaviourSpec::centering(), &csv);
        assert!(matches!(other, Err(BehaviourError::Shape { .. })));
    }
    #[test]
    fn what_no_program_could_run_is_refused_with_the_reason() {
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
                |d| d["conventions"]["theta3_zero_degrees"] = 180.0.into(),
                "JT3 = 180",
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
        // Numbers that JSON has no words for come through other formats.
        let mut spec = BehaviourSpec::approaching();
        spec.reward.terms[0].weight = f64::NAN;
        assert!(
            Behaviour::from_csv(spec, &behaviour().to_csv())
                .unwrap_err()
                .to_string()
                .contains("reward")
        );
    }
}
