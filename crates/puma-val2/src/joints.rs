//! Joint angles and joint moves of a six-joint arm.

use std::fmt;
use std::ops::{Add, Index, Sub};

/// One of the six joints, waist to flange. VAL calls them `JT1` to `JT6`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[allow(missing_docs)] // Six names that say all there is.
pub enum Joint {
    J1,
    J2,
    J3,
    J4,
    J5,
    J6,
}

impl Joint {
    /// All joints, waist first.
    pub const ALL: [Self; 6] = [Self::J1, Self::J2, Self::J3, Self::J4, Self::J5, Self::J6];

    /// VAL's names, waist first.
    pub const NAMES: [&str; 6] = ["JT1", "JT2", "JT3", "JT4", "JT5", "JT6"];

    /// Returns the position in an array of six, 0 for `J1`.
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Returns VAL's number, 1 for `J1`.
    pub const fn number(self) -> usize {
        self as usize + 1
    }
}

impl fmt::Display for Joint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(Self::NAMES[self.index()])
    }
}

/// Six joint angles in radians, `JT1` first, in VAL's own convention, that of `WHERE`.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Joints(pub [f64; 6]);

impl Joints {
    /// VAL's `READY`: the arm upright, straight up from the shoulder.
    pub const READY: Self = Self([
        0.0,
        (-90.0_f64).to_radians(),
        90.0_f64.to_radians(),
        0.0,
        0.0,
        0.0,
    ]);

    /// Converts from degrees, VAL's unit.
    pub fn from_degrees(degrees: [f64; 6]) -> Self {
        Self(degrees.map(f64::to_radians))
    }

    /// Returns the angles in degrees, VAL's unit.
    pub fn degrees(&self) -> [f64; 6] {
        self.0.map(f64::to_degrees)
    }

    /// Returns the first joint whose angle is NaN or infinite, if any.
    pub fn non_finite(&self) -> Option<Joint> {
        Joint::ALL.into_iter().find(|j| !self[*j].is_finite())
    }
}

impl Index<Joint> for Joints {
    type Output = f64;

    fn index(&self, joint: Joint) -> &f64 {
        &self.0[joint.index()]
    }
}

impl fmt::Display for Joints {
    /// Formats the six angles in degrees: `(0.000, -90.000, 90.000, 0.000, 0.000, 0.000)`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b, c, d, e, g] = self.degrees();
        write!(f, "({a:.3}, {b:.3}, {c:.3}, {d:.3}, {e:.3}, {g:.3})")
    }
}

/// Relative move: the turn of each joint in radians, `JT1` first.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct JointDelta(pub [f64; 6]);

impl JointDelta {
    /// Converts from degrees.
    pub fn from_degrees(degrees: [f64; 6]) -> Self {
        Self(degrees.map(f64::to_radians))
    }

    /// Returns a move of one joint alone, by `radians`.
    pub fn of(joint: Joint, radians: f64) -> Self {
        let mut delta = [0.0; 6];
        delta[joint.index()] = radians;
        Self(delta)
    }

    /// Returns the move in degrees.
    pub fn degrees(&self) -> [f64; 6] {
        self.0.map(f64::to_degrees)
    }
}

impl Index<Joint> for JointDelta {
    type Output = f64;

    fn index(&self, joint: Joint) -> &f64 {
        &self.0[joint.index()]
    }
}

impl Add<JointDelta> for Joints {
    type Output = Joints;

    fn add(self, delta: JointDelta) -> Joints {
        Joints(std::array::from_fn(|i| self.0[i] + delta.0[i]))
    }
}

impl Sub for Joints {
    type Output = JointDelta;

    /// Returns the move that leads from `from` to `self`.
    fn sub(self, from: Joints) -> JointDelta {
        JointDelta(std::array::from_fn(|i| self.0[i] - from.0[i]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_added_back_gives_the_target() {
        let from = Joints::from_degrees([0.0, -110.0, 210.0, 0.0, 45.0, 0.0]);
        let to = Joints::from_degrees([5.0, -90.0, 194.0, 0.0, 45.0, 0.0]);
        let back = from + (to - from);
        assert!(
            Joint::ALL
                .into_iter()
                .all(|j| (back[j] - to[j]).abs() < 1e-15)
        );
    }

    #[test]
    fn a_joint_that_is_not_a_number_is_named() {
        let mut joints = Joints::default();
        assert_eq!(joints.non_finite(), None);
        joints.0[3] = f64::NAN;
        assert_eq!(joints.non_finite(), Some(Joint::J4));
    }
}
