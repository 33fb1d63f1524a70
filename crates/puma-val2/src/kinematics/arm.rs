//! Arms of any make: kinematics as a trait, and an arm as data.

use std::collections::BTreeSet;
use std::f64::consts::FRAC_PI_2;
use std::sync::{Mutex, PoisonError};

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use crate::error::ArmError;
use crate::joints::{Joint, Joints};
use crate::kinematics::params::PumaParams;
use crate::limits::{self, JointRange};

/// Forward kinematics of an arm with up to six turning joints.
///
/// An arm with fewer joints leaves places of [`Joints`] unused; of one with more, six are chosen
/// and the others stand still.
pub trait Kinematics {
    /// Returns the pose of the hand: z along the tool axis, in the arm's base frame, metres.
    fn forward(&self, joints: &Joints) -> Isometry3<f64>;

    /// Returns the range of each joint, radians (low, high); (0, 0) for an unused place.
    fn limits(&self) -> [(f64, f64); 6];

    /// Returns the name of each joint, for errors and logs; `""` for an unused place (default `JT1`
    /// to `JT6`).
    fn names(&self) -> [&str; 6] {
        Joint::NAMES
    }
}

impl Kinematics for PumaParams {
    fn forward(&self, joints: &Joints) -> Isometry3<f64> {
        PumaParams::forward(self, joints)
    }

    fn limits(&self) -> [(f64, f64); 6] {
        self.ranges.map(|range| (range.min, range.max))
    }
}

/// An arm as data: a PUMA, or any chain of turning joints.
///
/// ```
/// use puma_val2::{Arm, Joints, Kinematics};
///
/// let hand = Arm::ur5().forward(&Joints::default());
/// assert!((hand.translation.x + 0.81725).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(untagged))]
#[expect(
    clippy::large_enum_variant,
    reason = "one arm a cell; a box would cost Copy"
)]
pub enum Arm {
    /// A PUMA by its lengths.
    Puma(PumaParams),
    /// A chain of turning joints.
    Serial {
        /// A point on the axis of each joint and the direction of the axis (of length 1), with all
        /// angles zero, in the base frame, metres. The direction of an unused place is zero.
        axes: [(Point3<f64>, Vector3<f64>); 6],
        /// The hand with all angles zero, z along the tool axis.
        home: Isometry3<f64>,
        /// Range of each joint, radians (low, high).
        limits: [(f64, f64); 6],
        /// Name of each joint; `""` for an unused place.
        #[cfg_attr(
            feature = "serde",
            serde(default = "numbered", deserialize_with = "read_names")
        )]
        names: [&'static str; 6],
    },
}

/// Returns names that live as long as the program. Each different one is stored once, so that an
/// [`Arm`] can be copied.
pub(crate) fn lasting(names: [&str; 6]) -> [&'static str; 6] {
    static KNOWN: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    names.map(|name| match known.get(name) {
        Some(name) => *name,
        None => {
            let name: &'static str = Box::leak(name.into());
            known.insert(name);
            name
        }
    })
}

#[cfg(feature = "serde")]
fn numbered() -> [&'static str; 6] {
    Joint::NAMES
}

#[cfg(feature = "serde")]
fn read_names<'de, D: serde::Deserializer<'de>>(from: D) -> Result<[&'static str; 6], D::Error> {
    let names: [String; 6] = serde::Deserialize::deserialize(from)?;
    Ok(lasting(names.each_ref().map(String::as_str)))
}

impl From<PumaParams> for Arm {
    fn from(params: PumaParams) -> Self {
        Self::Puma(params)
    }
}

impl Kinematics for Arm {
    fn forward(&self, joints: &Joints) -> Isometry3<f64> {
        self.wrist(joints) * Translation3::new(0.0, 0.0, self.flange())
    }

    fn limits(&self) -> [(f64, f64); 6] {
        match self {
            Self::Puma(params) => Kinematics::limits(params),
            Self::Serial { limits, .. } => *limits,
        }
    }

    fn names(&self) -> [&str; 6] {
        match self {
            Self::Puma(params) => params.names(),
            Self::Serial { names, .. } => *names,
        }
    }
}

impl Arm {
    /// Returns the pose of the frame that a camera on the hand is mounted in: the wrist of a PUMA
    /// ([`PumaParams::wrist`]), the hand of any other arm.
    pub fn wrist(&self, joints: &Joints) -> Isometry3<f64> {
        match self {
            Self::Puma(params) => params.wrist(joints),
            Self::Serial { axes, home, .. } => {
                let mut pose = Isometry3::identity();
                for ((point, axis), angle) in axes.iter().zip(joints.0) {
                    let turn = UnitQuaternion::from_scaled_axis(axis * angle);
                    pose *= Isometry3::from_parts((point - turn * point).into(), turn);
                }
                pose * home
            }
        }
    }

    /// Returns the distance from the frame of [`Arm::wrist`] to the hand, along its z axis.
    pub fn flange(&self) -> f64 {
        match self {
            Self::Puma(params) => params.d6,
            Self::Serial { .. } => 0.0,
        }
    }

    /// Checks that every angle is finite and within its range.
    ///
    /// # Errors
    /// [`ArmError::NotFinite`] or [`ArmError::JointLimit`] for the first joint that fails.
    pub fn check(&self, joints: &Joints) -> Result<(), ArmError> {
        let ranges = match self {
            Self::Puma(params) => params.ranges,
            Self::Serial { limits, .. } => limits.map(|(min, max)| JointRange {
                min,
                max,
                speed: f64::INFINITY,
            }),
        };
        limits::check(&ranges, self.names(), joints)
    }

    /// Returns the arm with upper arm and forearm longer by these lengths, metres. Of a chain the
    /// upper arm ends on the axis of `JT3`, the forearm at the hand.
    #[must_use]
    pub fn lengthened(mut self, [upper, fore]: [f64; 2]) -> Self {
        match &mut self {
            Self::Puma(params) => {
                params.a2 += upper;
                params.d4 += fore;
            }
            Self::Serial { axes, home, .. } => {
                let along = |from: Point3<f64>, to: Point3<f64>, (_, axis): (_, Vector3<f64>)| {
                    let link = to - from;
                    let across = link - axis * axis.dot(&link);
                    across.try_normalize(1e-9).unwrap_or_default()
                };
                let end = Point3::from(home.translation.vector);
                let upper = along(axes[1].0, axes[2].0, axes[1]) * upper;
                let fore = along(axes[2].0, end, axes[2]) * fore;
                for (i, (point, _)) in axes.iter_mut().enumerate().skip(2) {
                    *point += if i > 2 { upper + fore } else { upper };
                }
                home.translation.vector += upper + fore;
            }
        }
        self
    }

    /// Returns the turn of `JT2` per unit of sag: the horizontal share of the upper arm, with the
    /// sign of the turn that lowers it.
    pub fn droop(&self, joints: &Joints) -> f64 {
        match self {
            // At JT2 = 0 the upper arm is level; positive angles lower it.
            Self::Puma(_) => joints.0[1].cos(),
            Self::Serial { axes, .. } => {
                let waist = UnitQuaternion::from_scaled_axis(axes[0].1 * joints.0[0]);
                let shoulder = UnitQuaternion::from_scaled_axis(axes[1].1 * joints.0[1]);
                let link = waist * shoulder * (axes[2].0 - axes[1].0);
                let axis = waist * axes[1].1;
                let across = link - axis * axis.dot(&link);
                -axis.cross(&across).z / across.norm().max(1e-9)
            }
        }
    }

    /// Reads an arm off its kinematics.
    ///
    /// # Errors
    /// [`ArmError::Other`] names a joint that does not turn about an axis by its angle, or reports
    /// joints that do not form one chain, the first at the base.
    pub fn of(arm: &impl Kinematics) -> Result<Self, ArmError> {
        let home = arm.forward(&Joints::default());
        let mut axes = [(Point3::origin(), Vector3::zeros()); 6];
        let mut names = arm.names();
        for joint in Joint::ALL {
            let name = names[joint.index()];
            let mut quarter = Joints::default();
            quarter.0[joint.index()] = FRAC_PI_2;
            let Isometry3 {
                rotation,
                translation,
            } = arm.forward(&quarter) * home.inverse();
            let shift = translation.vector;
            axes[joint.index()] = match rotation.axis() {
                Some(axis) if rotation.angle() > 1e-9 => {
                    // Of a quarter turn about an axis through p, the shift is p less p turned.
                    (
                        Point3::from(0.5 * (shift + axis.cross(&shift))),
                        axis.into_inner(),
                    )
                }
                _ if shift.norm() < 1e-9 => {
                    names[joint.index()] = "";
                    continue;
                }
                _ => {
                    return Err(ArmError::Other(format!(
                        "{name} slides, or is not finite; only turning joints can be described"
                    )));
                }
            };
        }
        let found = Self::Serial {
            axes,
            home,
            limits: arm.limits(),
            names: lasting(names),
        };
        for at in [0.3, -0.7, 1.1] {
            let joints = Joints(std::array::from_fn(|i| at * (1.0 + 0.2 * i as f64)));
            let off = found.wrist(&joints).inverse() * arm.forward(&joints);
            let off = off.translation.vector.norm() + off.rotation.angle();
            if off.is_nan() || off > 1e-6 {
                return Err(ArmError::Other(format!(
                    "at {joints} the hand is off by {off:.1e} (metres and radians) from a chain of \
                     six turning joints, JT1 at the base; give such a chain"
                )));
            }
        }
        Ok(found)
    }

    /// Returns the UR5 by the lengths of its maker (89.159, -425, -392.25, 109.15, 94.65, 82.3 mm).
    /// With all angles zero it is stretched along -x.
    pub fn ur5() -> Self {
        let (up, side) = (0.089_159, -0.109_15);
        let (elbow, wrist) = (-0.425, -0.817_25);
        let (y, z) = (Vector3::y(), Vector3::z());
        Self::Serial {
            axes: [
                (Point3::origin(), z),
                (Point3::new(0.0, 0.0, up), -y),
                (Point3::new(elbow, 0.0, up), -y),
                (Point3::new(wrist, 0.0, up), -y),
                (Point3::new(wrist, side, up), -z),
                (Point3::new(wrist, side, up - 0.094_65), -y),
            ],
            home: Isometry3::from_parts(
                Translation3::new(wrist, side - 0.0823, up - 0.094_65),
                UnitQuaternion::from_axis_angle(&Vector3::x_axis(), FRAC_PI_2),
            ),
            limits: [(-360_f64.to_radians(), 360_f64.to_radians()); 6],
            names: [
                "shoulder_pan_joint",
                "shoulder_lift_joint",
                "elbow_joint",
                "wrist_1_joint",
                "wrist_2_joint",
                "wrist_3_joint",
            ],
        }
    }

    /// Returns a desk arm of the size of the SO-101: pan, lift, elbow, flex and roll of the wrist
    /// in the places of `JT1`, `JT2`, `JT3`, `JT5`, `JT6`; `JT4` is unused. With all angles zero
    /// the upper arm (116 mm) is upright and the forearm (135 mm) level along +x. The hand frame
    /// lies in the axis of the flexing wrist.
    pub fn so101() -> Self {
        let (ahead, up) = (0.030, 0.117);
        let (elbow, wrist) = (up + 0.116, ahead + 0.135);
        let (x, y) = (Vector3::x(), Vector3::y());
        let degrees = [110.0, 100.0, 97.0, 0.0, 95.0, 160.0_f64];
        Self::Serial {
            axes: [
                (Point3::origin(), Vector3::z()),
                (Point3::new(ahead, 0.0, up), y),
                (Point3::new(ahead, 0.0, elbow), y),
                (Point3::origin(), Vector3::zeros()),
                (Point3::new(wrist, 0.0, elbow), y),
                (Point3::new(wrist, 0.0, elbow), x),
            ],
            home: Isometry3::from_parts(
                Translation3::new(wrist, 0.0, elbow),
                UnitQuaternion::from_axis_angle(&Vector3::y_axis(), FRAC_PI_2),
            ),
            limits: degrees.map(|most| (-most.to_radians(), most.to_radians())),
            names: [
                "shoulder_pan",
                "shoulder_lift",
                "elbow_flex",
                "",
                "wrist_flex",
                "wrist_roll",
            ],
        }
    }

    /// Reads an arm from a URDF (after `xacro`).
    ///
    /// `hand` is the link of the hand. `joints` names the joint for each place of [`Joints`], the
    /// first nearest to the base; `""` leaves a place unused. Joints of the chain that are not
    /// named stand at zero.
    ///
    /// # Errors
    /// [`ArmError::Other`] names the element that is missing or that cannot be used.
    #[cfg(feature = "urdf")]
    pub fn from_urdf(text: &str, hand: &str, joints: [&str; 6]) -> Result<Self, ArmError> {
        crate::kinematics::urdf::read(text, hand, joints).map_err(ArmError::Other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn off(a: &Isometry3<f64>, b: &Isometry3<f64>) -> f64 {
        (a.to_homogeneous() - b.to_homogeneous()).amax()
    }

    #[test]
    fn a_puma_read_off_its_kinematics_moves_alike() {
        let puma = PumaParams::unimation();
        let read = Arm::of(&puma).unwrap();
        assert!(matches!(read, Arm::Serial { .. }));
        assert_eq!(read.limits(), Kinematics::limits(&puma));
        assert_eq!(read.names(), Joint::NAMES);
        for k in 0..20 {
            let joints = Joints(std::array::from_fn(|i| (k * (i + 3)) as f64 % 5.3 - 2.5));
            assert!(off(&read.forward(&joints), &puma.forward(&joints)) < 1e-12);
            assert_eq!(Arm::from(puma).wrist(&joints), puma.wrist(&joints));
        }
    }

    /// Oracle: the rows (a, alpha, d) of the maker's table.
    #[test]
    fn the_ur5_follows_the_table_of_its_maker() {
        let rows = [
            (0.0, FRAC_PI_2, 0.089_159),
            (-0.425, 0.0, 0.0),
            (-0.392_25, 0.0, 0.0),
            (0.0, FRAC_PI_2, 0.109_15),
            (0.0, -FRAC_PI_2, 0.094_65),
            (0.0, 0.0, 0.0823),
        ];
        for k in 0..20 {
            let joints = Joints(std::array::from_fn(|i| (k * (i + 2)) as f64 % 6.1 - 3.0));
            let mut pose = Isometry3::identity();
            for ((a, alpha, d), angle) in rows.into_iter().zip(joints.0) {
                pose *= Isometry3::rotation(Vector3::z() * angle)
                    * Translation3::new(a, 0.0, d)
                    * Isometry3::rotation(Vector3::x() * alpha);
            }
            assert!(off(&Arm::ur5().forward(&joints), &pose) < 1e-12);
        }
    }

    #[test]
    fn the_desk_arm_stands_as_described_and_leaves_jt4_unused() {
        let arm = Arm::so101();
        let hand = arm.forward(&Joints::from_degrees([90.0, 90.0, 0.0, 33.0, 0.0, 0.0]));
        let expected = Point3::new(0.0, 0.030 + 0.116, 0.117 - 0.135);
        assert!((hand * Point3::origin() - expected).norm() < 1e-12);
        assert!((hand * Vector3::z() + Vector3::z()).norm() < 1e-12);
        assert_eq!(Arm::of(&arm).unwrap().limits(), arm.limits());
    }

    #[test]
    fn a_chain_lengthens_and_droops_like_the_puma_it_was_read_off() {
        let puma = Arm::from(PumaParams::unimation());
        let read = Arm::of(&puma).unwrap();
        for k in 0..20 {
            let joints = Joints(std::array::from_fn(|i| (k * (i + 3)) as f64 % 5.3 - 2.5));
            assert!((puma.droop(&joints) - read.droop(&joints)).abs() < 1e-12);
            let longer = [puma, read].map(|arm| arm.lengthened([0.02, 0.0]).forward(&joints));
            assert!(off(&longer[0], &longer[1]) < 1e-12);
        }
        let far = Joints::from_degrees([0.0, 170.0, 0.0, 0.0, 0.0, 0.0]);
        let refused = Arm::so101().check(&far).unwrap_err().to_string();
        assert!(
            refused.starts_with("shoulder_lift cannot go to 170"),
            "{refused}"
        );
        assert!(Arm::ur5().check(&far).is_ok());
    }

    struct Odd(fn(&Joints) -> Isometry3<f64>);

    impl Kinematics for Odd {
        fn forward(&self, joints: &Joints) -> Isometry3<f64> {
            (self.0)(joints)
        }

        fn limits(&self) -> [(f64, f64); 6] {
            [(-1.0, 1.0); 6]
        }
    }

    #[test]
    fn what_is_no_chain_of_turning_joints_is_refused_by_name() {
        let slides = Odd(|joints| Isometry3::translation(0.0, joints.0[2], 0.0));
        let geared = Odd(|joints| Isometry3::rotation(Vector3::z() * (2.0 * joints.0[1])));
        let missing = Odd(|_| Isometry3::translation(f64::NAN, 0.0, 0.0));
        for (arm, word) in [(slides, "JT3"), (geared, "off by"), (missing, "JT1")] {
            let error = Arm::of(&arm).unwrap_err().to_string();
            assert!(error.contains(word), "{error}");
        }
    }
}
