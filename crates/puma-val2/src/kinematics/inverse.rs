//! Hand pose to joint angles, in closed form.

use std::f64::consts::{PI, TAU};
use std::fmt;

use nalgebra::Isometry3;

use crate::joints::{Joint, Joints};
use crate::kinematics::params::PumaParams;

/// One of the eight postures that reach a pose, in VAL's words.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Configuration {
    /// A right arm as seen from behind, `RIGHTY`; otherwise `LEFTY`.
    pub righty: bool,
    /// The elbow above the line from shoulder to wrist, `ABOVE`; otherwise `BELOW`.
    pub above: bool,
    /// `JT5` negative, `FLIP`; otherwise `NOFLIP`.
    pub flip: bool,
}

impl Configuration {
    /// Returns the three words as one array, in the order of the fields.
    pub(crate) fn parts(self) -> [bool; 3] {
        [self.righty, self.above, self.flip]
    }
}

impl fmt::Display for Configuration {
    /// VAL's words: `RIGHTY ABOVE NOFLIP`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let side = if self.righty { "RIGHTY" } else { "LEFTY" };
        let elbow = if self.above { "ABOVE" } else { "BELOW" };
        let wrist = if self.flip { "FLIP" } else { "NOFLIP" };
        write!(f, "{side} {elbow} {wrist}")
    }
}

/// Joint angles that reach a pose, and the posture they stand for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solution {
    /// Angles in [-pi, pi), not checked against joint ranges.
    pub joints: Joints,
    /// The posture.
    pub configuration: Configuration,
}

/// Reason why a pose cannot be reached.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Unreachable {
    /// A coordinate of the pose is NaN or infinite.
    #[error("the pose holds a number that is not finite")]
    NotFinite,
    /// No posture was allowed.
    #[error("no posture is allowed")]
    NotAllowed,
    /// The wrist centre would lie nearer to the waist axis than the arm's lateral offset allows.
    #[error("the wrist would have to stand {by:.4} m further from the waist axis")]
    TooClose {
        /// Missing distance, metres.
        by: f64,
    },
    /// The wrist centre lies beyond the stretched (or inside the folded) arm.
    #[error("the wrist centre is {by:.4} m out of the arm's reach")]
    TooFar {
        /// Missing distance, metres.
        by: f64,
    },
    /// Every posture that was allowed takes some joint out of its range.
    #[error(
        "{joint} would have to go to {wanted_degrees:.3} degrees: its range is {min_degrees:.1} to \
         {max_degrees:.1}"
    )]
    Limit {
        /// Joint that is out of range in the posture that comes nearest.
        joint: Joint,
        /// Angle that the posture needs.
        wanted_degrees: f64,
        /// Lower limit.
        min_degrees: f64,
        /// Upper limit.
        max_degrees: f64,
    },
}

impl PumaParams {
    /// Returns the eight postures that put the flange at `flange` (world frame, metres).
    ///
    /// At a wrist singularity (`JT5` = 0) only the sum of `JT4` and `JT6` counts, and `JT4` is 0.
    /// Joint ranges are not checked; [`PumaParams::inverse_near`] checks them.
    ///
    /// # Errors
    /// [`Unreachable`], never its `Limit`.
    pub fn inverse(&self, flange: &Isometry3<f64>) -> Result<[Solution; 8], Unreachable> {
        let r = flange.rotation.to_rotation_matrix().into_inner();
        let p = flange.translation.vector - r.column(2) * self.d6;
        if !(p.iter().chain(r.iter()).all(|v| v.is_finite())) {
            return Err(Unreachable::NotFinite);
        }
        let radius2 = p.x * p.x + p.y * p.y;
        let forward2 = beyond_rounding(radius2 - self.d2 * self.d2, radius2);
        if forward2 < 0.0 {
            return Err(Unreachable::TooClose {
                by: self.d2.abs() - radius2.sqrt(),
            });
        }
        let forward = forward2.sqrt();
        // x' = a2 c2 + a3 c23 + d4 s23 and z' = p.z span the arm's plane; k = a3 c3 + d4 s3, n = d4
        // c3 - a3 s3.
        let forearm2 = self.a3 * self.a3 + self.d4 * self.d4;
        let distance2 = forward2 + p.z * p.z;
        let k = (distance2 - self.a2 * self.a2 - forearm2) / (2.0 * self.a2);
        let lever2 = beyond_rounding(forearm2 - k * k, forearm2);
        if lever2.is_nan() || lever2 < 0.0 {
            let (distance, forearm) = (distance2.sqrt(), forearm2.sqrt());
            let by = (distance - (self.a2 + forearm)).max((self.a2 - forearm).abs() - distance);
            return Err(Unreachable::TooFar { by: by.max(0.0) });
        }
        let lever = lever2.sqrt();
        // One arc tangent each serves all postures: they differ in signs and by half a turn. Sines
        // and cosines are had without any.
        let azimuth = p.y.atan2(p.x);
        let lateral = self.d2.atan2(forward);
        let elevation = (-p.z).atan2(forward);
        let elbow_offset = self.a3.atan2(self.d4);
        let bend_above = k.atan2(lever);
        let raised = lever.atan2(self.a2 + k);
        let mut found = [EMPTY; 8];
        let mut places = found.iter_mut();
        for righty in [true, false] {
            let (x, t1, ahead) = if righty {
                (-forward, azimuth + lateral - PI, PI - elevation)
            } else {
                (forward, azimuth - lateral, elevation)
            };
            let c1 = (p.x * x + p.y * self.d2) / radius2;
            let s1 = (p.y * x - p.x * self.d2) / radius2;
            for above in [true, false] {
                let up = if righty == above { 1.0 } else { -1.0 };
                let n = up * lever;
                let t3 = if up > 0.0 {
                    bend_above
                } else {
                    PI - bend_above
                } - elbow_offset;
                let t2 = ahead + up * raised;
                let m = self.a2 + k;
                let (c2, s2) = ((m * x + n * p.z) / distance2, (n * x - m * p.z) / distance2);
                let (c3, s3) = (
                    (n * self.d4 + k * self.a3) / forearm2,
                    (k * self.d4 - n * self.a3) / forearm2,
                );
                let (s23, c23) = (s2 * c3 + c2 * s3, c2 * c3 - s2 * s3);
                // Ry(-t23) Rz(-t1) R, of which the last column and the last row are needed.
                let along = |i: usize| c1 * r[(0, i)] + s1 * r[(1, i)];
                let w02 = c23 * along(2) - s23 * r[(2, 2)];
                let w12 = -s1 * r[(0, 2)] + c1 * r[(1, 2)];
                let w22 = s23 * along(2) + c23 * r[(2, 2)];
                let bend = (w02 * w02 + w12 * w12).sqrt();
                let [(t4, t5, t6), flipped] = if bend > 1e-4 {
                    let w20 = s23 * along(0) + c23 * r[(2, 0)];
                    let w21 = s23 * along(1) + c23 * r[(2, 1)];
                    let (t4, t5, t6) = (w12.atan2(w02), bend.atan2(w22), w21.atan2(-w20));
                    [(t4, t5, t6), (t4 + PI, -t5, t6 + PI)]
                } else {
                    // Next to the straight wrist two arc tangents would lose their sum: JT6 is what
                    // JT4 leaves of the turn.
                    let w00 = c23 * along(0) - s23 * r[(2, 0)];
                    let w01 = c23 * along(1) - s23 * r[(2, 1)];
                    let w10 = -s1 * r[(0, 0)] + c1 * r[(1, 0)];
                    let w11 = -s1 * r[(0, 1)] + c1 * r[(1, 1)];
                    let (s4, c4) = if bend > 1e-12 {
                        (w12 / bend, w02 / bend)
                    } else {
                        (0.0, 1.0)
                    };
                    let t6 = (c4 * w10 - s4 * w00).atan2(c4 * w11 - s4 * w01);
                    let (t4, t5) = (s4.atan2(c4), bend.atan2(w22));
                    [(t4, t5, t6), (t4 + PI, -t5, t6 + PI)]
                };
                let wrists = [(false, (t4, t5, t6)), (true, flipped)];
                for ((flip, (t4, t5, t6)), place) in wrists.into_iter().zip(places.by_ref()) {
                    let configuration = Configuration {
                        righty,
                        above,
                        flip,
                    };
                    let joints = Joints([t1, t2, t3, t4, t5, t6].map(wrap));
                    *place = Solution {
                        joints,
                        configuration,
                    };
                }
            }
        }
        Ok(found)
    }

    /// Returns the posture of `joints`.
    pub fn configuration(&self, joints: &Joints) -> Configuration {
        let righty = self.wrist_ahead(joints) <= 0.0;
        Configuration {
            righty,
            above: (self.elbow_lever(joints) >= 0.0) == righty,
            flip: wrap(joints.0[4]) < 0.0,
        }
    }

    /// Returns the joint angles within their ranges that reach `flange` and lie nearest to `near`,
    /// in the posture `configuration` or, with `None`, in any.
    ///
    /// The nearest angles are those with the shortest travel, measured by the joint that needs
    /// longest at full speed. Of the turns that a range leaves open (`JT4` and `JT6` have more than
    /// one) the nearest is taken.
    ///
    /// # Errors
    /// [`Unreachable`]. With several postures `Limit` names the joint of the one that misses its
    /// range by least.
    pub fn inverse_near(
        &self,
        flange: &Isometry3<f64>,
        near: &Joints,
        configuration: Option<Configuration>,
    ) -> Result<Joints, Unreachable> {
        self.inverse_among(flange, near, |c| {
            configuration.is_none_or(|wanted| wanted == c)
        })
    }

    /// Returns the nearest joint angles in any of the postures that `allowed` accepts.
    ///
    /// # Errors
    /// Those of [`PumaParams::inverse_near`], and [`Unreachable::NotAllowed`] if no posture is
    /// accepted.
    pub(crate) fn inverse_among(
        &self,
        flange: &Isometry3<f64>,
        near: &Joints,
        allowed: impl Fn(Configuration) -> bool,
    ) -> Result<Joints, Unreachable> {
        let mut best: Option<(f64, Joints)> = None;
        let mut least: Option<(f64, Unreachable)> = None;
        for solution in self.inverse(flange)?.iter() {
            if !allowed(solution.configuration) {
                continue;
            }
            match self.place_in_ranges(&solution.joints, near) {
                Ok(joints) => {
                    let travel = (0..6)
                        .map(|i| (joints.0[i] - near.0[i]).abs() / self.ranges[i].speed)
                        .fold(0.0, f64::max);
                    if best.is_none_or(|(t, _)| travel < t) {
                        best = Some((travel, joints));
                    }
                }
                Err((excess, why)) => {
                    if least.is_none_or(|(e, _)| excess < e) {
                        least = Some((excess, why));
                    }
                }
            }
        }
        match (best, least) {
            (Some((_, joints)), _) => Ok(joints),
            (None, Some((_, why))) => Err(why),
            (None, None) => Err(Unreachable::NotAllowed),
        }
    }

    /// Returns the turns of `joints` that lie in range and nearest to `near`, or the joint without
    /// one and its distance from the range.
    fn place_in_ranges(
        &self,
        joints: &Joints,
        near: &Joints,
    ) -> Result<Joints, (f64, Unreachable)> {
        let slack = 1e-9;
        let mut placed = *joints;
        for joint in Joint::ALL {
            let (i, range) = (joint.index(), self.ranges[joint.index()]);
            let turns = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|n| joints.0[i] + n * TAU);
            let inside = turns
                .into_iter()
                .filter(|a| *a >= range.min - slack && *a <= range.max + slack)
                .min_by(|a, b| (a - near.0[i]).abs().total_cmp(&(b - near.0[i]).abs()));
            let Some(angle) = inside else {
                let excess = |a: f64| (range.min - a).max(a - range.max);
                let wanted =
                    turns.into_iter().fold(
                        joints.0[i],
                        |a, b| if excess(b) < excess(a) { b } else { a },
                    );
                return Err((
                    excess(wanted),
                    Unreachable::Limit {
                        joint,
                        wanted_degrees: wanted.to_degrees(),
                        min_degrees: range.min.to_degrees(),
                        max_degrees: range.max.to_degrees(),
                    },
                ));
            };
            placed.0[i] = angle;
        }
        Ok(placed)
    }
}

const EMPTY: Solution = Solution {
    joints: Joints([0.0; 6]),
    configuration: Configuration {
        righty: true,
        above: true,
        flip: false,
    },
};

/// Returns the difference of squares, or zero if it is negative by no more than rounding explains,
/// as for a stretched arm at the border of its reach.
fn beyond_rounding(difference: f64, of: f64) -> f64 {
    if difference < 0.0 && difference > -1e-12 * of {
        0.0
    } else {
        difference
    }
}

/// Wraps an angle to [-pi, pi). Angles here lie within three turns, so steps are cheaper than a
/// remainder.
fn wrap(mut angle: f64) -> f64 {
    if !angle.is_finite() || angle.abs() > 100.0 {
        return (angle + PI).rem_euclid(TAU) - PI;
    }
    while angle >= PI {
        angle -= TAU;
    }
    while angle < -PI {
        angle += TAU;
    }
    angle
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_branch_leads_back_to_the_pose_in_its_own_posture() {
        let arm = PumaParams::unimation();
        let joints = Joints::from_degrees([30.0, -60.0, 140.0, 25.0, 50.0, -70.0]);
        let pose = arm.forward(&joints);
        let all = arm.inverse(&pose).unwrap();
        assert_eq!(all.len(), 8);
        for solution in all.iter() {
            let back = arm.forward(&solution.joints);
            assert!((back.to_homogeneous() - pose.to_homogeneous()).amax() < 1e-12);
            assert_eq!(arm.configuration(&solution.joints), solution.configuration);
        }
        let same = arm
            .inverse_near(&pose, &joints, Some(arm.configuration(&joints)))
            .unwrap();
        assert!((same - joints).0.iter().all(|d| d.abs() < 1e-12));
    }

    #[test]
    fn what_is_missing_is_named() {
        let arm = PumaParams::unimation();
        let at = |x, y, z| Isometry3::translation(x, y, z + arm.d6);
        assert!(matches!(
            arm.inverse(&at(0.0, 0.1, 0.3)),
            Err(Unreachable::TooClose { by }) if (by - 0.04909).abs() < 1e-12
        ));
        assert!(
            matches!(arm.inverse(&at(1.2, 0.0, 0.3)), Err(Unreachable::TooFar { by }) if by > 0.3)
        );
        assert_eq!(
            arm.inverse(&at(f64::NAN, 0.0, 0.3)).unwrap_err(),
            Unreachable::NotFinite
        );
    }

    #[test]
    fn ready_is_a_right_arm_with_its_elbow_above() {
        let ready = Joints::READY;
        let words = PumaParams::unimation().configuration(&ready).to_string();
        assert_eq!(words, "RIGHTY ABOVE NOFLIP");
    }
}
