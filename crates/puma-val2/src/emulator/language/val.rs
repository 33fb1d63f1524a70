//! The forms of VAL, the language of 1980, in the words of VAL II.

/// Writes what follows a word of VAL; `None` for a form that VAL II has too.
type Form = fn(&str) -> Option<String>;

const FORMS: [(&str, Form); 18] = [
    ("APPROI", |rest| Some(format!("APPRO {rest}"))),
    ("DPOINT", |rest| Some(format!("DELETEL {rest}"))),
    ("ERASE", |rest| Some(format!("FORMAT {rest}"))),
    ("FRAME", frame),
    ("GO", |rest| Some(format!("MOVE {rest}"))),
    ("GOSUB", |rest| Some(format!("CALL {rest}"))),
    ("IF", jump),
    ("IFSIG", signals),
    ("INVERSE", |rest| {
        let (name, of) = rest.split_once('=')?;
        Some(format!("SET {name}=INVERSE({of})"))
    }),
    ("LISTF", |rest| Some(format!("FDIRECTORY {rest}"))),
    ("MOVEI", |rest| Some(format!("MOVE {rest}"))),
    ("PAUSE", |rest| quoted("PAUSE", rest)),
    ("REMARK", |rest| Some(format!(";{rest}"))),
    ("SETI", |rest| {
        let (name, value) = rest.split_once('=')?;
        Some(format!("{name}=INT({value})"))
    }),
    ("SHIFT", |rest| {
        let (name, _) = rest.split_once(|c: char| c.is_whitespace())?;
        Some(format!("SET {name}=SHIFT({rest})"))
    }),
    ("STOP", |rest| quoted("STOP", rest)),
    ("TYPE", |rest| quoted("TYPE", rest)),
    ("TYPEI", |rest| Some(format!("TYPE \"{rest} =\",{rest}"))),
];

/// Returns a line of VAL in the words of VAL II, or the line itself if it needs none. A label and
/// the monitor's `DO` stay in front.
pub(crate) fn translated(line: &str) -> String {
    let line = line.trim_start();
    let lead = line.len() - line.trim_start_matches(|c: char| c.is_ascii_digit()).len();
    let mut start = line.len() - line[lead..].trim_start().len();
    let is_do = |word: &str| word.eq_ignore_ascii_case("DO");
    if let Some((word, rest)) = line[start..].split_once(' ')
        && is_do(word)
    {
        start = line.len() - rest.trim_start().len();
    }
    let (front, form) = line.split_at(start);
    let (word, rest) = match form.find(|c: char| !c.is_ascii_alphanumeric()) {
        Some(end) => form.split_at(end),
        None => (form, ""),
    };
    let rest = rest.trim();
    let found = FORMS
        .iter()
        .find(|(name, _)| word.eq_ignore_ascii_case(name));
    // An assignment to a variable of the same name is none of the forms.
    let assigns = rest.starts_with('=');
    let said = found.filter(|_| !assigns).and_then(|(_, say)| say(rest));
    said.map_or_else(|| line.to_owned(), |said| format!("{front}{said}"))
}

/// Puts text that is not quoted into quotes.
fn quoted(word: &str, rest: &str) -> Option<String> {
    let plain = !rest.is_empty() && !rest.contains('"') && !rest.starts_with('/');
    plain.then(|| format!("{word} \"{rest}\""))
}

/// Converts `IF a EQ b THEN 10`; `THEN` without a label stays.
fn jump(rest: &str) -> Option<String> {
    let (condition, label) = split_then(rest)?;
    Some(format!("IF {condition} GOTO {label}"))
}

/// Converts `IFSIG 1,,-3 THEN 10`.
fn signals(rest: &str) -> Option<String> {
    let (signals, label) = split_then(rest)?;
    let given: Vec<&str> = signals
        .split(',')
        .map(str::trim)
        .filter(|s| !s.is_empty())
        .collect();
    Some(format!("IF SIG({}) GOTO {label}", given.join(",")))
}

/// Splits at the last `THEN` that has a label behind it.
fn split_then(rest: &str) -> Option<(&str, &str)> {
    let at = rest.to_ascii_uppercase().rfind(" THEN ")?;
    let label = rest[at + 6..].trim();
    label
        .starts_with(|c: char| c.is_ascii_digit())
        .then_some((&rest[..at], label))
}

/// Converts `FRAME F = A,B,C`, with the origin at the first location unless a fourth is given.
fn frame(rest: &str) -> Option<String> {
    let (name, of) = rest.split_once('=')?;
    let of: Vec<&str> = of.split(',').collect();
    let origin = of.get(3).or(of.first())?;
    let three = of.get(..3)?.join(",");
    Some(format!("SET {name}=FRAME({three},{origin})"))
}
