//! Motors, gears and encoders.

use std::f64::consts::TAU;

use crate::joints::Joints;

/// Gears, encoders and wrist coupling: the way from motor shafts to joint angles.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DriveTrain {
    /// Motor turns for one turn of the joint.
    pub gear: [f64; 6],
    /// Encoder counts per motor turn.
    pub counts_per_motor_turn: [f64; 6],
    /// Turns of the joint `JT5` for each turn of `JT4` with the other motors at rest.
    pub coupling_4_to_5: f64,
    /// Turns of `JT6` for each turn of `JT4`.
    pub coupling_4_to_6: f64,
    /// Turns of `JT6` for each turn of `JT5`.
    pub coupling_5_to_6: f64,
}

impl DriveTrain {
    /// Returns the drive train of the PUMA 560.
    ///
    /// Gears as in the Robotics Toolbox (Corke and Armstrong-Hélouvry), except joint 2, where the
    /// scale factors of a Trident Robotics controller and the comp.robotics FAQ agree on 107.36
    /// instead of 107.815. Counts per motor turn are the spacing of the index pulses in the
    /// calibration table of a real arm. The wrist coupling is that of the Trident driver: 1/71.92,
    /// -1/76.69, 13/72.
    pub fn puma560() -> Self {
        Self {
            gear: [62.6111, 107.36, 53.7063, 76.0364, 71.923, 76.686],
            counts_per_motor_turn: [1000.0, 800.0, 1000.0, 1000.0, 1000.0, 500.0],
            coupling_4_to_5: 0.013_903_7,
            coupling_4_to_6: -0.013_040_1,
            coupling_5_to_6: 0.180_556,
        }
    }

    /// Returns the radians of the joint per encoder count, without coupling.
    pub(crate) fn radians_per_count(&self) -> [f64; 6] {
        std::array::from_fn(|i| TAU / (self.gear[i] * self.counts_per_motor_turn[i]))
    }

    /// Returns the encoder counts of the six motors for these joint angles, coupling included. They
    /// are zero at `JT` = 0.
    pub fn counts(&self, joints: &Joints) -> [f64; 6] {
        let [a, b, c, j4, j5, j6] = joints.0;
        let m5 = j5 - self.coupling_4_to_5 * j4;
        let m6 = j6 - self.coupling_4_to_6 * j4 - self.coupling_5_to_6 * j5;
        let scale = self.radians_per_count();
        let shafts = [a, b, c, j4, m5, m6];
        std::array::from_fn(|i| shafts[i] / scale[i])
    }

    /// Returns the joint angles for these encoder counts; the inverse of [`DriveTrain::counts`].
    pub fn joints(&self, counts: [f64; 6]) -> Joints {
        let scale = self.radians_per_count();
        let [a, b, c, j4, m5, m6] = std::array::from_fn(|i| counts[i] * scale[i]);
        let j5 = m5 + self.coupling_4_to_5 * j4;
        let j6 = m6 + self.coupling_4_to_6 * j4 + self.coupling_5_to_6 * j5;
        Joints([a, b, c, j4, j5, j6])
    }

    /// Returns the joint angles at the nearest whole encoder counts, where an arm can stand.
    pub(crate) fn quantized(&self, joints: &Joints) -> Joints {
        self.joints(self.counts(joints).map(f64::round))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_lead_back_to_the_joints() {
        let train = DriveTrain::puma560();
        let joints = Joints::from_degrees([12.3, -45.6, 78.9, -101.2, 34.5, 250.0]);
        let back = train.joints(train.counts(&joints));
        assert!((back - joints).0.iter().all(|d| d.abs() < 1e-14));
        let off = train.quantized(&joints) - joints;
        assert!(off.degrees().iter().all(|d| d.abs() < 0.008), "{off:?}");
    }

    #[test]
    fn a_count_is_some_thousandths_of_a_degree() {
        let degrees = DriveTrain::puma560()
            .radians_per_count()
            .map(f64::to_degrees);
        for (got, wanted) in degrees
            .iter()
            .zip([0.00575, 0.00419, 0.00670, 0.00474, 0.00501, 0.00939])
        {
            assert!((got - wanted).abs() < 1e-5, "{degrees:?}");
        }
    }
}
