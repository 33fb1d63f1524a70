//! A cell that is wrong in ways beyond camera and play: joints, gears, links, friction, delay.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use grasp_agent::hough_heuristic::{Features, FrameError};
use grasp_agent::nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use grasp_agent::puma_val2::{
    Arm, ArmError, Gripper, JointDelta, Joints, Manipulator, ProximitySensor,
};
use grasp_agent::qtable::rand::rngs::Xoshiro256PlusPlus;
use grasp_agent::qtable::rand::{RngExt, SeedableRng};
use grasp_agent::{
    Agent, AgentConfig, AgentError, CameraModel, Controller, EventLog, Eye, RunOutcome,
    ServoSettings, Sighting, TaughtGoal,
};

use crate::cell::config;

/// Ways in which a cell is wrong, beside camera, ball and play.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Odd {
    /// Zeros of the first three joints off by this, radians.
    pub(crate) zeros: [f64; 3],
    /// True turn of `JT2` and `JT3` over the reported one, less 1.
    pub(crate) gears: f64,
    /// Sag of the upper arm when it is level, radians.
    pub(crate) sag: f64,
    /// Turn of `JT2` per turn of `JT3`.
    pub(crate) coupling: f64,
    /// Upper arm and forearm longer by this, metres.
    pub(crate) links: f64,
    /// Least turn that a joint makes, radians; a smaller one is not made, and reported so.
    pub(crate) stiction: f64,
    /// `true` if the encoders report a move that was not made.
    pub(crate) dishonest: bool,
    /// `true` for a joint of the first three that makes no turn at all.
    pub(crate) stands: [bool; 3],
    /// Looks by which the image is late.
    pub(crate) late: usize,
    /// `true` if the image is mirrored left to right.
    pub(crate) mirrored: bool,
    /// Share of looks that show a circle anywhere.
    pub(crate) outliers: f64,
    /// `true` if the image is upside down.
    pub(crate) upside_down: bool,
    /// Share of looks that show a circle at one place of the image.
    pub(crate) ghosts: f64,
    /// Share of looks in which the ball is missed.
    pub(crate) missed: f64,
    /// Step of the features, units; 0 for none.
    pub(crate) quantum: f64,
    /// Image noise and play instead of the level's, units and radians; 0 for the level's.
    pub(crate) noise: f64,
    pub(crate) play: f64,
    /// Turn of the camera about its axis, radians.
    pub(crate) roll: f64,
    /// First term of the lens's radial distortion.
    pub(crate) k1: f64,
    /// Shares of the focal length and of the ball's radius, beside the level's.
    pub(crate) focal: f64,
    pub(crate) radius: f64,
    /// Turn of `JT3` per turn of `JT2`.
    pub(crate) drag: f64,
    /// Slope of the table on which balls lie.
    pub(crate) tilt: f64,
    /// Displacement and turn of the camera on the hand from now on, as shares of 10 mm and 8
    /// degrees, and the signs of both about the axes of the camera.
    pub(crate) slip: f64,
    pub(crate) slip_to: Option<[[f64; 3]; 2]>,
    /// Share by which the focal length is larger from now on.
    pub(crate) lens: f64,
}

/// Errors of camera, ball and play: share of the focal length, degrees of the axes, degrees of
/// play, image noise, share of the ball's radius, shift of the camera, shift of the image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Level(pub(crate) [f64; 7]);

pub(crate) const NONE: Level = Level([0.0; 7]);
pub(crate) const MODERATE: Level = Level([0.10, 3.0, 0.2, 0.5, 0.0, 0.0, 0.0]);
pub(crate) const HEAVY: Level = Level([0.25, 8.0, 0.6, 1.0, 0.10, 0.020, 5.0]);
pub(crate) const EXTREME: Level = Level([0.40, 15.0, 1.0, 1.5, 0.20, 0.020, 5.0]);

/// An arm with its camera as they are meant to be, the task's settings, and where balls lie.
#[derive(Clone, Debug)]
pub(crate) struct Site {
    pub(crate) nominal: CameraModel,
    pub(crate) config: AgentConfig,
    /// A pose with the ball at the goal, and the grip from there.
    pub(crate) from: Joints,
    pub(crate) grip: JointDelta,
    /// Distance from the base axis (metres), azimuth (degrees) and height (metres) of balls.
    pub(crate) balls: [(f64, f64); 3],
}

impl Site {
    pub(crate) fn puma() -> Self {
        Self {
            nominal: CameraModel::paper(),
            config: config(),
            from: Joints::from_degrees(ServoSettings::GOAL_POSE),
            grip: config().grip,
            balls: [(0.5, 0.8), (-70.0, 70.0), (-0.2, 0.05)],
        }
    }
}

pub(crate) struct State {
    site: Site,
    truth: CameraModel,
    pub(crate) odd: Odd,
    play: f64,
    noise: f64,
    rng: Xoshiro256PlusPlus,
    ball: Point3<f64>,
    held: bool,
    /// Angles that the encoders report, of the motors, and of the links before sag and coupling.
    reported: Joints,
    motors: Joints,
    links: Joints,
    shown: VecDeque<Option<Features>>,
    /// Jaws closed beside the ball.
    misses: usize,
    /// `true` if the arm was told to stop.
    pub(crate) stopped: bool,
}

/// Arm, camera and sensors of one cell.
#[derive(Clone)]
pub(crate) struct Plant(pub(crate) Rc<RefCell<State>>);

impl Plant {
    pub(crate) fn new(level: Level, odd: Odd, seed: u64) -> Self {
        Self::at(Site::puma(), level, odd, seed)
    }

    pub(crate) fn at(site: Site, level: Level, odd: Odd, seed: u64) -> Self {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut signed = |amount: f64| if rng.random() { amount } else { -amount };
        let Level([focal, degrees, play, noise, radius, shift, centre]) = level;
        let nominal = site.nominal;
        let turn = Vector3::from_fn(|_, _| signed(degrees.to_radians()));
        let shift = Vector3::from_fn(|_, _| signed(shift));
        let off = Isometry3::from_parts(
            Translation3::from(shift),
            UnitQuaternion::from_scaled_axis(turn),
        );
        let mut truth = CameraModel {
            focal: nominal.focal * (1.0 + signed(focal)) * (1.0 + odd.focal),
            centre: nominal.centre.map(|c| c + signed(centre)),
            mount: nominal.mount * off * UnitQuaternion::from_scaled_axis(Vector3::z() * odd.roll),
            ball_radius: nominal.ball_radius * (1.0 + signed(radius)) * (1.0 + odd.radius),
            ..nominal
        };
        if let Arm::Puma(arm) = &mut truth.arm {
            arm.a2 += odd.links;
            arm.d4 += odd.links;
        }
        let home = site.config.search_poses[0];
        let or = |own: f64, usual: f64| if own > 0.0 { own } else { usual };
        let (play, noise) = (or(odd.play, play.to_radians()), or(odd.noise, noise));
        Self(Rc::new(RefCell::new(State {
            site,
            truth,
            odd,
            play,
            noise,
            rng,
            ball: Point3::new(0.6, 0.0, -0.1),
            held: false,
            reported: home,
            motors: home,
            links: home,
            shown: VecDeque::new(),
            misses: 0,
            stopped: false,
        })))
    }

    pub(crate) fn truth(&self) -> CameraModel {
        self.0.borrow().truth
    }

    /// The true values of a belief's parameters of camera, ball and play.
    pub(crate) fn parameters(&self) -> [f64; 13] {
        let state = self.0.borrow();
        let (truth, nominal) = (&state.truth, &state.site.nominal);
        let off = nominal.mount.inverse() * truth.mount;
        let (turn, shift) = (off.rotation.scaled_axis(), off.translation.vector);
        let centre: [f64; 2] = std::array::from_fn(|i| truth.centre[i] - nominal.centre[i]);
        let focal = (truth.focal / nominal.focal).ln();
        let radius = (truth.ball_radius / nominal.ball_radius).ln();
        let [cx, cy] = centre;
        let play = state.play;
        [
            focal, cx, cy, turn.x, turn.y, turn.z, shift.x, shift.y, shift.z, radius, play, play,
            play,
        ]
    }

    pub(crate) fn misses(&self) -> usize {
        self.0.borrow().misses
    }

    /// Puts the ball where one of the search poses shows it well.
    pub(crate) fn place_ball(&self, seed: u64) {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut state = self.0.borrow_mut();
        state.held = false;
        for _ in 0..10_000 {
            let [(near, far), (right, left), (low, high)] = state.site.balls;
            let rho = rng.random_range(near.powi(2)..=far.powi(2)).sqrt();
            let azimuth = rng.random_range(right..=left).to_radians();
            let height = rng.random_range(low..=high) + state.odd.tilt * (rho - near);
            state.ball = Point3::new(rho * azimuth.cos(), rho * azimuth.sin(), height);
            let seen = state.site.config.search_poses.iter().any(|pose| {
                state
                    .view(&state.bent(&state.turned(pose)))
                    .is_some_and(|f| {
                        (8.0..184.0).contains(&f.x) && (8.0..136.0).contains(&f.y) && f.r > 5.5
                    })
            });
            if seen {
                return;
            }
        }
        panic!("no ball can be seen");
    }

    /// Shows the goal: the ball between the jaws, the grip taken back, and a few looks.
    pub(crate) fn taught(&self) -> Option<TaughtGoal> {
        let Site {
            from, grip, config, ..
        } = self.0.borrow().site.clone();
        let tries = [0.0, 4.0, -4.0, 8.0, -8.0, 12.0, -12.0, 16.0, -16.0];
        for (more, aside) in tries.iter().flat_map(|a| tries.map(|m| (m, *a))) {
            let other = JointDelta::from_degrees([0.0, 0.0, 0.0, aside, more, 0.0]);
            let grip = JointDelta(std::array::from_fn(|i| grip.0[i] + other.0[i]));
            let mut arm = self.clone();
            arm.move_to(from + grip).unwrap();
            {
                let mut state = self.0.borrow_mut();
                let stand = state.bent(&state.links);
                state.ball = state.truth.tool_point(&stand);
            }
            arm.move_to(from).unwrap();
            let looks: Option<Vec<Features>> = (0..20)
                .map(|_| arm.look().unwrap().map(|ball| ball.features))
                .collect();
            let mean = |looks: &[Features], of: fn(&Features) -> f64| {
                looks.iter().map(of).sum::<f64>() / looks.len() as f64
            };
            if let Some(looks) = looks {
                let seen = Features::new(
                    mean(&looks, |f| f.x),
                    mean(&looks, |f| f.y),
                    mean(&looks, |f| f.r),
                );
                let well = (8.0..184.0).contains(&seen.x) && (8.0..136.0).contains(&seen.y);
                if well && seen.r > 5.5 {
                    return TaughtGoal::new(&config.goal, seen, from, grip);
                }
            }
        }
        None
    }

    /// Runs `agent` on the ball that `seed` places; returns whether the jaws hold it at the end.
    pub(crate) fn run<C: Controller>(
        &self,
        agent: &mut Agent<C>,
        seed: u64,
        log: &mut EventLog,
    ) -> (Result<RunOutcome, AgentError>, bool) {
        self.run_seen_by(&mut self.clone(), agent, seed, log)
    }

    /// The same with another eye.
    pub(crate) fn run_seen_by<C: Controller>(
        &self,
        eye: &mut dyn Eye,
        agent: &mut Agent<C>,
        seed: u64,
        log: &mut EventLog,
    ) -> (Result<RunOutcome, AgentError>, bool) {
        self.place_ball(seed);
        let (mut arm, mut sensor) = (self.clone(), self.clone());
        let end = agent.run_and_learn(eye, &mut arm, &mut sensor, &mut |event| {
            log.note(event);
        });
        (end, self.0.borrow().held)
    }
}

impl State {
    /// Link angles for encoder angles: zeros and gears.
    fn turned(&self, motors: &Joints) -> Joints {
        Joints(std::array::from_fn(|i| {
            let gear = if (1..3).contains(&i) {
                self.odd.gears
            } else {
                0.0
            };
            let zero = self.odd.zeros.get(i).copied().unwrap_or(0.0);
            motors.0[i] * (1.0 + gear) + zero
        }))
    }

    /// Link angles with coupling and sag.
    fn bent(&self, links: &Joints) -> Joints {
        let mut bent = *links;
        bent.0[1] += self.odd.coupling * (links.0[2] - 180_f64.to_radians());
        bent.0[2] += self.odd.drag * (links.0[1] + 80_f64.to_radians());
        // Level at JT2 = 0; the ball is below.
        bent.0[1] += self.odd.sag * bent.0[1].cos();
        bent
    }

    fn view(&self, stand: &Joints) -> Option<Features> {
        let slip = self.odd.slip;
        let mut model = self.truth;
        model.focal *= 1.0 + self.odd.lens;
        if slip > 0.0 {
            let to = self
                .odd
                .slip_to
                .unwrap_or([[1.0, -1.0, 1.0], [1.0, 1.0, -1.0]]);
            let [turn, shift] = to.map(|to| Vector3::from(to).normalize() * slip);
            let (turn, shift) = (turn * 8_f64.to_radians(), shift * 0.010);
            model.mount *= Isometry3::from_parts(
                Translation3::from(shift),
                UnitQuaternion::from_scaled_axis(turn),
            );
        }
        let mut f = model.view(stand, &self.ball)?;
        let off = [f.x - model.centre[0], f.y - model.centre[1]];
        let squared = self.odd.k1 * off.iter().map(|v| (v / model.focal).powi(2)).sum::<f64>();
        (f.x, f.y) = (f.x + off[0] * squared, f.y + off[1] * squared);
        f.r *= 1.0 + 2.0 * squared;
        if self.odd.upside_down {
            f.y = Features::HEIGHT - f.y;
        }
        let x = if self.odd.mirrored {
            Features::WIDTH - f.x
        } else {
            f.x
        };
        let seen = (0.0..Features::WIDTH).contains(&x)
            && (0.0..Features::HEIGHT).contains(&f.y)
            && (5.0..100.0).contains(&f.r);
        seen.then_some(Features { x, ..f })
    }

    fn normal(&mut self) -> f64 {
        let (a, b): (f64, f64) = (self.rng.random(), self.rng.random());
        (-2.0 * (1.0 - a).ln()).sqrt() * (std::f64::consts::TAU * b).cos()
    }
}

impl Eye for Plant {
    fn look(&mut self) -> Result<Option<Sighting>, FrameError> {
        let mut state = self.0.borrow_mut();
        let stand = state.bent(&state.links);
        let mut seen = state.view(&stand);
        if let Some(f) = &mut seen {
            let noise = state.noise.max(1e-6);
            f.x += noise * state.normal();
            f.y += noise * state.normal();
            f.r += noise * state.normal();
        }
        if state.odd.outliers > 0.0 && state.rng.random::<f64>() < state.odd.outliers {
            let (x, y) = (
                state.rng.random_range(0.0..192.0),
                state.rng.random_range(0.0..144.0),
            );
            seen = Some(Features::new(x, y, state.rng.random_range(6.0..40.0)));
        }
        if state.odd.ghosts > 0.0 && state.rng.random::<f64>() < state.odd.ghosts {
            let off = 0.3 * state.normal();
            seen = Some(Features::new(130.0 + off, 50.0 - off, 15.0));
        }
        if state.odd.missed > 0.0 && state.rng.random::<f64>() < state.odd.missed {
            seen = None;
        }
        if let Some(f) = seen.as_mut().filter(|_| state.odd.quantum > 0.0) {
            let step = state.odd.quantum;
            let [x, y, r] = [f.x, f.y, f.r].map(|v| (v / step).round() * step);
            *f = Features::new(x, y, r.max(5.0));
        }
        let late = state.odd.late;
        state.shown.push_back(seen);
        let drop = state.shown.len().saturating_sub(late + 1);
        state.shown.drain(..drop);
        let shown = state.shown.front().copied().flatten();
        Ok(shown.map(Sighting::new))
    }
}

impl Manipulator for Plant {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        Ok(self.0.borrow().reported)
    }

    fn move_by(&mut self, delta: JointDelta) -> Result<Joints, ArmError> {
        let target = self.0.borrow().reported + delta;
        self.move_to(target)
    }

    fn move_to(&mut self, target: Joints) -> Result<Joints, ArmError> {
        let mut state = self.0.borrow_mut();
        let mut motors = state.motors;
        for i in 0..6 {
            let small = i < 3 && (target.0[i] - motors.0[i]).abs() < state.odd.stiction;
            let stuck = small || state.odd.stands.get(i) == Some(&true);
            if !stuck {
                motors.0[i] = target.0[i];
            }
        }
        state.motors = motors;
        let turned = state.turned(&motors);
        for i in 0..6 {
            let half = if i < 3 { 0.5 * state.play } else { 0.0 };
            state.links.0[i] = state.links.0[i].clamp(turned.0[i] - half, turned.0[i] + half);
        }
        state.reported = if state.odd.dishonest { target } else { motors };
        if state.held {
            let stand = state.bent(&state.links);
            state.ball = state.truth.tool_point(&stand);
        }
        Ok(state.reported)
    }

    fn set_gripper(&mut self, gripper: Gripper) -> Result<(), ArmError> {
        let mut state = self.0.borrow_mut();
        let stand = state.bent(&state.links);
        let miss = (state.truth.tool_point(&stand) - state.ball).norm();
        let closed = gripper == Gripper::Closed;
        state.held = closed && miss < 0.010;
        state.misses += usize::from(closed && !state.held);
        Ok(())
    }

    fn stop(&mut self) -> Result<(), ArmError> {
        self.0.borrow_mut().stopped = true;
        Ok(())
    }
}

impl ProximitySensor for Plant {
    fn object_near(&mut self) -> Result<bool, ArmError> {
        Ok(false)
    }
}
