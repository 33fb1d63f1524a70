//! The hybrid controller: estimate, plan, move, learn.

use hough_heuristic::Features;
use nalgebra::Point3;
use puma_val2::{JointDelta, Joints};

use crate::controller::SavedController;
use crate::controller::{Controller, Decision, Feedback, GaveUp, Request};
use crate::controllers::hybrid::belief::Belief;
use crate::controllers::hybrid::evidence::{Evidence, Links};
use crate::controllers::hybrid::fit::Fit;
use crate::controllers::hybrid::misfit::Misfit;
use crate::controllers::hybrid::parameters::{
    Numbers, WithBall, corrected, deviations, sensitivity, vector,
};
use crate::controllers::hybrid::settings::HybridSettings;
use crate::controllers::taught_goal::TaughtGoal;
use crate::limits::JointLimits;
use crate::percept::Sighting;
use crate::sight::camera_model::CameraModel;

mod aiming;
mod learning;
#[cfg(test)]
mod tests;

/// Visual servoing with a camera model that is calibrated from the sightings.
///
/// Each cycle estimates the ball's place and the eighteen parameters of a [`Belief`] from all
/// sightings of the run (robust least squares, with the belief as prior). The arm then moves
/// towards the goal pose, as far as the ball stays in view under the remaining uncertainty. A
/// learning hybrid uses every run as evidence for the next.
#[derive(Clone, Debug)]
pub struct Hybrid {
    settings: HybridSettings,
    /// Belief before the remembered runs.
    before: Belief,
    belief: Belief,
    remembered: Vec<Evidence>,
    /// All sightings of the run before.
    recent: Evidence,
    /// `true` if the last run has shown that the camera had slipped.
    slipped: bool,
    /// Number of latest runs, in order, that the model fitted.
    calm: usize,
    /// Causes of a misfit that were found last, in order.
    causes: Vec<Misfit>,
    /// Set while a remembered run is not yet part of the belief.
    news: bool,
    learning: bool,
    /// `true` if a goal was taught, whose grip is right.
    shown: bool,
    run: Run,
}

/// State of one run.
#[derive(Clone, Debug)]
struct Run {
    evidence: Evidence,
    /// All sightings of the run, as of a ball at rest.
    record: Evidence,
    misfit: Option<Misfit>,
    /// Sighting after the last move, until a decision is asked for. There is none at the goal, and
    /// evidence without its best sightings is biased away from the goal.
    seen: Option<Features>,
    estimate: Option<Estimate>,
    /// Fraction of the planned moves that is made.
    boldness: f64,
    /// Losses since the last move that kept the ball in view, and all of them.
    losses: [usize; 2],
    /// Set after a sighting far from the expected place; a second one confirms it.
    doubt: bool,
    /// Remaining sightings for which a ball that has moved counts as moving.
    moving: usize,
    /// Grips so far; none has held the ball.
    grips: i32,
    /// `true` if the last grip was aimed here, and if that one has missed.
    aimed: bool,
    missed: bool,
    /// Own aims that have missed.
    misses: usize,
    /// `true` if the first one was certain.
    sure: bool,
    /// Decisions in a row to stay, away from the goal.
    stays: usize,
}

impl Default for Run {
    fn default() -> Self {
        Self {
            evidence: Evidence::default(),
            record: Evidence::default(),
            misfit: None,
            seen: None,
            estimate: None,
            boldness: 1.0,
            losses: [0; 2],
            doubt: false,
            moving: 0,
            grips: 0,
            aimed: false,
            missed: false,
            misses: 0,
            sure: false,
            stays: 0,
        }
    }
}

/// Current estimate of ball and camera.
#[derive(Clone, Debug)]
struct Estimate {
    numbers: Numbers,
    model: CameraModel,
    ball: Point3<f64>,
    covariance: WithBall,
}

/// Distance from the expected place at which the ball has moved: standard deviations, and a least
/// number of feature units.
const MOVED: (f64, f64) = (5.0, 3.0);
/// Distance from the expected place at which a sighting needs confirmation, feature units.
const FAR_OFF: f64 = 40.0;
/// Number of sightings after a movement in which another one needs no confirmation.
const STILL_MOVING: usize = 3;
/// Standard deviation of a ball that was put between the jaws from their middle, metres.
const SHOWN: f64 = 0.002;
/// Standard deviation of the balls that the jaws have closed around.
const HELD: f64 = 0.008;
/// Margin to the border of the frame, feature units.
const MARGIN: f64 = 4.0;
/// Radius at which the ball is still detected reliably, feature units.
const FAR_ENOUGH: f64 = 5.5;
/// Largest radius that a move may lead to, feature units, and over that of the goal if that is
/// more.
const LARGEST: f64 = 55.0;
const NEARER: f64 = 1.25;
/// Turn of a joint below which the arm stays, radians, and number of such decisions in a row before
/// a grip from there.
const STAYS: (f64, usize) = (0.002, 8);
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
            recent: Evidence::default(),
            slipped: false,
            calm: 0,
            causes: Vec::new(),
            news: false,
            learning: true,
            shown: false,
            run: Run::default(),
        }
    }

    /// Sets a goal that was taught on the arm. The taught grip also calibrates the camera, since
    /// the ball was between the jaws. From then on the errors of the arm are learned too: without a
    /// grip, sightings hardly tell them from errors of the camera.
    #[must_use]
    pub fn shown(mut self, goal: &TaughtGoal) -> Self {
        let (nominal, from) = (&self.settings.nominal, goal.seen_from());
        let shown = Evidence::shown(goal.features(), [from, from + goal.grip()], SHOWN);
        self.before = self.before.with_arm(&self.settings.prior);
        self.belief = self.belief.with_arm(&self.settings.prior);
        if let Some(fit) = Fit::of(&self.belief, &self.belief.numbers(), nominal, &[&shown]) {
            self.belief = fit.belief(self.belief.noise());
        }
        // Evidence as long as the camera stays in its mount: as a prior it would be linear.
        self.shown = true;
        self.remembered.insert(0, shown);
        self.settings.goal = goal.features();
        let [_, _, _, grip @ ..] = goal.grip().0;
        self.settings.grip = grip;
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

    /// Estimates camera and ball from all sightings of this run.
    fn estimate(&mut self) -> Option<Estimate> {
        let start = self
            .run
            .estimate
            .as_ref()
            .map_or_else(|| self.belief.numbers(), |e| e.numbers);
        let fit = Fit::of(
            &self.belief,
            &start,
            &self.settings.nominal,
            &[&self.run.evidence],
        )?;
        let ball = fit.balls.last().copied().flatten()?;
        Some(Estimate {
            model: corrected(&self.settings.nominal, &fit.numbers),
            numbers: fit.numbers,
            covariance: fit.with_last_ball()?,
            ball,
        })
    }

    /// Returns the distance from the expected place, feature units, if the ball has moved.
    fn surprise(&self, seen: &Features) -> Option<f64> {
        let estimate = self.run.estimate.as_ref()?;
        if self.run.evidence.len() == 0 {
            return None;
        }
        let view = |numbers: &Numbers, ball: &Point3<f64>| {
            let links = self.run.evidence.links(numbers, &self.settings.nominal.arm);
            let seen = corrected(&self.settings.nominal, numbers).view(&links.stand(), ball);
            seen.as_ref().map(vector)
        };
        let Some((expected, by_all)) = sensitivity(&estimate.numbers, &estimate.ball, view) else {
            return Some(f64::INFINITY);
        };
        let unsure = deviations(&by_all, &estimate.covariance);
        let off = vector(seen) - expected;
        let moved = (0..3)
            .any(|i| off[i].abs() > MOVED.1.max(MOVED.0 * unsure[i].hypot(self.belief.noise())));
        moved.then(|| off.norm())
    }

    /// Plans the longest move towards the goal that keeps the ball in view.
    fn plan(
        &self,
        estimate: &Estimate,
        Request { joints, limits, .. }: &Request,
    ) -> Option<JointDelta> {
        let model = &estimate.model;
        let links = self
            .run
            .evidence
            .links(&estimate.numbers, &self.settings.nominal.arm);
        let stand = links.stand();
        let camera = model.arm.wrist(&stand) * model.mount;
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
            let wanted = here + (target - here) * (share * self.run.boldness);
            let (placing, _) = model.pose_placing(&estimate.ball, &wanted, &stand);
            let motors = links.motors_for(&placing, joints);
            let delta = self.cut(&motors, joints, limits);
            last = Some(delta);
            if self.stays_in_view(estimate, &(*joints + delta), least) {
                break;
            }
        }
        last
    }

    /// Returns the move to `motors`, cut to the step limits and the joint limits. NaN stays NaN.
    ///
    /// A move that a joint limit ends keeps its direction, so that the ball stays in view; from the
    /// limit itself the other joints go on.
    fn cut(&self, motors: &Joints, from: &Joints, limits: &JointLimits) -> JointDelta {
        /// Least share of a way within the limits that is worth a move.
        const WORTH: f64 = 0.1;
        let whole = JointDelta(std::array::from_fn(|i| {
            if i < 3 { motors.0[i] - from.0[i] } else { 0.0 }
        }));
        let share = limits.share_within(from, &whole, 1.0);
        let target = if share > WORTH && share < 1.0 {
            limits.nearest(&(*from + JointDelta(whole.0.map(|turn| share * turn))))
        } else {
            limits.nearest(motors)
        };
        JointDelta(std::array::from_fn(|i| {
            match self.settings.steps.get(i) {
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
            let mut links: Links = self.run.evidence.links(numbers, &self.settings.nominal.arm);
            links.follow(motors);
            let seen = corrected(&self.settings.nominal, numbers).view(&links.stand(), ball);
            seen.as_ref().map(vector)
        };
        let Some((seen, by_all)) = sensitivity(&estimate.numbers, &estimate.ball, view) else {
            return false;
        };
        let margin = deviations(&by_all, &estimate.covariance) * self.settings.caution;
        let inside =
            |v: f64, margin: f64, low: f64, high: f64| v - margin >= low && v + margin <= high;
        inside(seen.x, margin.x, MARGIN, Features::WIDTH - MARGIN)
            && inside(seen.y, margin.y, MARGIN, Features::HEIGHT - MARGIN)
            && seen.z >= least
            && seen.z + margin.z <= LARGEST.max(NEARER * self.settings.goal.r)
    }
}

impl Hybrid {
    fn reach(&mut self, ball: &Sighting, request: &Request) -> Option<JointDelta> {
        self.run.seen = None;
        let off = self.surprise(&ball.features);
        let odd = off.is_some();
        if off.is_some_and(|off| off > FAR_OFF) && !self.run.doubt && self.run.moving == 0 {
            // Possibly a false circle: stay and look again.
            self.run.doubt = true;
            return Some(JointDelta::default());
        }
        self.run.doubt = false;
        self.run.moving = if odd {
            STILL_MOVING
        } else {
            self.run.moving.saturating_sub(1)
        };
        // Two losses of a ball that should have stayed in view: the estimate is wrong.
        let mistaken = self.run.losses[0] >= 2;
        if odd || mistaken {
            if !mistaken {
                self.remember();
            }
            self.run.evidence.forget_sightings();
            self.run.estimate = None;
        }
        self.run.evidence.saw(ball.features);
        self.run.estimate = self.estimate();
        if self.run.estimate.is_none() {
            // The sightings contradict one another: start again from the latest.
            self.run.evidence.forget_sightings();
            self.run.evidence.saw(ball.features);
            self.run.estimate = self.estimate();
        }
        self.plan(self.run.estimate.as_ref()?, request)
    }

    /// Decides on the grip if no move is left to bring the ball nearer to the goal: the features
    /// may be too coarse for it, or a joint at its limit.
    fn move_or_grip(&mut self, delta: JointDelta, joints: &Joints) -> Decision {
        // A turn back takes up the backlash first.
        let turned = self
            .run
            .estimate
            .as_ref()
            .map_or(f64::INFINITY, |estimate| {
                let (numbers, arm) = (&estimate.numbers, &self.settings.nominal.arm);
                let mut links = self.run.evidence.links(numbers, arm);
                let from = links.stand();
                links.follow(&(*joints + delta));
                let turns = (links.stand() - from).0;
                turns
                    .into_iter()
                    .fold(0.0, |most, turn| turn.abs().max(most))
            });
        let whole = !self.run.doubt && self.run.boldness >= 1.0;
        let stays = whole && turned < STAYS.0;
        self.run.stays = if stays { self.run.stays + 1 } else { 0 };
        if self.run.stays < STAYS.1 {
            return Decision::Move(delta);
        }
        self.run.stays = 0;
        Decision::Grip(JointDelta::default())
    }
}

impl Controller for Hybrid {
    fn decide(&mut self, ball: &Sighting, request: &Request) -> Result<Decision, GaveUp> {
        // As evidence, NaN would spread to the whole belief.
        if ball.is_finite() && request.joints.non_finite().is_none() {
            self.run.record.saw(ball.features);
            self.judge();
        }
        let decision = if !ball.is_finite() || request.joints.non_finite().is_some() {
            None
        } else if request.grip {
            self.aim(ball, request).map(Decision::Grip)
        } else {
            let delta = self.reach(ball, request);
            delta.map(|delta| self.move_or_grip(delta, &request.joints))
        };
        decision.ok_or(GaveUp::NoMoveLeft)
    }

    fn notice(&mut self, feedback: &Feedback) {
        match feedback {
            Feedback::Begin => {
                self.run = Run::default();
                self.run.misfit = self.slipped.then_some(Misfit::CameraSlipped);
            }
            Feedback::Arm(joints) => {
                self.run.evidence.arm_at(joints);
                self.run.record.arm_at(joints);
            }
            Feedback::Seen { ball, .. } => {
                self.run.seen = ball.is_finite().then_some(ball.features);
                (self.run.boldness, self.run.losses[0]) = ((1.5 * self.run.boldness).min(1.0), 0);
            }
            Feedback::Lost | Feedback::TakenBack => {
                self.run.boldness = (0.5 * self.run.boldness).max(LEAST_BOLDNESS);
                if *feedback == Feedback::Lost {
                    self.judge_loss();
                }
            }
            // An aim that holds only confirms the belief that it was made by.
            Feedback::Held(joints) if !self.run.aimed || self.run.misses > 0 => {
                self.run.evidence.held_at(joints, HELD);
            }
            Feedback::Held(_) => {}
            Feedback::Missed => {
                self.run.missed = std::mem::take(&mut self.run.aimed);
                self.run.misses += usize::from(self.run.missed);
            }
            Feedback::End => self.learn(),
        }
    }

    fn describe(&self) -> &str {
        "hybrid"
    }

    fn misfit(&self) -> Option<Misfit> {
        self.run.misfit
    }

    fn save(&self) -> Option<SavedController> {
        let marks = [self.shown, self.slipped];
        let before = (&self.recent, self.calm, &self.causes);
        SavedController::new("hybrid", (self.settings, &self.belief, marks, before))
    }
}
