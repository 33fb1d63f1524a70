//! The hybrid controller: estimate, plan, move, learn.

use hough_heuristic::Features;
use nalgebra::{Point3, SMatrix, Vector3};
use puma_val2::{Joint, JointDelta, Joints};

use crate::checked::checked;
use crate::controller::{Consequence, Controller, GaveUp, Situation};
use crate::controllers::hybrid::belief::{Belief, Prior};
use crate::controllers::hybrid::evidence::{Evidence, Links};
use crate::controllers::hybrid::fit::Fit;
use crate::controllers::hybrid::parameters::{
    Numbers, WITH_BALL, corrected, deviations, sensitivity,
};
#[cfg(feature = "serde")]
use crate::controllers::servo::settings::check_goal;
use crate::controllers::taught_goal::TaughtGoal;
use crate::limits::{JointLimits, StepLimits};
use crate::sight::camera_model::CameraModel;

/// Settings of a [`Hybrid`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(remote = "Self")
)]
pub struct HybridSettings {
    /// Nominal camera and arm.
    pub nominal: CameraModel,
    /// Expected errors of the nominal model.
    pub prior: Prior,
    /// Fraction of the prior uncertainty added back when a saved belief is loaded, 0..=1 \[0.2\].
    /// Larger values re-learn a knocked camera sooner; see [`Hybrid::with_belief`].
    pub drift: f64,
    /// Features of the ball at the goal \[(103.5, 78, 33)\].
    pub goal: Features,
    /// Largest turn of each joint in one move [[`StepLimits::paper`]].
    pub steps: StepLimits,
    /// Margin to the frame's border, in standard deviations of the predicted image place \[2\].
    pub caution: f64,
    /// Number of latest runs kept as evidence \[400\].
    pub memory: usize,
    /// Turn of `JT5` for the grip, radians \[-18.01 degrees\].
    pub grip_turn: f64,
    /// Turn of `JT4` for the grip, radians \[0\].
    #[cfg_attr(feature = "serde", serde(default))]
    pub grip_aside: f64,
    /// Largest standard deviation of the ball's place, metres, at which the controller aims the
    /// grip itself \[0.008\]. Above it the agent's configured grip is used.
    pub grip_certainty: f64,
}

checked!(HybridSettings);

impl HybridSettings {
    /// Returns the defaults in the brackets of the fields.
    pub fn paper() -> Self {
        Self {
            nominal: CameraModel::paper(),
            prior: Prior::by_eye(),
            drift: 0.2,
            goal: Features {
                x: 103.5,
                y: 78.0,
                r: 33.0,
            },
            steps: StepLimits::paper(),
            caution: 2.0,
            memory: 400,
            grip_turn: -18.01_f64.to_radians(),
            grip_aside: 0.0,
            grip_certainty: 0.008,
        }
    }

    /// Validates the settings.
    #[cfg(feature = "serde")]
    pub(crate) fn check(&self) -> Result<(), String> {
        self.nominal.check()?;
        self.prior.check()?;
        check_goal(&self.goal)?;
        self.steps.check()?;
        for (name, value) in [
            ("drift", self.drift),
            ("caution", self.caution),
            ("grip_certainty", self.grip_certainty),
        ] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(format!(
                    "{name} is {value}; expected a finite number, 0 or more"
                ));
            }
        }
        for (name, value) in [
            ("grip_turn", self.grip_turn),
            ("grip_aside", self.grip_aside),
        ] {
            if !value.is_finite() {
                return Err(format!("{name} is {value}; expected a finite number"));
            }
        }
        Ok(())
    }
}

/// Visual servoing with a camera model that is calibrated from the sightings.
///
/// Each cycle estimates the ball's place and the thirteen parameters of a [`Belief`] from all
/// sightings of the run (robust least squares, with the belief as prior). The arm then moves towards
/// the goal pose, as far as the ball stays in view under the remaining uncertainty. A learning
/// hybrid uses every run as evidence for the next.
#[derive(Clone, Debug)]
pub struct Hybrid {
    settings: HybridSettings,
    /// Belief before the remembered runs.
    before: Belief,
    belief: Belief,
    remembered: Vec<Evidence>,
    /// Set while a remembered run is not yet part of the belief.
    news: bool,
    current: Evidence,
    estimate: Option<Estimate>,
    learning: bool,
    boldness: f64,
    /// Losses since the last move that kept the ball in view.
    losses: usize,
    /// Set after a sighting far from the expected place; a second one confirms it.
    doubt: bool,
    /// Remaining sightings for which a ball that has moved counts as moving.
    moving: usize,
    /// Grips in this run so far; none has held the ball.
    grips: i32,
}

/// Current estimate of ball and camera.
#[derive(Clone, Debug)]
struct Estimate {
    numbers: Numbers,
    model: CameraModel,
    ball: Point3<f64>,
    covariance: SMatrix<f64, WITH_BALL, WITH_BALL>,
}

/// Distance from the expected place at which the ball has moved: standard deviations, and a least
/// number of feature units.
const MOVED: (f64, f64) = (5.0, 3.0);
/// Distance from the expected place at which a sighting needs confirmation, feature units.
const FAR_OFF: f64 = 40.0;
/// Number of sightings after a movement in which another one needs no confirmation.
const STILL_MOVING: usize = 3;
/// Standard deviation of a ball held between the jaws from their middle, metres.
const SHOWN: f64 = 0.002;
/// Margin to the border of the frame, feature units.
const MARGIN: f64 = 4.0;
/// Radius at which the ball is still detected reliably, feature units.
const FAR_ENOUGH: f64 = 5.5;
/// Largest radius that a move may lead to, feature units.
const LARGEST: f64 = 55.0;
/// Fractions of the way that are tried, in order.
const SHARES: [f64; 9] = [1.0, 0.85, 0.7, 0.55, 0.4, 0.3, 0.2, 0.1, 0.05];
/// Smallest fraction of the way, after any number of losses.
const LEAST_BOLDNESS: f64 = 1.0 / 64.0;

impl Hybrid {
    /// Creates a learning controller that starts from the prior.
    pub fn new(settings: HybridSettings) -> Self {
        Self::beginning(settings, Belief::new(&settings.prior))
    }

    /// Creates a learning controller that starts from a saved belief, loosened by
    /// [`HybridSettings::drift`].
    pub fn with_belief(settings: HybridSettings, belief: Belief) -> Self {
        Self::beginning(settings, belief.loosened(&settings.prior, settings.drift))
    }

    fn beginning(settings: HybridSettings, belief: Belief) -> Self {
        Self {
            settings,
            before: belief.clone(),
            belief,
            remembered: Vec::new(),
            news: false,
            current: Evidence::default(),
            estimate: None,
            learning: true,
            boldness: 1.0,
            losses: 0,
            doubt: false,
            moving: 0,
            grips: 0,
        }
    }

    /// Sets a goal that was taught on the arm. The taught grip also calibrates the camera, since the
    /// ball was between the jaws, whose place the arm reports.
    #[must_use]
    pub fn shown(mut self, goal: &TaughtGoal) -> Self {
        let (nominal, from) = (&self.settings.nominal, goal.seen_from());
        let ball = nominal.tool_point(&(from + goal.grip()));
        let seen =
            |belief: Belief| belief.having_seen(nominal, &from, (&ball, SHOWN), &goal.features());
        (self.before, self.belief) = (seen(self.before), seen(self.belief));
        self.settings.goal = goal.features();
        self.settings.grip_turn = goal.grip()[Joint::J5];
        self.settings.grip_aside = goal.grip()[Joint::J4];
        self
    }

    /// Stops learning from one run to the next.
    #[must_use]
    pub fn frozen(mut self) -> Self {
        self.learning = false;
        self
    }

    /// Returns the settings.
    pub fn settings(&self) -> &HybridSettings {
        &self.settings
    }

    /// Returns the belief about camera, ball and gears.
    pub fn belief(&self) -> &Belief {
        &self.belief
    }

    /// Keeps the sightings of one ball in one place as evidence for later runs.
    fn remember(&mut self) {
        // A single sighting determines the ball's place and nothing of the camera.
        if self.learning && self.current.len() >= 2 {
            self.remembered.push(self.current.clone());
            self.news = true;
            let forgotten = self.remembered.len().saturating_sub(self.settings.memory);
            self.remembered.drain(..forgotten);
        }
    }

    /// Estimates camera and ball from all sightings of this run.
    fn estimate(&mut self) -> Option<Estimate> {
        let start = self
            .estimate
            .as_ref()
            .map_or_else(|| self.belief.numbers(), |e| e.numbers);
        let fit = Fit::of(
            &self.belief,
            &start,
            &self.settings.nominal,
            &[&self.current],
        )?;
        let ball = fit.balls.last().copied().flatten()?;
        Some(Estimate {
            model: corrected(&self.settings.nominal, &fit.numbers),
            numbers: fit.numbers,
            covariance: fit.with_last_ball.try_inverse()?,
            ball,
        })
    }

    /// Returns the distance from the expected place, feature units, if the ball has moved.
    fn surprise(&self, seen: &Features) -> Option<f64> {
        let estimate = self.estimate.as_ref()?;
        if self.current.len() == 0 {
            return None;
        }
        let view = |numbers: &Numbers, ball: &Point3<f64>| {
            let links = self.current.links(numbers);
            corrected(&self.settings.nominal, numbers).view(links.stand(), ball)
        };
        let Some((expected, by_all)) = sensitivity(&estimate.numbers, &estimate.ball, view) else {
            return Some(f64::INFINITY);
        };
        let unsure = deviations(&by_all, &estimate.covariance);
        let off = Vector3::new(
            seen.x - expected.x,
            seen.y - expected.y,
            seen.r - expected.r,
        );
        let moved = (0..3)
            .any(|i| off[i].abs() > MOVED.1.max(MOVED.0 * unsure[i].hypot(self.belief.noise())));
        moved.then(|| off.norm())
    }

    /// Plans the longest move towards the goal that keeps the ball in view.
    fn plan(
        &self,
        estimate: &Estimate,
        now: &Situation,
        limits: &JointLimits,
    ) -> Option<JointDelta> {
        let model = &estimate.model;
        let links = self.current.links(&estimate.numbers);
        let camera = model.arm.wrist(links.stand()) * model.mount;
        let here = camera.inverse_transform_point(&estimate.ball);
        let goal = model.in_camera(&self.settings.goal)?;
        // The goal's image place at the present distance, for a ball that cannot be approached yet.
        let aside = Point3::from(goal.coords * (here.z / goal.z));
        // A ball at the limit of detection must not become smaller.
        let least = model
            .outline(&here)
            .map_or(FAR_ENOUGH, |f| f.r.min(FAR_ENOUGH));
        let ways = [goal, aside].map(|target| SHARES.map(|share| (target, share)));
        let mut last = None;
        for (target, share) in ways.into_iter().flatten() {
            let wanted = here + (target - here) * (share * self.boldness);
            let (stand, _) = model.pose_placing(&estimate.ball, &wanted, links.stand());
            let motors = links.motors_for(&stand, &now.joints);
            let delta = self.cut(&motors, &now.joints, limits);
            last = Some(delta);
            if self.stays_in_view(estimate, &(now.joints + delta), least) {
                break;
            }
        }
        last
    }

    /// Returns the move to `motors`, cut to the step limits and the joint limits. NaN stays NaN.
    fn cut(&self, motors: &Joints, from: &Joints, limits: &JointLimits) -> JointDelta {
        let target = limits.nearest(motors);
        JointDelta(std::array::from_fn(|i| {
            match self.settings.steps.0.get(i) {
                // `min` and `max` turn NaN into a whole step; `clamp` panics on a NaN bound.
                Some(most) => match target.0[i] - from.0[i] {
                    turn if turn.abs() <= *most => turn,
                    turn if turn.abs() > *most => most.copysign(turn),
                    _ => f64::NAN,
                },
                None => 0.0,
            }
        }))
    }

    /// Returns whether the ball stays in view within the margin of uncertainty, with a radius of at
    /// least `least` units.
    fn stays_in_view(&self, estimate: &Estimate, motors: &Joints, least: f64) -> bool {
        let view = |numbers: &Numbers, ball: &Point3<f64>| {
            let mut links: Links = self.current.links(numbers);
            links.follow(motors);
            corrected(&self.settings.nominal, numbers).view(links.stand(), ball)
        };
        let Some((f, by_all)) = sensitivity(&estimate.numbers, &estimate.ball, view) else {
            return false;
        };
        let room = deviations(&by_all, &estimate.covariance) * self.settings.caution;
        let inside = |v: f64, room: f64, low: f64, high: f64| v - room >= low && v + room <= high;
        inside(f.x, room[0], MARGIN, Features::WIDTH - MARGIN)
            && inside(f.y, room[1], MARGIN, Features::HEIGHT - MARGIN)
            && f.r >= least
            && f.r + room[2] <= LARGEST
    }
}

impl Controller for Hybrid {
    fn name(&self) -> &str {
        "hybrid"
    }

    fn begin(&mut self) {
        self.current = Evidence::default();
        self.estimate = None;
        self.boldness = 1.0;
        self.losses = 0;
        self.doubt = false;
        self.moving = 0;
        self.grips = 0;
    }

    fn arm_at(&mut self, joints: &Joints) {
        self.current.arm_at(joints);
    }

    fn decide(&mut self, now: &Situation, limits: &JointLimits) -> Result<JointDelta, GaveUp> {
        if !now.is_finite() {
            // As evidence, NaN would spread to the whole belief.
            return Err(GaveUp::NoMoveLeft);
        }
        let off = self.surprise(&now.features);
        let odd = off.is_some();
        if off.is_some_and(|off| off > FAR_OFF) && !self.doubt && self.moving == 0 {
            // Possibly a false circle: stay and look again.
            self.doubt = true;
            return Ok(JointDelta::default());
        }
        self.doubt = false;
        self.moving = if odd {
            STILL_MOVING
        } else {
            self.moving.saturating_sub(1)
        };
        // Two losses of a ball that should have stayed in view: the estimate is wrong.
        let mistaken = self.losses >= 2;
        if odd || mistaken {
            if !mistaken {
                self.remember();
            }
            self.current.forget_sightings();
            self.estimate = None;
        }
        self.current.saw(now.features);
        self.estimate = self.estimate();
        if self.estimate.is_none() {
            // The sightings contradict one another: start again from the latest.
            self.current.forget_sightings();
            self.current.saw(now.features);
            self.estimate = self.estimate();
        }
        let estimate = self.estimate.as_ref().ok_or(GaveUp::NoMoveLeft)?;
        self.plan(estimate, now, limits).ok_or(GaveUp::NoMoveLeft)
    }

    fn judge(&mut self, consequence: &Consequence) {
        if *consequence == Consequence::Missed {
            // The miss may have moved the ball.
            self.remember();
            self.current.forget_sightings();
            self.estimate = None;
            return;
        }
        (self.boldness, self.losses) = match consequence {
            Consequence::Seen(_) => ((1.5 * self.boldness).min(1.0), 0),
            Consequence::Lost => ((0.5 * self.boldness).max(LEAST_BOLDNESS), self.losses + 1),
            Consequence::TakenBack => ((0.5 * self.boldness).max(LEAST_BOLDNESS), self.losses),
            Consequence::Missed => (self.boldness, self.losses),
        };
    }

    fn grip(&mut self, now: &Situation, limits: &JointLimits) -> Option<JointDelta> {
        if !now.is_finite() {
            return None;
        }
        self.current.saw(now.features);
        self.estimate = self.estimate();
        let estimate = self.estimate.as_ref()?;
        let uncertainty: f64 = (WITH_BALL - 3..WITH_BALL)
            .map(|i| estimate.covariance[(i, i)])
            .sum();
        // The configured grip has missed; accept a less certain aim each time.
        let enough = self.settings.grip_certainty * 4_f64.powi(self.grips);
        self.grips = (self.grips + 1).min(10);
        if uncertainty.sqrt() > enough {
            return None;
        }
        let links = self.current.links(&estimate.numbers);
        let mut from = *links.stand();
        from.0[Joint::J5.index()] += self.settings.grip_turn;
        from.0[Joint::J4.index()] += self.settings.grip_aside;
        let stand = estimate.model.pose_gripping(&estimate.ball, &from)?;
        let motors = links.motors_for(&stand, &now.joints);
        limits.admit(&motors).then(|| motors - now.joints)
    }

    fn end(&mut self) {
        self.remember();
        if !self.learning || !std::mem::take(&mut self.news) {
            return;
        }
        let all: Vec<&Evidence> = self.remembered.iter().collect();
        let before = self.before.clone().with_noise(self.belief.noise());
        if let Some(fit) = Fit::of(
            &before,
            &self.belief.numbers(),
            &self.settings.nominal,
            &all,
        ) {
            self.belief = fit.belief(fit.noise().unwrap_or(self.belief.noise()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_cut_to_steps_and_nan_stays_nan() {
        let (hybrid, limits) = (Hybrid::new(HybridSettings::paper()), JointLimits::paper());
        let from = Joints::from_degrees([0.0, -80.0, 190.0, 0.0, 45.0, 0.0]);
        let cut = |turn: f64, hybrid: &Hybrid| {
            let delta = hybrid.cut(&(from + JointDelta::of(Joint::J1, turn)), &from, &limits);
            (delta[Joint::J1], limits.admit(&(from + delta)))
        };
        let step = 5_f64.to_radians();
        for (turn, expected) in [(0.01, 0.01), (1.0, step), (-1.0, -step)] {
            let (turned, admitted) = cut(turn, &hybrid);
            assert!((turned - expected).abs() < 1e-12 && admitted, "{turned}");
        }
        assert!(!cut(f64::NAN, &hybrid).1);
        let mut endless = HybridSettings::paper();
        endless.steps.0[0] = f64::NAN;
        assert!(!cut(0.01, &Hybrid::new(endless)).1);
    }

    #[test]
    fn nan_is_never_evidence() {
        let limits = JointLimits::paper();
        let seen = Situation {
            long_axis: None,
            features: Features {
                x: 80.0,
                y: 60.0,
                r: 15.0,
            },
            joints: Joints::from_degrees([0.0, -80.0, 190.0, 0.0, 45.0, 0.0]),
        };
        let mut hybrid = Hybrid::new(HybridSettings::paper());
        let learned = |hybrid: &mut Hybrid, unseen: bool| {
            hybrid.begin();
            let mut now = seen;
            for _ in 0..3 {
                hybrid.arm_at(&now.joints);
                now.joints = now.joints + hybrid.decide(&now, &limits).unwrap();
            }
            if unseen {
                for features in [f64::NAN, f64::INFINITY].map(|x| Features { x, ..now.features }) {
                    let nothing = Situation { features, ..now };
                    assert_eq!(hybrid.decide(&nothing, &limits), Err(GaveUp::NoMoveLeft));
                    assert_eq!(hybrid.grip(&nothing, &limits), None);
                }
            }
            hybrid.end();
            hybrid.belief().clone()
        };
        let as_well = learned(&mut hybrid.clone(), false);
        assert_ne!(as_well, *hybrid.belief());
        assert_eq!(learned(&mut hybrid, true), as_well);
    }
}
