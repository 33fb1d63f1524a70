//! The servo controller: one of several laws, and the care that all of them take.

use nalgebra::{Matrix3, Vector3};
use puma_val2::{JointDelta, Joints};
use serde::{Deserialize, Serialize};

use crate::controller::SavedController;
use crate::controller::{Controller, Decision, Feedback, GaveUp, Request};
use crate::controllers::servo::fuzzy::Rules;
use crate::controllers::servo::look_ahead::LookAhead;
use crate::controllers::servo::settings::ServoSettings;
use crate::percept::Sighting;

/// Law by which a [`Servo`] computes its moves: the alternatives that the paper names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ServoLaw {
    /// Position-based visual servoing (Hutchinson, Hager, Corke 1996, section V): locates the ball
    /// by the camera model, and removes the error of the arm's pose in joint space.
    PositionBased,
    /// Image-based visual servoing (the same, section VI) on centre and radius: removes the error
    /// in the image through the inverse of the image Jacobian at the present pose.
    ImageBased,
    /// Image-based visual servoing with the Jacobian at [`ServoSettings::GOAL_POSE`], which is
    /// constant.
    ImageBasedAtGoal,
    /// Fuzzy control of the Takagi-Sugeno kind, the paper's "alternative AI method" (section 1).
    ///
    /// The radius is *tiny*, *small*, *right* or *large*, in triangles that overlap. Each of them
    /// has its own linear rule from the errors in x, y and 1/r to joint turns, and the rules act in
    /// proportion to the degree to which their condition holds. A second set of rules gates the
    /// approach: the farther the ball is from its line in the image, the less it is approached.
    Fuzzy,
    /// Look-ahead by one move: tries all 9 x 81 moves of the paper's behaviours in the camera model
    /// and makes the one after which the ball would be nearest to the goal. Gain and step limits
    /// are not used.
    ///
    /// *Nearest* means the least sum of squared errors in x, y and the logarithm of r, in half
    /// widths of the goal intervals, the last one weighted to count like the others at the goal. A
    /// move that lost the ball or was taken back is not made again from the same pose in the same
    /// run.
    LookAhead,
}

/// A controller that computes its moves from a [`CameraModel`](crate::CameraModel) and does not
/// learn.
///
/// A move that lost the ball or was taken back halves the following moves. Every other move
/// lengthens them by half, up to their full length. Otherwise the same move would lose the ball
/// again after each recovery.
#[derive(Clone, Debug)]
pub struct Servo {
    law: ServoLaw,
    settings: ServoSettings,
    state: State,
    /// Fraction of each computed move that is made, 0..=1.
    boldness: f64,
}

/// Data of the laws that need some.
#[derive(Clone, Debug)]
enum State {
    None,
    /// Jacobian at the goal pose, if there is one.
    Jacobian(Option<Matrix3<f64>>),
    Rules(Rules),
    LookAhead(LookAhead),
}

impl Servo {
    /// Creates a servo controller.
    pub fn new(law: ServoLaw, settings: ServoSettings) -> Self {
        let state = match law {
            ServoLaw::PositionBased | ServoLaw::ImageBased => State::None,
            ServoLaw::ImageBasedAtGoal => {
                let pose = Joints::from_degrees(ServoSettings::GOAL_POSE);
                let ball = settings.model.locate(&pose, &settings.goal);
                State::Jacobian(ball.and_then(|ball| settings.model.image_jacobian(&pose, &ball)))
            }
            ServoLaw::Fuzzy => State::Rules(Rules::new(&settings)),
            ServoLaw::LookAhead => State::LookAhead(LookAhead::new()),
        };
        Self {
            law,
            settings,
            state,
            boldness: 1.0,
        }
    }

    /// Returns the turns of `JT1` to `JT3` that remove the share `gain` of the error.
    fn wanted(&self, ball: &Sighting, joints: &Joints) -> Option<[f64; 3]> {
        let ServoSettings {
            model, goal, gain, ..
        } = &self.settings;
        let seen = ball.features;
        let jacobian = match &self.state {
            State::Rules(rules) => return rules.turns(&self.settings, &seen),
            State::Jacobian(jacobian) => *jacobian,
            _ => {
                let place = model.locate(joints, &seen)?;
                if self.law == ServoLaw::PositionBased {
                    let (target, _) = model.pose_showing(&place, goal, joints)?;
                    return Some(std::array::from_fn(|i| gain * (target.0[i] - joints.0[i])));
                }
                model.image_jacobian(joints, &place)
            }
        };
        let error = Vector3::new(goal.x - seen.x, goal.y - seen.y, goal.r - seen.r);
        Some((turns(&jacobian?, &error)? * *gain).into())
    }
}

/// Returns the joint turns that remove `error` where the image changes by `jacobian`: damped least
/// squares, which stay finite near a singular pose.
pub(crate) fn turns(jacobian: &Matrix3<f64>, error: &Vector3<f64>) -> Option<Vector3<f64>> {
    const DAMPING: f64 = 1.0;
    let normal = jacobian.transpose() * jacobian + Matrix3::identity() * DAMPING;
    normal
        .cholesky()
        .map(|c| c.solve(&(jacobian.transpose() * error)))
}

impl Controller for Servo {
    fn decide(&mut self, ball: &Sighting, request: &Request) -> Result<Decision, GaveUp> {
        if request.grip {
            return Err(GaveUp::NoMoveLeft);
        }
        let Request { joints, limits, .. } = request;
        let delta = if let State::LookAhead(look_ahead) = &mut self.state {
            look_ahead.best(&self.settings, &ball.features, joints, limits)
        } else {
            self.wanted(ball, joints).map(|wanted| {
                let whole = limits.step(joints, wanted, &self.settings.steps);
                JointDelta(whole.0.map(|turn| turn * self.boldness))
            })
        };
        delta.map(Decision::Move).ok_or(GaveUp::NoMoveLeft)
    }

    fn notice(&mut self, feedback: &Feedback) {
        self.boldness = match feedback {
            Feedback::Begin => 1.0,
            Feedback::Seen { .. } => (1.5 * self.boldness).min(1.0),
            Feedback::Lost | Feedback::TakenBack => (0.5 * self.boldness).max(1.0 / 64.0),
            _ => self.boldness,
        };
        if let State::LookAhead(look_ahead) = &mut self.state {
            look_ahead.notice(feedback);
        }
    }

    fn describe(&self) -> &str {
        match self.law {
            ServoLaw::PositionBased => "position-based",
            ServoLaw::ImageBased => "image-based, current J",
            ServoLaw::ImageBasedAtGoal => "image-based, goal J",
            ServoLaw::Fuzzy => "fuzzy",
            ServoLaw::LookAhead => "look-ahead",
        }
    }

    fn save(&self) -> Option<SavedController> {
        SavedController::new("servo", (self.law, self.settings))
    }
}
