//! Exact simulator of approaching, in the plane of the second and third joint.

use nalgebra::{Isometry3, Point3, Vector3};
use puma_val2::{Arm, Joint, JointDelta, Joints, PumaParams};

use crate::behaviour::spec::BehaviourSpec;
use crate::limits::JointLimits;
use crate::percept::Percept;
use crate::sight::camera_model::CameraModel;

impl CameraModel {
    /// Returns an exact simulator of approaching: the percept after a move of `JT2` and `JT3`, in
    /// the frame or outside it. A move of `JT3` out of its limits is not made. The percept is
    /// `None` if the ball has no image.
    ///
    /// `spec` gives the zero of theta 3, and all joints but `JT3` stand as in `pose`. The axes of
    /// `JT2` and `JT3` are parallel: turning arm and ball together about the shoulder then changes
    /// nothing, and the percept (x, y, r, theta 3) is the whole state.
    pub fn approaching(
        &self,
        spec: &BehaviourSpec,
        limits: JointLimits,
        pose: &Joints,
    ) -> impl FnMut(&Percept, &JointDelta) -> Option<Percept> + use<> {
        let (model, pose, zero) = (*self, *pose, spec.theta3_zero);
        let mut plane = match &self.arm {
            Arm::Puma(arm) => Some(ArmPlane::new(self, arm, limits, &pose, zero)),
            Arm::Serial { .. } => None,
        };
        move |percept, delta| match &mut plane {
            Some(plane) => plane.after(percept, delta),
            None => model.approached(percept, delta, &limits, (pose, zero)),
        }
    }

    /// Returns the percept after a move by the general kinematics, with the joints but `JT3` at
    /// `others` before it, and theta 3 zero at `zero` degrees.
    fn approached(
        &self,
        percept: &Percept,
        delta: &JointDelta,
        limits: &JointLimits,
        (others, zero): (Joints, f64),
    ) -> Option<Percept> {
        let mut joints = others;
        joints.0[Joint::J3.index()] = (percept.theta3 + zero).to_radians();
        let moved = joints + *delta;
        let (low, high) = limits.0[Joint::J3.index()];
        if !(low..=high).contains(&moved[Joint::J3]) {
            return Some(*percept);
        }
        let ball = self.locate(&joints, &percept.features)?;
        let theta3 = moved[Joint::J3].to_degrees() - zero;
        let features = self.view(&moved, &ball)?;
        Some(Percept { features, theta3 })
    }
}

/// Arm in the plane of its second and third joint. Both turn about parallel axes, and the place of
/// the ball of the last percept is remembered: a tenth of the time of the general kinematics.
#[derive(Clone, Debug)]
struct ArmPlane {
    model: CameraModel,
    limits: JointLimits,
    /// Zero of theta 3, degrees.
    zero: f64,
    /// Vector from the shoulder to the elbow, in a frame that turns with the upper arm.
    elbow: Vector3<f64>,
    /// Camera in a frame that turns with the forearm, with its origin in the elbow.
    camera: Isometry3<f64>,
    /// Last percept returned, and the place of its ball from the elbow, in the frame of the upper
    /// arm.
    last: Option<(Percept, Vector3<f64>)>,
}

impl ArmPlane {
    fn new(
        model: &CameraModel,
        arm: &PumaParams,
        limits: JointLimits,
        pose: &Joints,
        zero: f64,
    ) -> Self {
        let [_, _, _, wrist @ ..] = pose.0;
        let stretched = Joints([0.0, 0.0, 0.0, wrist[0], wrist[1], wrist[2]]);
        let elbow = Vector3::new(arm.a2, arm.d2, 0.0);
        let from_elbow =
            Isometry3::translation(-elbow.x, -elbow.y, -elbow.z) * arm.wrist(&stretched);
        Self {
            model: *model,
            limits,
            zero,
            elbow,
            camera: from_elbow * model.mount,
            last: None,
        }
    }

    fn after(&mut self, percept: &Percept, delta: &JointDelta) -> Option<Percept> {
        let turned = delta[Joint::J3];
        let theta3 = percept.theta3 + turned.to_degrees();
        let jt3 = (theta3 + self.zero).to_radians();
        let (low, high) = self.limits.0[Joint::J3.index()];
        if !(low..=high).contains(&jt3) {
            return Some(*percept);
        }
        let ball = match &self.last {
            Some((last, ball)) if last == percept => *ball,
            _ => {
                let seen = self.camera * self.model.in_camera(&percept.features)?;
                about_y(&seen.coords, jt3 - turned)
            }
        };
        let ball = about_y(&(ball + self.elbow), -delta[Joint::J2]) - self.elbow;
        let before_camera = self
            .camera
            .inverse_transform_point(&Point3::from(about_y(&ball, -jt3)));
        let features = self.model.outline(&before_camera)?;
        let after = Percept { features, theta3 };
        self.last = Some((after, ball));
        Some(after)
    }
}

/// Turns `v` about the y axis.
fn about_y(v: &Vector3<f64>, angle: f64) -> Vector3<f64> {
    let (sin, cos) = angle.sin_cos();
    Vector3::new(cos * v.x + sin * v.z, v.y, cos * v.z - sin * v.x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use hough_heuristic::Features;

    #[test]
    fn the_plane_equals_the_camera_model_along_walks_and_jumps() {
        let (model, limits) = (CameraModel::paper(), JointLimits::paper());
        let spec = BehaviourSpec::approaching();
        let others = Joints::from_degrees([0.0, -60.0, 0.0, 0.0, 45.0, 0.0]);
        let mut plane = model.approaching(&spec, limits, &others);
        let general = (others, spec.theta3_zero);
        let start = Percept {
            features: Features::new(98.0, 60.0, 10.0),
            theta3: 30.0,
        };
        let (mut percept, mut made) = (start, 0);
        for step in 0_u32..400 {
            let turn = |n: u32, of: [f64; 5]| of[(n as usize) % 5];
            let delta = JointDelta::from_degrees([
                0.0,
                turn(step * 7 + step / 5, [6.0, -2.0, 0.6, -6.0, 2.0]),
                turn(step * 3 + step / 11, [5.0, -1.6, 16.0, 0.5, -16.0]),
                0.0,
                0.0,
                0.0,
            ]);
            let (quick, slow) = (
                plane(&percept, &delta),
                model.approached(&percept, &delta, &limits, general),
            );
            let (Some(quick), Some(slow)) = (quick, slow) else {
                assert!(quick.is_none() && slow.is_none());
                percept = start;
                continue;
            };
            let (a, b) = (quick.features, slow.features);
            let off = [a.x - b.x, a.y - b.y, a.r - b.r, quick.theta3 - slow.theta3];
            assert!(
                off.iter().all(|off| off.abs() < 1e-6 * (1.0 + b.r)),
                "step {step}: {quick:?} {slow:?}"
            );
            made += usize::from(quick != percept);
            // Now and then the plane is asked about another ball than the last.
            let far = !(5.0..68.0).contains(&a.r) || !(-50.0..200.0).contains(&a.y);
            percept = if far || step % 13 == 0 { start } else { quick };
        }
        assert!(made > 100, "{made} moves");
    }
}
