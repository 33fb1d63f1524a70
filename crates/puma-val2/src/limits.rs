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

/// Joint speeds of the PUMA 560, degrees per second.
pub(crate) const SPEEDS_560: [f64; 6] = [82.0, 74.0, 122.0, 228.0, 241.0, 228.0];

/// Returns the classical ranges and speeds of the PUMA 560.
pub(crate) fn puma_560() -> [JointRange; 6] {
    let ranges = [
        (-160.0, 160.0),
        (-225.0, 45.0),
        (-45.0, 225.0),
        (-110.0, 170.0),
        (-100.0, 100.0),
        (-266.0, 266.0),
    ];
    with_speeds(ranges, SPEEDS_560)
}

/// Returns the ranges of the joints from degrees and degrees per second.
pub(crate) fn with_speeds(ranges: [(f64, f64); 6], speeds: [f64; 6]) -> [JointRange; 6] {
    std::array::from_fn(|i| JointRange {
        min: ranges[i].0.to_radians(),
        max: ranges[i].1.to_radians(),
        speed: speeds[i].to_radians(),
    })
}

/// Checks that every angle is finite and within its range.
///
/// # Errors
/// [`ArmError::NotFinite`] or [`ArmError::JointLimit`] for the first joint that fails.
pub(crate) fn check(
    ranges: &[JointRange; 6],
    names: [&str; 6],
    joints: &Joints,
) -> Result<(), ArmError> {
    if let Some(joint) = joints.non_finite() {
        let name = names[joint.index()].into();
        return Err(ArmError::NotFinite { joint, name });
    }
    // VAL prints thousandths of a degree: an arm at its stop may report that much beyond it.
    let slack = 0.0005_f64.to_radians();
    for joint in Joint::ALL {
        let range = ranges[joint.index()];
        if joints[joint] < range.min - slack || joints[joint] > range.max + slack {
            return Err(ArmError::JointLimit {
                joint,
                name: names[joint.index()].into(),
                wanted_degrees: joints[joint].to_degrees(),
                min_degrees: range.min.to_degrees(),
                max_degrees: range.max.to_degrees(),
            });
        }
    }
    Ok(())
}
