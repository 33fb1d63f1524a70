//! A grip that turns the hand by how the object lies.

use std::f64::consts::{FRAC_PI_2, PI};

use puma_val2::{Joint, JointDelta, Joints};

use crate::controller::{Consequence, Controller, GaveUp, Situation};
use crate::limits::JointLimits;

/// A controller whose grip turns `JT6` so that the jaws close across the longer axis of what is
/// seen ([`Situation::long_axis`]): an egg, found by [`EggFeatures`](crate::EggFeatures).
///
/// With `JT6` at 0 the jaws open along the rows of the image, and a turn of `JT6` turns them from x
/// toward y. It reaches as the controller in it does, and grips as that does what has no longer
/// axis.
#[derive(Clone, Debug)]
pub struct GripAcross<C> {
    controller: C,
    grip: JointDelta,
}

impl<C> GripAcross<C> {
    /// `controller`, with `grip` in the place of an aim of its own where it has none:
    /// [`AgentConfig::grip`](crate::AgentConfig::grip), for example.
    pub fn new(controller: C, grip: JointDelta) -> Self {
        Self { controller, grip }
    }

    /// The controller in it.
    pub fn controller(&self) -> &C {
        &self.controller
    }

    /// The grip of what the controller has no aim at, without the turn of `JT6`.
    pub fn grip_move(&self) -> JointDelta {
        self.grip
    }
}

impl<C: Controller> Controller for GripAcross<C> {
    fn name(&self) -> &str {
        self.controller.name()
    }

    fn decide(&mut self, now: &Situation, limits: &JointLimits) -> Result<JointDelta, GaveUp> {
        self.controller.decide(now, limits)
    }

    fn judge(&mut self, consequence: &Consequence) {
        self.controller.judge(consequence);
    }

    fn arm_at(&mut self, joints: &Joints) {
        self.controller.arm_at(joints);
    }

    fn grip(&mut self, now: &Situation, limits: &JointLimits) -> Option<JointDelta> {
        let own = self.controller.grip(now, limits);
        let Some(long_axis) = now.long_axis else {
            return own;
        };
        // The shorter of the two turns across it.
        let turn = match (long_axis + FRAC_PI_2).rem_euclid(PI) {
            turn if turn > FRAC_PI_2 => turn - PI,
            turn => turn,
        };
        let mut grip = own.unwrap_or(self.grip);
        grip.0[Joint::J6.index()] += turn;
        Some(grip)
    }

    fn begin(&mut self) {
        self.controller.begin();
    }

    fn end(&mut self) {
        self.controller.end();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::controllers::servo::position_based::PositionBased;
    use crate::controllers::servo::settings::ServoSettings;
    use crate::run::config::AgentConfig;
    use hough_heuristic::Features;

    #[test]
    fn the_jaws_close_across_the_longer_axis_by_the_shorter_turn() {
        let grip = AgentConfig::paper([Joints::default()]).grip;
        let mut across = GripAcross::new(PositionBased::new(ServoSettings::paper()), grip);
        let mut turn = |long_axis: Option<f64>| {
            let now = Situation {
                features: Features {
                    x: 103.5,
                    y: 78.0,
                    r: 33.0,
                },
                joints: Joints::default(),
                long_axis: long_axis.map(f64::to_radians),
            };
            across
                .grip(&now, &JointLimits::paper())
                .map(|g| g.degrees())
        };
        assert_eq!(turn(None), None);
        for (axis, expected) in [
            (0.0, 90.0),
            (10.0, -80.0),
            (-30.0, 60.0),
            (80.0, -10.0),
            (-90.0, 0.0),
        ] {
            let [.., j5, j6] = turn(Some(axis)).unwrap();
            assert!(
                (j6 - expected).abs() < 1e-9 && (j5 + 18.01).abs() < 1e-9,
                "{axis}: {j6}"
            );
        }
    }
}
