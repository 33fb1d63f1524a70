//! The servo controller: one of several laws, and the care that all of them take.

use nalgebra::{Matrix3, Vector3};
use puma_val2::{JointDelta, Joints};
use serde::{Deserialize, Serialize};

use crate::controller::SavedController;
use crate::controller::{Controller, Decision, Feedback, GaveUp, Request};
use crate::controllers::servo::fuzzy;
use crate::controllers::servo::gain_schedule::Schedule;
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
    /// Image-based visual servoing with the Jacobian at the pose of the goal
    /// ([`ServoSettings::poses`]), which is constant.
    ImageBasedAtGoal,
    /// Image-based visual servoing on the features of a sphere, (x/r, y/r, 1/r), in which the
    /// distance is linear (Chaumette 1990), with their Jacobian at that pose.
    Sphere,
    /// The features of [`ServoLaw::Sphere`] with a Jacobian that Broyden's rank-one update
    /// corrects by each move (Jägersand, Fuentes, Nelson 1997). It begins each run anew.
    Broyden,
    /// Gain-scheduled image-based servoing. The radius is *tiny*, *small*, *right* or *large*, in
    /// triangles that overlap. Each of them has its own linear law from the errors in x, y and 1/r
    /// to joint turns, of the model's Jacobian there, and the laws are blended by these degrees.
    /// The farther the ball is from its line in the image, the less it is approached.
    #[serde(alias = "Fuzzy")]
    GainScheduled,
    /// Fuzzy control by a rule base, the paper's "alternative AI method" (section 1): triangular
    /// sets of the errors in x and y and of the distance, and a table of 20 rules for each joint,
    /// with Sugeno's inference of order 0. The camera model is not used.
    FuzzyRules,
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
    /// Jacobian at the goal pose, and the present one with the last pose and features of a run.
    Broyden(Option<Matrix3<f64>>, Option<Secant>),
    Schedule(Schedule),
    LookAhead(LookAhead),
}

/// A Jacobian that follows what is seen.
#[derive(Clone, Copy, Debug)]
struct Secant {
    jacobian: Matrix3<f64>,
    joints: Joints,
    features: Vector3<f64>,
}

impl Secant {
    /// Takes the last move into the Jacobian. Small moves, which noise outweighs, count less.
    fn learned(&self, joints: &Joints, features: Vector3<f64>) -> Matrix3<f64> {
        const SMALL: f64 = 0.02;
        let moved = Vector3::from_fn(|i, _| joints.0[i] - self.joints.0[i]);
        let unforeseen = features - self.features - self.jacobian * moved;
        self.jacobian + unforeseen * moved.transpose() / (moved.norm_squared() + SMALL * SMALL)
    }
}

impl Servo {
    /// Creates a servo controller.
    pub fn new(law: ServoLaw, settings: ServoSettings) -> Self {
        let at_goal = || {
            let [.., pose, _] = settings.poses;
            let ball = settings.model.locate(&pose, &settings.goal)?;
            settings.model.image_jacobian(&pose, &ball)
        };
        let state = match law {
            ServoLaw::PositionBased | ServoLaw::ImageBased | ServoLaw::FuzzyRules => State::None,
            ServoLaw::ImageBasedAtGoal => State::Jacobian(at_goal()),
            ServoLaw::Sphere => State::Jacobian(at_goal().map(|j| settings.by_sphere(&j))),
            ServoLaw::Broyden => State::Broyden(at_goal().map(|j| settings.by_sphere(&j)), None),
            ServoLaw::GainScheduled => State::Schedule(Schedule::new(&settings)),
            ServoLaw::LookAhead => State::LookAhead(LookAhead::new()),
        };
        Self {
            law,
            settings,
            state,
            boldness: 1.0,
        }
    }

    /// Returns the turns of `JT1` to `JT3` that remove the share of the error that the gain says.
    fn wanted(&mut self, ball: &Sighting, joints: &Joints) -> Option<[f64; 3]> {
        let ServoSettings { model, goal, .. } = &self.settings;
        let seen = ball.features;
        let error = match self.law {
            ServoLaw::Sphere | ServoLaw::Broyden => {
                self.settings.sphere(goal) - self.settings.sphere(&seen)
            }
            _ => Vector3::new(goal.x - seen.x, goal.y - seen.y, goal.r - seen.r),
        };
        let whole = match &mut self.state {
            State::Schedule(schedule) => schedule.turns(&self.settings, &seen)?,
            State::Jacobian(jacobian) => turns(&(*jacobian)?, &error)?,
            State::Broyden(begun, secant) => {
                let features = self.settings.sphere(&seen);
                let jacobian = match secant {
                    Some(secant) => secant.learned(joints, features),
                    None => (*begun)?,
                };
                *secant = Some(Secant {
                    jacobian,
                    joints: *joints,
                    features,
                });
                turns(&jacobian, &error)?
            }
            _ if self.law == ServoLaw::FuzzyRules => fuzzy::turns(goal, &seen)?,
            _ => {
                let place = model.locate(joints, &seen)?;
                if self.law == ServoLaw::PositionBased {
                    let (target, _) = model.pose_showing(&place, goal, joints)?;
                    Vector3::from_fn(|i, _| target.0[i] - joints.0[i])
                } else {
                    turns(&model.image_jacobian(joints, &place)?, &error)?
                }
            }
        };
        Some((whole * self.settings.gain_at(error.amax() / goal.r)).into())
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
        match (&mut self.state, feedback) {
            (State::LookAhead(look_ahead), _) => look_ahead.notice(feedback),
            (State::Broyden(_, secant), Feedback::Begin) => *secant = None,
            _ => {}
        }
    }

    fn describe(&self) -> &str {
        match self.law {
            ServoLaw::PositionBased => "position-based",
            ServoLaw::ImageBased => "image-based, current J",
            ServoLaw::ImageBasedAtGoal => "image-based, goal J",
            ServoLaw::Sphere => "image-based, sphere",
            ServoLaw::Broyden => "Broyden",
            ServoLaw::GainScheduled => "gain-scheduled",
            ServoLaw::FuzzyRules => "fuzzy rules",
            ServoLaw::LookAhead => "look-ahead",
        }
    }

    fn save(&self) -> Option<SavedController> {
        SavedController::new("servo", (self.law, self.settings))
    }
}
