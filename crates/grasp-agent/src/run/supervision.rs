//! Supervision: bounds of the joints, and a judgement of every move.

use hough_heuristic::Features;
use puma_val2::{Joint, Joints};

use crate::limits::JointLimits;
use crate::run::config::AgentConfig;

/// The paper's constant control of the approach (section 2.2: collisions with unexpected objects,
/// "or a rapid approach that could damage the camera").
///
/// It moves nothing itself, and its state is kept from run to run. The supervision of an agent is
/// its [`AgentConfig`] unless [`Agent::supervised_by`](crate::Agent::supervised_by) replaces it.
/// The agent itself watches the camera: see [`AgentConfig::same_frames`].
///
/// ```
/// use grasp_agent::hough_heuristic::Features;
/// use grasp_agent::puma_val2::{Joint, Joints};
/// use grasp_agent::{AgentConfig, JointLimits, Supervision};
///
/// /// Sends an upper arm back that is less than 30 degrees above the level.
/// #[derive(Clone, Debug)]
/// struct Steep(AgentConfig);
///
/// impl Supervision for Steep {
///     fn limits(&self) -> &JointLimits {
///         self.0.limits()
///     }
///
///     fn is_too_near(&mut self, reached: &Joints, near: bool) -> bool {
///         near || reached.degrees()[1] > -30.0
///     }
///
///     fn stuck(&mut self, target: &Joints, reached: &Joints) -> Option<Joint> {
///         self.0.stuck(target, reached)
///     }
///
///     fn is_too_fast(&mut self, before: &Features, after: &Features) -> bool {
///         self.0.is_too_fast(before, after)
///     }
///
///     fn boxed(&self) -> Box<dyn Supervision> {
///         Box::new(self.clone())
///     }
/// }
/// ```
pub trait Supervision: std::fmt::Debug + Send + Sync {
    /// Returns the range that each joint is kept in. Moves that lead out of it are not made, and
    /// viewpoints are cut to it.
    fn limits(&self) -> &JointLimits;

    /// Returns `true` if the arm, which reports to be at `reached` after a move, has to stop and go
    /// back. `near` is `true` if its own guard halted it, or a sensor reports something near now.
    fn is_too_near(&mut self, reached: &Joints, near: bool) -> bool {
        let _ = reached;
        near
    }

    /// Returns the joint that has not arrived in a move to `target` after which the arm reports to
    /// be at `reached`. The run is then broken off.
    fn stuck(&mut self, target: &Joints, reached: &Joints) -> Option<Joint>;

    /// Returns `true` if a move that took the ball in the image from `before` to `after` came
    /// nearer too fast; the arm then goes back.
    fn is_too_fast(&mut self, before: &Features, after: &Features) -> bool;

    /// Returns a copy, for copies of an agent: `Box::new(self.clone())`.
    fn boxed(&self) -> Box<dyn Supervision>;
}

impl Clone for Box<dyn Supervision> {
    fn clone(&self) -> Self {
        (**self).boxed()
    }
}

/// Supervision by fixed bounds: `limits`, `reach_tolerance`, `approach_radius` and
/// `approach_growth`.
impl Supervision for AgentConfig {
    fn limits(&self) -> &JointLimits {
        &self.limits
    }

    fn stuck(&mut self, target: &Joints, reached: &Joints) -> Option<Joint> {
        let off = |joint: Joint| (reached[joint] - target[joint]).abs();
        Joint::ALL
            .into_iter()
            .find(|joint| off(*joint).is_nan() || off(*joint) > self.reach_tolerance)
    }

    fn is_too_fast(&mut self, before: &Features, after: &Features) -> bool {
        after.r > self.approach_radius && after.r > self.approach_growth * before.r
    }

    fn boxed(&self) -> Box<dyn Supervision> {
        Box::new(self.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config() -> AgentConfig {
        AgentConfig::paper([Joints::default()])
    }

    #[test]
    fn a_joint_that_has_not_arrived_is_stuck() {
        let target = Joints::from_degrees([10.0, -90.0, 180.0, 0.0, 45.0, 0.0]);
        for ([j1, j2, j3], expected) in [
            ([10.9, -90.0, 180.0], None),
            ([10.0, -90.0, 178.5], Some(Joint::J3)),
            ([10.0, f64::NAN, 180.0], Some(Joint::J2)),
        ] {
            let reached = Joints::from_degrees([j1, j2, j3, 0.0, 45.0, 0.0]);
            assert_eq!(config().stuck(&target, &reached), expected);
        }
    }

    #[test]
    fn an_approach_is_too_fast_near_the_ball_only() {
        let ball = |r| Features::new(96.0, 72.0, r);
        // Up to the radius of 62 anything, beyond it up to a growth of 1.5, ends included.
        for (before, after, too_fast) in [
            (10.0, 62.0, false),
            (10.0, 62.1, true),
            (42.0, 63.0, false),
            (41.9, 63.0, true),
            (80.0, 63.0, false),
        ] {
            let judged = config().is_too_fast(&ball(before), &ball(after));
            assert_eq!(judged, too_fast, "{before} to {after}");
        }
    }
}
