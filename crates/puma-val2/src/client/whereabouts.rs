//! The reply to `WHERE`.

use std::f64::consts::PI;

use crate::joints::Joints;
use crate::kinematics::frames::Frames;
use crate::kinematics::params::PumaParams;
use crate::kinematics::xyzoat::Xyzoat;

/// Position of the arm: its joints, and the hand in the world frame with the controller's own tool
/// and base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Location {
    /// Joint angles.
    pub joints: Joints,
    /// Pose of the hand.
    pub hand: Xyzoat,
}

impl Location {
    /// Parses the reply to `WHERE`, whose two headings may come in either order. Without headings,
    /// numbers are counted from the end: six joint angles, before them six numbers of a heading,
    /// before them X Y Z O A T. Returns `None` if neither fits.
    pub fn parse(reply: &str) -> Option<Self> {
        Self::by_headings(reply).or_else(|| {
            let has_heading = reply
                .split(['\r', '\n'])
                .any(|l| is_joint_heading(l) || is_hand_heading(l));
            if has_heading {
                None
            } else {
                Self::from_the_end(reply)
            }
        })
    }

    fn by_headings(reply: &str) -> Option<Self> {
        let (mut joints, mut hand) = (None, None);
        let mut lines = reply.split(['\r', '\n']).filter(|l| !l.trim().is_empty());
        while let Some(line) = lines.next() {
            if is_joint_heading(line) {
                joints = Some(six_numbers(lines.next()?)?);
            } else if is_hand_heading(line) {
                hand = Some(six_numbers(lines.next()?)?);
            }
        }
        Some(Self {
            joints: Joints::from_degrees(joints?),
            hand: Xyzoat::from_val(hand?),
        })
    }

    fn from_the_end(reply: &str) -> Option<Self> {
        let is_part = |c: char| c.is_ascii_digit() || c == '.' || c == '-';
        let numbers: Vec<f64> = reply
            .split(|c| !is_part(c))
            .filter_map(|word| word.parse().ok())
            .collect();
        let from_end = |skip: usize| -> Option<[f64; 6]> {
            let end = numbers.len().checked_sub(skip)?;
            numbers.get(end.checked_sub(6)?..end)?.try_into().ok()
        };
        Some(Self {
            joints: Joints::from_degrees(from_end(0)?),
            hand: Xyzoat::from_val(from_end(12)?),
        })
    }

    /// Returns `true` if the two halves belong together for an arm with this tool and base, within
    /// 0.1 mm and 0.01 degrees: a check against characters that changed on the line.
    ///
    /// The hand does not show a turn of 360 degrees. Angles far out of range, or at 180 degrees,
    /// where a sign makes a turn, are therefore never accepted at once.
    pub(crate) fn agrees(&self, arm: &PumaParams, frames: &Frames) -> bool {
        let certain = self.joints.0.iter().zip(arm.ranges).all(|(angle, range)| {
            let in_range = (range.min - 0.1..=range.max + 0.1).contains(angle);
            in_range && (angle.abs() - PI).abs() > 1e-3
        });
        let (by_joints, by_hand) = (frames.hand(arm, &self.joints), self.hand.pose());
        let off = (by_joints.translation.vector - by_hand.translation.vector).norm();
        let turned = by_joints.rotation.angle_to(&by_hand.rotation);
        certain && off < 1e-4 && turned < 0.01_f64.to_radians()
    }
}

impl Location {
    /// Returns two explanations of the pose: a tool without a base, and a base without a tool.
    pub(crate) fn explanations(&self, arm: &PumaParams) -> [Frames; 2] {
        let (flange, hand) = (arm.forward(&self.joints), self.hand.pose());
        let tool = Frames {
            tool: flange.inverse() * hand,
            ..Frames::default()
        };
        let base = Frames {
            base: hand * flange.inverse(),
            ..Frames::default()
        };
        [tool, base]
    }
}

/// Returns `true` for a heading of joints: `JT1 JT2 .. JT6`, `J1 .. J6` and the like.
fn is_joint_heading(line: &str) -> bool {
    let words: Vec<&str> = line.split_whitespace().collect();
    words.len() >= 6
        && words.iter().take(6).zip(1..).all(|(word, number)| {
            let upper = word.to_ascii_uppercase();
            upper.starts_with('J') && upper.ends_with(&number.to_string()) && upper.len() <= 7
        })
}

/// Returns `true` for the heading `X Y Z O A T`, possibly with units in brackets or further
/// columns.
fn is_hand_heading(line: &str) -> bool {
    let mut words = line.split_whitespace();
    "XYZOAT".chars().all(|letter| {
        words.next().is_some_and(|word| {
            let mut characters = word.chars();
            characters
                .next()
                .is_some_and(|c| c.eq_ignore_ascii_case(&letter))
                && characters.next().is_none_or(|c| c == '[' || c == '(')
        })
    })
}

/// Returns the first six numbers of a line that holds nothing but numbers.
fn six_numbers(line: &str) -> Option<[f64; 6]> {
    let numbers: Vec<f64> = line.split_whitespace().map(number).collect::<Option<_>>()?;
    numbers.get(..6)?.try_into().ok()
}

/// Parses a number as controllers print it: no exponent, no words.
fn number(word: &str) -> Option<f64> {
    let plain = word
        .bytes()
        .all(|b| b.is_ascii_digit() || b == b'.' || b == b'-' || b == b'+');
    let value: f64 = plain.then(|| word.parse().ok())??;
    (value.abs() < 1e6).then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    const REPLY: &str = "WHERE\r
     X        Y        Z        O        A        T\r
   -20.32   149.09   921.12   90.000  -90.000    0.000\r
    JT1      JT2      JT3      JT4      JT5      JT6\r
    0.000  -90.000   90.000    0.000    0.000    0.000\r
.";

    #[test]
    fn headings_lead_to_the_numbers_in_any_order() {
        let location = Location::parse(REPLY).unwrap();
        assert_eq!(location.joints, Joints::READY);
        assert!((location.hand.x + 0.02032).abs() < 1e-12);
        assert!(location.agrees(&PumaParams::unimation(), &Frames::default()));
        let swapped = "wh\r\n\r\n J1 J2 J3 J4 J5 J6\r\n\r\n 0 -90.0 90 0 0 0\r\n \
             X[mm] Y[mm] Z[mm] O[deg] A[deg] T[deg] HAND\r\n \
             -20.32 149.09 921.12 90 -90 0 50.00\r\n.";
        assert_eq!(Location::parse(swapped), Some(location));
    }

    #[test]
    fn without_headings_the_end_counts() {
        let reply = "-20.32 149.09 921.12 90.000 -90.000 0.000\r\n#1 #2 #3 #4 #5 #6\r\n\
             0.000 -90.000 90.000 0.000 0.000 0.000\r\n.";
        assert_eq!(Location::parse(reply), Location::parse(REPLY));
    }

    #[test]
    fn a_damaged_reply_is_none_or_does_not_agree() {
        assert_eq!(Location::parse(&REPLY.replace("921.12", "92#.12")), None);
        assert_eq!(
            Location::parse(&REPLY.replace("    0.000\r\n.", "\r\n.")),
            None
        );
        let flipped = Location::parse(&REPLY.replace("    0.000\r\n.", "    2.000\r\n.")).unwrap();
        assert!(!flipped.agrees(&PumaParams::unimation(), &Frames::default()));
    }
}
