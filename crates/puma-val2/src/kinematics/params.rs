//! The arm as data: link lengths, joint ranges, joint speeds.

use crate::error::ArmError;
use crate::joints::{Joint, Joints};
use crate::limits::{self, JointRange};

/// Geometry and limits of a PUMA, in VAL's joint angles.
///
/// Standard Denavit–Hartenberg rows (alpha, a, d) of VAL's description (Fu, Gonzalez, Lee,
/// *Robotics*, 1987): (-90, 0, 0), (0, `a2`, `d2`), (+90, `a3`, 0), (-90, 0, `d4`), (+90, 0, 0),
/// (0, 0, `d6`). The base frame is VAL's world frame: its origin is the intersection of the axes of
/// `JT1` and `JT2`, z points up, and at `JT1` = 0 the arm reaches along +x with the upper arm
/// displaced by `d2` to +y.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PumaParams {
    /// Upper arm, metres.
    pub a2: f64,
    /// Elbow offset, metres.
    pub a3: f64,
    /// Lateral offset of the arm's plane from the waist axis, metres.
    pub d2: f64,
    /// Forearm, metres.
    pub d4: f64,
    /// Wrist centre to flange, metres.
    pub d6: f64,
    /// Range and speed of each joint.
    pub ranges: [JointRange; 6],
}

impl PumaParams {
    /// Returns the lengths used with VAL itself (431.8, -20.32, 149.09, 433.07, 56.25 mm).
    ///
    /// Joint ranges are the classical ones of Fu, Gonzalez, Lee (-160..160, -225..45, -45..225,
    /// -110..170, -100..100, -266..266 degrees); sources disagree about joints 2 to 4. The speeds
    /// (82, 74, 122, 228, 241, 228 degrees per second) are the commonly quoted ones and are not
    /// confirmed by a primary source.
    pub fn unimation() -> Self {
        Self {
            a2: 0.4318,
            a3: -0.02032,
            d2: 0.14909,
            d4: 0.43307,
            d6: 0.05625,
            ranges: limits::puma_560(),
        }
    }

    /// Returns the lengths of Corke and Armstrong-Hélouvry (431.8, -20.3, 150.05, 431.8 mm, no
    /// flange), which the Robotics Toolbox uses.
    pub fn corke() -> Self {
        Self {
            a2: 0.4318,
            a3: -0.0203,
            d2: 0.15005,
            d4: 0.4318,
            d6: 0.0,
            ranges: limits::puma_560(),
        }
    }

    /// Returns the lengths of a course model of the PUMA 260 (203.2, 0, 127.0, 203.2, 63.5 mm), and
    /// the ranges of the General Robotics Toolbox, which calls its model approximate (-159..159,
    /// -256..76, -34..214, -289..289, -122..122, -267..267 degrees). Other models have 124.5 mm for
    /// the lateral offset and 55.9 mm for the flange. Of joints 1, 4 and 6 only the width of the
    /// range is known: it is laid evenly about zero.
    ///
    /// No source gives the joint speeds, degrees per second: take them from your arm.
    pub fn puma_260(speeds: [f64; 6]) -> Self {
        let ranges = [
            (-159.0, 159.0),
            (-256.0, 76.0),
            (-34.0, 214.0),
            (-289.0, 289.0),
            (-122.0, 122.0),
            (-267.0, 267.0),
        ];
        Self {
            a2: 0.2032,
            a3: 0.0,
            d2: 0.127,
            d4: 0.2032,
            d6: 0.0635,
            ranges: limits::with_speeds(ranges, speeds),
        }
    }

    /// Returns the lengths of public models of the PUMA 762 (650, 0, 190, 600 mm; the flange is
    /// not known and 0) and the ranges of the 700 series (-160..160, -200..20, -45..225, -266..266,
    /// -100..100, -266..266 degrees).
    ///
    /// No source gives the joint speeds, degrees per second: take them from your arm.
    pub fn puma_762(speeds: [f64; 6]) -> Self {
        let ranges = [
            (-160.0, 160.0),
            (-200.0, 20.0),
            (-45.0, 225.0),
            (-266.0, 266.0),
            (-100.0, 100.0),
            (-266.0, 266.0),
        ];
        Self {
            a2: 0.65,
            a3: 0.0,
            d2: 0.19,
            d4: 0.6,
            d6: 0.0,
            ranges: limits::with_speeds(ranges, speeds),
        }
    }

    /// Returns the arm of this number: `260`, `560` or `762`. The speeds of all are those of the
    /// 560, since none are known of the others.
    #[cfg(feature = "cli")]
    pub(crate) fn numbered(number: &str) -> Option<Self> {
        match number {
            "260" => Some(Self::puma_260(limits::SPEEDS_560)),
            "560" => Some(Self::unimation()),
            "762" => Some(Self::puma_762(limits::SPEEDS_560)),
            _ => None,
        }
    }

    /// Returns the distance of the wrist centre ahead of the shoulder in the arm's plane, metres.
    /// It is negative for a right arm.
    pub(crate) fn wrist_ahead(&self, joints: &Joints) -> f64 {
        let [_, t2, t3, ..] = joints.0;
        self.d4 * (t2 + t3).sin() + self.a3 * (t2 + t3).cos() + self.a2 * t2.cos()
    }

    /// Returns the lever of the forearm about the line of the upper arm, metres. It is zero for a
    /// straight elbow.
    pub(crate) fn elbow_lever(&self, joints: &Joints) -> f64 {
        let t3 = joints.0[2];
        self.d4 * t3.cos() - self.a3 * t3.sin()
    }

    /// Checks that every angle is finite and within its range.
    ///
    /// # Errors
    /// [`ArmError::NotFinite`] or [`ArmError::JointLimit`] for the first joint that fails.
    pub fn check(&self, joints: &Joints) -> Result<(), ArmError> {
        limits::check(&self.ranges, Joint::NAMES, joints)
    }
}
