//! Supervision: bounds of the joints, and a judgement of every move.

use hough_heuristic::Features;
use puma_val2::{Joint, Joints};

use crate::limits::JointLimits;
use crate::run::config::AgentConfig;

/// Judgement of a move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The arm stands where it was sent.
    There,
    /// Something is too near: the arm is stopped and goes back to where it came from.
    TooNear,
    /// The arm says that it has moved, but this joint has not arrived: the run is broken off.
    Stuck(Joint),
}

/// The paper's constant control of the approach (section 2.2: collisions with unexpected objects,
/// "or a rapid approach that could damage the camera").
///
/// It moves nothing itself, and keeps its memory from run to run.
/// [`Agent::supervised_by`](crate::Agent::supervised_by) replaces [`Guard`]. The agent itself
/// watches the camera: see [`AgentConfig::same_frames`](crate::AgentConfig::same_frames).
///
/// ```
/// use grasp_agent::hough_heuristic::Features;
/// use grasp_agent::puma_val2::Joints;
/// use grasp_agent::{Guard, JointLimits, Supervision, Verdict};
///
/// /// Sends an upper arm back that is less than 30 degrees above the level.
/// #[derive(Clone, Debug)]
/// struct Steep(Guard);
///
/// impl Supervision for Steep {
///     fn limits(&self) -> &JointLimits {
///         self.0.limits()
///     }
///
///     fn judge_move(&mut self, target: &Joints, reached: &Joints, near: bool) -> Verdict {
///         let low = reached.degrees()[1] > -30.0;
///         self.0.judge_move(target, reached, near || low)
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

    /// Judges a move to `target` after which the arm reports to be at `reached`. `near` is `true`
    /// if the arm was halted by its own guard, or a sensor reports something near now.
    fn judge_move(&mut self, target: &Joints, reached: &Joints, near: bool) -> Verdict;

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

/// Supervision by the fixed bounds of an [`AgentConfig`].
#[derive(Clone, Debug)]
pub struct Guard {
    limits: JointLimits,
    approach_radius: f64,
    approach_growth: f64,
    reach_tolerance: f64,
}

impl Guard {
    /// Creates the guard that an agent with these settings has.
    pub fn of(config: &AgentConfig) -> Self {
        Self {
            limits: config.limits,
            approach_radius: config.approach_radius,
            approach_growth: config.approach_growth,
            reach_tolerance: config.reach_tolerance,
        }
    }
}

impl Supervision for Guard {
    fn limits(&self) -> &JointLimits {
        &self.limits
    }

    fn judge_move(&mut self, target: &Joints, reached: &Joints, near: bool) -> Verdict {
        if near {
            return Verdict::TooNear;
        }
        let off = |joint: Joint| (reached[joint] - target[joint]).abs();
        let stuck = Joint::ALL
            .into_iter()
            .find(|joint| off(*joint).is_nan() || off(*joint) > self.reach_tolerance);
        stuck.map_or(Verdict::There, Verdict::Stuck)
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

    fn guard() -> Guard {
        Guard::of(&AgentConfig::paper([Joints::default()]))
    }

    #[test]
    fn moves_are_judged_by_sensors_and_by_the_pose_reached() {
        let target = Joints::from_degrees([10.0, -90.0, 180.0, 0.0, 45.0, 0.0]);
        for (first_three, near, expected) in [
            ([10.9, -90.0, 180.0], false, Verdict::There),
            ([10.0, -90.0, 178.5], false, Verdict::Stuck(Joint::J3)),
            ([10.0, f64::NAN, 180.0], false, Verdict::Stuck(Joint::J2)),
            // An arm that was halted on its way is not stuck.
            ([5.0, -90.0, 180.0], true, Verdict::TooNear),
        ] {
            let [j1, j2, j3] = first_three;
            let reached = Joints::from_degrees([j1, j2, j3, 0.0, 45.0, 0.0]);
            assert_eq!(guard().judge_move(&target, &reached, near), expected);
        }
    }

    #[test]
    fn an_approach_is_too_fast_near_the_ball_only() {
        let ball = |r| Features {
            x: 96.0,
            y: 72.0,
            r,
        };
        // Up to the radius of 62 anything, beyond it up to a growth of 1.5, ends included.
        for (before, after, too_fast) in [
            (10.0, 62.0, false),
            (10.0, 62.1, true),
            (42.0, 63.0, false),
            (41.9, 63.0, true),
            (80.0, 63.0, false),
        ] {
            let judged = guard().is_too_fast(&ball(before), &ball(after));
            assert_eq!(judged, too_fast, "{before} to {after}");
        }
    }
}
