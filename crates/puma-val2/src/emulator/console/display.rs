//! Numbers and blocks as the controller prints them.

use crate::emulator::language::place::Place;
use crate::emulator::profile::Profile;
use crate::joints::Joints;
use crate::kinematics::xyzoat::Xyzoat;
use crate::manipulator::Gripper;

/// Formats a fixed-point number, right-aligned, never `-0.000`.
pub(crate) fn number(value: f64, width: usize, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let is_zero = text.starts_with('-') && text.bytes().all(|b| matches!(b, b'-' | b'0' | b'.'));
    let text = if is_zero { &text[1..] } else { &text };
    // A column too narrow for its number still keeps it apart from the one before.
    if text.len() >= width {
        format!(" {text}")
    } else {
        format!("{text:>width$}")
    }
}

/// Formats a real for `TYPE` and `LISTR`: whole numbers plain, others with up to four decimals.
pub(crate) fn plain(value: f64) -> String {
    let text = format!("{value:.4}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" {
        "0".into()
    } else {
        text.into()
    }
}

/// Formats a real with all its digits, for `LISTR`.
pub(crate) fn exact(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        size if (1e-4..1e15).contains(&size) => value.to_string(),
        _ => format!("{value:e}"),
    }
}

/// Rounds the angles of a pose to the digits of the display. An angle of -180 degrees is one of
/// 180, and where the tool axis is shown as vertical the whole turn about it is O: what is shown is
/// shown again when it is typed.
fn rounded(values: [f64; 6], profile: &Profile) -> [f64; 6] {
    let digits = 10_f64.powi(profile.angle_decimals.min(9) as i32);
    let [x, y, z, o, a, t] = values;
    let is_vertical = (90.0 - a.abs()) * digits <= 0.5;
    // A pose whose tool axis is vertical to the last bit.
    let upright = |a: f64| Xyzoat::from_pose(&Xyzoat::from_val([0.0, 0.0, 0.0, o, a, t]).pose());
    let (o, t) = if is_vertical {
        (upright(90.0_f64.copysign(a)).o.to_degrees(), 0.0)
    } else {
        (o, t)
    };
    let turn = |v: f64| {
        if (v * digits).round() <= -180.0 * digits {
            v + 360.0
        } else {
            v
        }
    };
    [x, y, z, turn(o), a, turn(t)]
}

/// Places a word over the middle of a column of numbers.
fn above(word: &str, width: usize) -> String {
    let before = (width.saturating_sub(word.len()) + 2) / 2;
    let text = format!(" {:>1$}{word}", "", before.saturating_sub(1));
    format!("{text:<width$}")
}

/// Returns the two blocks of `WHERE`, each a heading and a line of values.
pub(crate) fn whereabouts(
    joints: &Joints,
    hand: &Xyzoat,
    gripper: Gripper,
    profile: &Profile,
) -> Vec<String> {
    let width = profile.width;
    let heading = |words: [String; 6]| words.map(|w| above(&w, width)).concat();
    let mut cartesian_heading = heading(["X", "Y", "Z", "O", "A", "T"].map(String::from));
    let values = rounded(hand.val(), profile);
    let mut cartesian: String = (0..6)
        .map(|i| {
            let decimals = if i < 3 {
                profile.length_decimals
            } else {
                profile.angle_decimals
            };
            number(values[i], width, decimals)
        })
        .collect();
    if profile.hand_column {
        cartesian_heading.push_str(&above("HAND", width));
        let opening = if gripper == Gripper::Open { 50.0 } else { 0.0 };
        cartesian.push_str(&number(opening, width, profile.length_decimals));
    }
    let joint_heading = heading(std::array::from_fn(|i| {
        format!("{}{}", profile.joint_heading, i + 1)
    }));
    let joint_line: String = joints
        .degrees()
        .map(|v| number(v, width, profile.angle_decimals))
        .concat();
    let [cartesian_heading, joint_heading] =
        [cartesian_heading, joint_heading].map(|h| h.trim_end().to_owned());
    if profile.joints_first {
        vec![joint_heading, joint_line, cartesian_heading, cartesian]
    } else {
        vec![cartesian_heading, cartesian, joint_heading, joint_line]
    }
}

/// Returns the heading of `HERE`, `POINT` and `LISTL` for locations of either kind.
pub(crate) fn place_heading(profile: &Profile) -> String {
    let width = profile.width + 1;
    ["X/JT1", "Y/JT2", "Z/JT3", "O/JT4", "A/JT5", "T/JT6"]
        .map(|w| format!("{w:>width$}"))
        .concat()
}

/// Returns the six values of a location, to be printed below [`place_heading`].
pub(crate) fn place_values(place: &Place, profile: &Profile) -> String {
    let lengths = matches!(place, Place::Transformation(_));
    let values = if lengths {
        rounded(place.val(), profile)
    } else {
        place.val()
    };
    (0..6)
        .map(|i| {
            let decimals = if lengths && i < 3 {
                profile.length_decimals
            } else {
                profile.angle_decimals
            };
            number(values[i], profile.width + 1, decimals)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zero_has_no_sign() {
        assert_eq!(number(-0.0004, 9, 3), "    0.000");
        assert_eq!(number(-0.0006, 9, 3), "   -0.001");
        assert_eq!(number(-12345.678, 5, 3), " -12345.678");
        assert_eq!(plain(-0.00001), "0");
        assert_eq!(plain(2.5), "2.5");
    }
}
