//! Ranges and speeds of the joints.

use crate::error::ArmError;
use crate::joints::{Joint, Joints};

/// Range and speed of one joint.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct JointRange {
    /// Lower limit, radians.
    pub min: f64,
    /// Upper limit, radians.
    pub max: f64,
    /// Greatest speed, radians per second.
    pub speed: f64,
}

impl JointRange {
    /// Returns `true` for an angle that an emulated arm may turn to. Half an encoder count of slack
    /// lets an arm that stands at its limit move away along it.
    pub(crate) fn holds(&self, angle: f64) -> bool {
        let slack = 1e-4;
        (self.min - slack..=self.max + slack).contains(&angle)
    }
}

impl JointRange {
    /// Returns `true` for a turn that leads back towards the range from beyond it.
    pub(crate) fn inwards(&self, from: f64, to: f64) -> bool {
        from > self.max && (self.min..from).contains(&to)
            || from < self.min && to > from && to <= self.max
    }
}

/// Returns the classical ranges and speeds of the PUMA 560.
pub(crate) fn puma_560() -> [JointRange; 6] {
    [
        (-160.0, 160.0, 82.0),
        (-225.0, 45.0, 74.0),
        (-45.0, 225.0, 122.0),
        (-110.0, 170.0, 228.0),
        (-100.0, 100.0, 241.0),
        (-266.0, 266.0, 228.0),
    ]
    .map(|(min, max, speed)| in_degrees(min, max, speed))
}

/// Returns the range of a joint from degrees and degrees per second.
pub(crate) fn in_degrees(min: f64, max: f64, speed: f64) -> JointRange {
    JointRange {
        min: min.to_radians(),
        max: max.to_radians(),
        speed: speed.to_radians(),
    }
}

/// Checks that every angle is finite and within its range.
///
/// # Errors
/// [`ArmError::NotFinite`] or [`ArmError::JointLimit`] for the first joint that fails.
pub(crate) fn check(ranges: &[JointRange; 6], joints: &Joints) -> Result<(), ArmError> {
    if let Some(joint) = joints.non_finite() {
        return Err(ArmError::NotFinite { joint });
    }
    // VAL prints thousandths of a degree: an arm at its stop may report that much beyond it.
    let slack = 0.0005_f64.to_radians();
    for joint in Joint::ALL {
        let range = ranges[joint.index()];
        if joints[joint] < range.min - slack || joints[joint] > range.max + slack {
            return Err(ArmError::JointLimit {
                joint,
                wanted_degrees: joints[joint].to_degrees(),
                min_degrees: range.min.to_degrees(),
                max_degrees: range.max.to_degrees(),
            });
        }
    }
    Ok(())
}
