//! The controller: estimate, plan, move, and learn from what was seen.

use hough_heuristic::Features;
use nalgebra::{Point3, SMatrix, Vector3};
use puma_val2::{Joint, JointDelta, Joints};

use crate::checked::checked;
use crate::controller::{Consequence, Controller, GaveUp, Situation};
use crate::controllers::hybrid::belief::{Belief, Prior};
use crate::controllers::hybrid::evidence::{Evidence, Links};
use crate::controllers::hybrid::fit::Fit;
use crate::controllers::hybrid::numbers::{Numbers, WITH_BALL, corrected, deviations, sensitivity};
#[cfg(feature = "serde")]
use crate::controllers::servo::settings::check_goal;
use crate::controllers::taught_goal::TaughtGoal;
use crate::limits::{JointLimits, StepLimits};
use crate::sight::camera_model::CameraModel;

/// What a [`Hybrid`] is told.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(remote = "Self")
)]
pub struct HybridSettings {
    /// The camera and the arm as they should be.
    pub nominal: CameraModel,
    /// How wrong that may be.
    pub prior: Prior,
    /// How much of that may have come about since a belief was learned that the controller begins
    /// with, as a share \[0.2\]; see [`Hybrid::with_belief`]. At 0 a camera that has been knocked
    /// in the meantime is not learned again for a long time.
    pub drift: f64,
    /// Features of the ball where it should be \[(103.5, 78, 33)\].
    pub goal: Features,
    /// The farthest that each joint turns in one cycle [[`StepLimits::paper`]].
    pub steps: StepLimits,
    /// A move is made only if the ball will still be in view when it is seen so many standard
    /// deviations off its expected place \[2\].
    pub caution: f64,
    /// Runs that are remembered, the latest ones \[400\].
    pub memory: usize,
    /// How far `JT5` turns for the grip, radians \[-18.01 degrees\].
    pub grip_turn: f64,
    /// How far `JT4` turns for the grip, radians \[0\].
    #[cfg_attr(feature = "serde", serde(default))]
    pub grip_aside: f64,
    /// Greatest uncertainty of the ball's place, metres, up to which the grip is aimed at it and
    /// not left to the agent's settings \[0.008\].
    pub grip_certainty: f64,
}

checked!(HybridSettings);

impl HybridSettings {
    /// The settings in the brackets of the fields.
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

    /// Whether they can be used; if not, why.
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
                return Err(format!("{name} is {value}; it must be finite, 0 or above"));
            }
        }
        for (name, value) in [
            ("grip_turn", self.grip_turn),
            ("grip_aside", self.grip_aside),
        ] {
            if !value.is_finite() {
                return Err(format!("{name} is {value}; it must be finite"));
            }
        }
        Ok(())
    }
}

/// Servoing by a model of the camera that is put right by what is seen.
///
/// In every cycle the ball's place and the thirteen numbers of a [`Belief`] are estimated together
/// from all sightings of the run (least squares with the belief as prior, outliers weighing less).
/// The arm then moves as far toward the pose in which the ball would stand at the goal as leaves
/// the ball in view for all that is not known for certain. While it learns, every run becomes
/// evidence for the next.
#[derive(Clone, Debug)]
pub struct Hybrid {
    settings: HybridSettings,
    /// What was believed before anything of what is remembered was seen.
    before: Belief,
    belief: Belief,
    remembered: Vec<Evidence>,
    /// Whether something is remembered that is not yet part of the belief.
    news: bool,
    current: Evidence,
    estimate: Option<Estimate>,
    learning: bool,
    boldness: f64,
    /// Losses since the last move that kept the ball in view.
    losses: usize,
    /// Whether the last sighting was far from where the ball was; it is looked for once more before
    /// that is believed.
    doubt: bool,
    /// Sightings for which a ball that has just moved is taken to be still moving.
    moving: usize,
    /// Grips in this run so far: none of them has held the ball.
    grips: i32,
}

/// The ball and the camera as they are taken to be at the moment.
#[derive(Clone, Debug)]
struct Estimate {
    numbers: Numbers,
    model: CameraModel,
    ball: Point3<f64>,
    covariance: SMatrix<f64, WITH_BALL, WITH_BALL>,
}

/// A sighting so many standard deviations off, and at least so many units, means that the ball has
/// moved.
const MOVED: (f64, f64) = (5.0, 3.0);
/// What is seen so many feature units off may be no ball at all.
const FAR_OFF: f64 = 40.0;
/// For so many sightings after it has moved, a ball that has moved again is believed at once.
const STILL_MOVING: usize = 3;
/// A ball that is shown between the jaws is in their middle to so many metres.
const SHOWN: f64 = 0.002;
/// Room to the border of the frame, feature units.
const MARGIN: f64 = 4.0;
/// Radius up to which a ball is far enough to be seen, and the largest that a move may lead to,
/// feature units.
const FAR_ENOUGH: f64 = 5.5;
const LARGEST: f64 = 55.0;
/// Shares of the way that are tried, the whole way first.
const SHARES: [f64; 9] = [1.0, 0.85, 0.7, 0.55, 0.4, 0.3, 0.2, 0.1, 0.05];
/// Least share of a way that is gone after any number of losses.
const LEAST_BOLDNESS: f64 = 1.0 / 64.0;

impl Hybrid {
    /// A controller that knows nothing but `settings`, and learns.
    pub fn new(settings: HybridSettings) -> Self {
        Self::beginning(settings, Belief::new(&settings.prior))
    }

    /// A controller that has learned before, and goes on from there: what it sees from now on is
    /// weighed against `belief`, held as firmly as [`HybridSettings::drift`] leaves it.
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

    /// The same with a goal that was shown on the arm. That the ball was between the jaws then says
    /// much of the camera: the jaws are where the arm says they are.
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

    /// The same, learning nothing from one run to the next any more.
    #[must_use]
    pub fn frozen(mut self) -> Self {
        self.learning = false;
        self
    }

    /// The settings.
    pub fn settings(&self) -> &HybridSettings {
        &self.settings
    }

    /// What is believed of the camera, the ball and the gears.
    pub fn belief(&self) -> &Belief {
        &self.belief
    }

    /// Takes what was seen of one ball in one place as evidence for the runs to come.
    fn remember(&mut self) {
        // One sighting says where the ball is, and nothing of the camera.
        if self.learning && self.current.len() >= 2 {
            self.remembered.push(self.current.clone());
            self.news = true;
            let forgotten = self.remembered.len().saturating_sub(self.settings.memory);
            self.remembered.drain(..forgotten);
        }
    }

    /// Where camera and ball are, from everything seen in this run.
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

    /// How far off the ball is seen, feature units, if it cannot be where it was.
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

    /// The longest way toward the goal after which the ball is in view for certain.
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
        // On its line in the image at the distance it has: where to bring a ball that cannot be
        // approached yet.
        let aside = Point3::from(goal.coords * (here.z / goal.z));
        // A ball that is hardly large enough to be seen must not become smaller.
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

    /// The move to `motors` with each joint's turn cut to what a cycle allows, within the limits;
    /// NaN stays NaN.
    fn cut(&self, motors: &Joints, from: &Joints, limits: &JointLimits) -> JointDelta {
        let target = limits.nearest(motors);
        JointDelta(std::array::from_fn(|i| {
            match self.settings.steps.0.get(i) {
                // Not `min` and `max`, which make a whole step of NaN, nor `clamp`, which panics on
                // a step that is NaN.
                Some(most) => match target.0[i] - from.0[i] {
                    turn if turn.abs() <= *most => turn,
                    turn if turn.abs() > *most => most.copysign(turn),
                    _ => f64::NAN,
                },
                None => 0.0,
            }
        }))
    }

    /// Whether the ball will be in view for all that is not known for certain, with a radius of at
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
            // As evidence it would make everything learned NaN.
            return Err(GaveUp::NoMoveLeft);
        }
        let off = self.surprise(&now.features);
        let odd = off.is_some();
        if off.is_some_and(|off| off > FAR_OFF) && !self.doubt && self.moving == 0 {
            // A circle that is not the ball, perhaps: the arm stays, and looks again.
            self.doubt = true;
            return Ok(JointDelta::default());
        }
        self.doubt = false;
        self.moving = if odd {
            STILL_MOVING
        } else {
            self.moving.saturating_sub(1)
        };
        // A ball that was lost twice, though it should have stayed in view for certain, is not
        // where it was taken to be.
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
            // What cannot be explained together is not explained; this sighting alone always is.
            self.current.forget_sightings();
            self.current.saw(now.features);
            self.estimate = self.estimate();
        }
        let estimate = self.estimate.as_ref().ok_or(GaveUp::NoMoveLeft)?;
        self.plan(estimate, now, limits).ok_or(GaveUp::NoMoveLeft)
    }

    fn judge(&mut self, consequence: &Consequence) {
        if *consequence == Consequence::Missed {
            // What was seen before was seen of a ball in another place.
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
        // What the agent's settings have missed once they miss again.
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
    fn a_turn_is_cut_to_a_step_and_what_is_no_number_stays_none() {
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
    fn what_is_no_number_is_no_evidence() {
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
