//! Supervision: whether what came of a move may go on.

use hough_heuristic::Features;
use puma_val2::{Joint, Joints};

use crate::limits::JointLimits;
use crate::run::config::{AgentConfig, ApproachLimit};

/// What the arm answered to an order to move, and what its sensors say then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// Where the arm was sent.
    pub target: Joints,
    /// Where it says it is.
    pub reached: Joints,
    /// Whether something is too near to the hand: the arm has been halted by its own guard, or its
    /// sensors say so now.
    pub near: bool,
}

/// What a move came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The arm stands where it was sent.
    There,
    /// Something is too near; the arm is stopped and goes back to where it came from.
    TooNear,
    /// The arm says that it has moved, and this joint has not got there: the run is broken off.
    Stuck(Joint),
}

/// The paper's constant control of the approach (section 2.2: collisions with unexpected objects,
/// "or a rapid approach that could damage the camera"): judges every move by what came back.
///
/// It moves nothing itself, and what it remembers it remembers from run to run.
/// [`Agent::supervised_by`](crate::Agent::supervised_by) puts another one in the place of
/// [`Guard`]. What a camera shows is supervised too, by the agent itself: see
/// [`AgentConfig::same_frames`](crate::AgentConfig::same_frames).
///
/// ```
/// use grasp_agent::hough_heuristic::Features;
/// use grasp_agent::puma_val2::Joints;
/// use grasp_agent::{Agent, AgentConfig, Arrival, Guard, JointLimits, PositionBased, ServoSettings, Supervision, Verdict};
///
/// /// As the paper's, and an upper arm that is less than 30 degrees above the level goes back.
/// #[derive(Clone, Debug)]
/// struct Steep(Guard);
///
/// impl Supervision for Steep {
///     fn limits(&self) -> &JointLimits {
///         self.0.limits()
///     }
///
///     fn judge_move(&mut self, arrival: &Arrival) -> Verdict {
///         if arrival.reached.degrees()[1] > -30.0 { Verdict::TooNear } else { self.0.judge_move(arrival) }
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
///
/// let config = AgentConfig::paper([Joints::from_degrees([0.0, -110.0, 210.0, 0.0, 45.0, 0.0])]);
/// let guard = Steep(Guard::of(&config));
/// let agent = Agent::with_controller(config, PositionBased::new(ServoSettings::paper()))?.supervised_by(guard);
/// # let _ = agent;
/// # Ok::<(), grasp_agent::AgentError>(())
/// ```
pub trait Supervision: std::fmt::Debug + Send + Sync {
    /// The range that each joint is kept in. A controller is told it, and what it decides against
    /// it is not done; viewpoints are cut to it.
    fn limits(&self) -> &JointLimits;

    /// What a move came to.
    fn judge_move(&mut self, arrival: &Arrival) -> Verdict;

    /// Whether a move that took the ball in the image from `before` to `after` came nearer too
    /// fast; then the arm goes back.
    fn is_too_fast(&mut self, before: &Features, after: &Features) -> bool;

    /// A copy, for the copies of an agent: `Box::new(self.clone())`.
    fn boxed(&self) -> Box<dyn Supervision>;
}

impl Clone for Box<dyn Supervision> {
    fn clone(&self) -> Self {
        (**self).boxed()
    }
}

/// Supervision by fixed bounds.
#[derive(Clone, Debug)]
pub struct Guard {
    limits: JointLimits,
    approach: ApproachLimit,
    reach_tolerance: f64,
}

impl Guard {
    /// A guard of these working limits, this greatest speed of approach, and so many radians that a
    /// joint may stand from where it was sent.
    pub fn new(limits: JointLimits, approach: ApproachLimit, reach_tolerance: f64) -> Self {
        Self {
            limits,
            approach,
            reach_tolerance,
        }
    }

    /// The guard that an agent with these settings has.
    pub fn of(config: &AgentConfig) -> Self {
        Self::new(config.limits, config.approach, config.reach_tolerance)
    }
}

impl Supervision for Guard {
    fn limits(&self) -> &JointLimits {
        &self.limits
    }

    fn judge_move(&mut self, arrival: &Arrival) -> Verdict {
        if arrival.near {
            return Verdict::TooNear;
        }
        let off = |joint: Joint| (arrival.reached[joint] - arrival.target[joint]).abs();
        let stuck = Joint::ALL
            .into_iter()
            .find(|joint| off(*joint).is_nan() || off(*joint) > self.reach_tolerance);
        stuck.map_or(Verdict::There, Verdict::Stuck)
    }

    fn is_too_fast(&mut self, before: &Features, after: &Features) -> bool {
        self.approach.exceeded(before.r, after.r)
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
    fn a_move_is_judged_by_sensors_and_by_where_the_arm_stands() {
        let target = Joints::from_degrees([10.0, -90.0, 180.0, 0.0, 45.0, 0.0]);
        let judged = |degrees: [f64; 6], near| {
            let reached = Joints::from_degrees(degrees);
            guard().judge_move(&Arrival {
                target,
                reached,
                near,
            })
        };
        assert_eq!(
            judged([10.9, -90.0, 180.0, 0.0, 45.0, 0.0], false),
            Verdict::There
        );
        assert_eq!(
            judged([10.0, -90.0, 178.5, 0.0, 45.0, 0.0], false),
            Verdict::Stuck(Joint::J3)
        );
        assert_eq!(
            judged([10.0, f64::NAN, 180.0, 0.0, 45.0, 0.0], false),
            Verdict::Stuck(Joint::J2)
        );
        // An arm that was halted on its way is not stuck.
        assert_eq!(
            judged([5.0, -90.0, 180.0, 0.0, 45.0, 0.0], true),
            Verdict::TooNear
        );
    }

    #[test]
    fn an_approach_is_too_fast_near_the_ball_only() {
        let ball = |r| Features {
            x: 96.0,
            y: 72.0,
            r,
        };
        assert!(!guard().is_too_fast(&ball(10.0), &ball(61.0)));
        assert!(guard().is_too_fast(&ball(40.0), &ball(63.0)));
        assert!(!guard().is_too_fast(&ball(50.0), &ball(63.0)));
    }
}
