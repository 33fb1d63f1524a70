//! One simulated cell: the geometry alone, or with arm, gripper and contacts.

use grasp_agent::Percept;
use hough_heuristic::image::GrayImage;
use hough_heuristic::{Features, FrameSource};
use pipeline_sim::puma_val2::{Gripper, JointDelta, Joints, Manipulator};
use pipeline_sim::rand::rngs::Xoshiro256PlusPlus;
use pipeline_sim::rand::{Rng, RngExt, SeedableRng};
use pipeline_sim::{
    Ball, Cell, CellCamera, ErrorLevel, Errors, FeatureCamera, Grasp, QuantityError, Renderer,
    Scene, SharedCell, SimulatedArm, Workspace,
};

use crate::task::{Outcome, Task};

/// Columns and rows of the frames that are observed: one pixel a feature unit.
pub const FRAME: (u32, u32) = (192, 144);
/// Columns and rows of a rendered picture.
pub const PICTURE: (u32, u32) = (768, 576);
/// Turn of `JT5` from the goal to the grip, degrees.
const GRIP_DEGREES: f64 = -18.01;
/// Draws of a start before one at the goal is accepted.
const STARTS_TRIED: usize = 1000;

/// The settings of all worlds of a batch.
pub struct Setting {
    pub task: Task,
    /// `true`: with arm, contacts and grip.
    pub whole: bool,
    /// `true` if frames are observed.
    pub frames: bool,
    errors: ErrorSetting,
    nominal: Cell,
    /// The cell of every episode, if its errors are not drawn.
    fixed: Option<(Cell, Errors)>,
}

/// The errors of the cells of a batch.
pub struct ErrorSetting {
    pub level: ErrorLevel,
    pub odd: Vec<String>,
    /// Standard deviation of the noise on each feature, units; None: that of the level.
    pub noise: Option<f64>,
}

impl ErrorSetting {
    fn draw(&self, rng: &mut dyn Rng) -> Result<Errors, QuantityError> {
        let mut errors = self.level.draw(rng);
        for name in &self.odd {
            errors = errors.with_odd(name)?;
        }
        if let Some(noise) = self.noise {
            errors.feature_noise = noise;
        }
        Ok(errors)
    }
}

impl Setting {
    pub fn new(
        task: Task,
        whole: bool,
        frames: bool,
        errors: ErrorSetting,
    ) -> Result<Self, QuantityError> {
        let mut nominal = Cell::paper(Ball::at(0.6, 0.0, -0.1));
        if frames {
            nominal.camera = nominal.camera.resized(FRAME.0, FRAME.1)?;
        }
        let first = errors.draw(&mut Xoshiro256PlusPlus::seed_from_u64(0))?;
        let first = (first.apply(&nominal)?, first);
        Ok(Self {
            task,
            whole,
            frames,
            fixed: (errors.level == ErrorLevel::None).then_some(first),
            errors,
            nominal,
        })
    }

    /// Draws the cell of an episode and its errors.
    fn cell(&self, rng: &mut dyn Rng) -> Result<(Cell, Errors), QuantityError> {
        if let Some(fixed) = self.fixed {
            return Ok(fixed);
        }
        let errors = self.errors.draw(rng)?;
        Ok((errors.apply(&self.nominal)?, errors))
    }
}

/// Reads the pose of an arm.
type Pose = Box<dyn FnMut() -> Joints + Send>;

/// The arm, its gripper and the cameras in a cell.
struct Devices {
    arm: SimulatedArm,
    features: FeatureCamera<Pose>,
    camera: Option<CellCamera<Pose>>,
}

pub struct World {
    rng: Xoshiro256PlusPlus,
    cell: SharedCell,
    /// Angles of the joints as reported.
    joints: Joints,
    /// Angles of the links.
    links: Joints,
    noise: f64,
    devices: Option<Devices>,
    renderer: Option<Renderer>,
    pub percept: Percept,
    pub over: bool,
    pub steps: u32,
}

impl World {
    pub fn new(seed: u64) -> Self {
        let rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let percept = Percept {
            features: Features::new(0.0, 0.0, 0.0),
            theta3: 0.0,
        };
        Self {
            rng,
            cell: SharedCell::new(Cell::paper(Ball::at(0.6, 0.0, -0.1))),
            joints: Joints::default(),
            links: Joints::default(),
            noise: 0.0,
            devices: None,
            renderer: None,
            percept,
            over: true,
            steps: 0,
        }
    }

    /// Begins the sequence of random numbers anew.
    pub fn seed(&mut self, seed: u64) {
        self.rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        self.renderer = None;
    }

    /// Draws a cell and a start of an episode.
    pub fn reset(&mut self, setting: &Setting) -> Result<(), String> {
        for _ in 0..STARTS_TRIED {
            let (cell, errors) = setting.cell(&mut self.rng).map_err(text)?;
            let seen = if setting.whole {
                self.start_whole(cell, &errors, setting.frames)?
            } else {
                self.start_shortcut(cell, &errors)
            };
            let Some(features) = seen else { continue };
            self.percept = Percept::new(features, &self.joints);
            (self.over, self.steps) = (false, 0);
            if !setting.task.at_goal(&self.percept) {
                break;
            }
        }
        if self.over {
            return Err("no start of an episode shows the ball: the errors are too large".into());
        }
        Ok(())
    }

    fn start_shortcut(&mut self, cell: Cell, errors: &Errors) -> Option<Features> {
        let (cell, joints) = cell.exploring_start(&mut self.rng)?;
        self.cell.with(|shared| *shared = cell);
        (self.joints, self.links) = (joints, joints);
        (self.noise, self.devices) = (errors.feature_noise, None);
        self.look()
    }

    fn start_whole(
        &mut self,
        cell: Cell,
        errors: &Errors,
        frames: bool,
    ) -> Result<Option<Features>, String> {
        let found = Workspace::paper().sample_seen_ball(&cell, &mut self.rng);
        let Some((ball, pose)) = found else {
            return Ok(None);
        };
        self.cell = SharedCell::new(cell);
        self.cell.set_errors(errors).map_err(text)?;
        self.cell.place_ball(ball.centre, &pose);
        let mut arm = SimulatedArm::new(self.cell.clone(), pose).map_err(text)?;
        let seed = self.rng.random();
        let joints_of = |arm: &SimulatedArm| -> Pose { Box::new(arm.pose()) };
        let features = FeatureCamera::new(self.cell.clone(), joints_of(&arm), seed);
        let camera = frames.then(|| {
            let renderer = Renderer::new(&Scene::laboratory(), seed);
            CellCamera::new(self.cell.clone(), renderer, joints_of(&arm))
        });
        self.joints = arm.joints().map_err(text)?;
        self.links = joints_of(&arm)();
        self.devices = Some(Devices {
            arm,
            features,
            camera,
        });
        Ok(self.look())
    }

    /// The features of the ball as they are seen now.
    fn look(&mut self) -> Option<Features> {
        if let Some(devices) = &mut self.devices {
            return devices.features.look();
        }
        let joints = self.links;
        let Features { x, y, r } = self.cell.with(|cell| cell.features(&joints)).ok()?;
        let mut noisy = |value: f64| value + self.noise * standard_normal(&mut self.rng);
        Some(Features::new(noisy(x), noisy(y), noisy(r)))
    }

    /// Turns `JT1`, `JT2` and `JT3` by these degrees and returns the reward and the outcome. A turn
    /// that leaves the working range of its joint is left out.
    pub fn step(&mut self, task: &Task, degrees: [f64; 3]) -> (f64, Outcome) {
        let limits = self.cell.with(|cell| cell.limits);
        let mut target = self.joints;
        for (i, turn) in degrees.into_iter().enumerate() {
            let angle = target.0[i] + turn.to_radians();
            if (limits[i].0..=limits[i].1).contains(&angle) {
                target.0[i] = angle;
            }
        }
        self.steps += 1;
        let before = self.percept;
        let outcome = if !self.go(target) || self.has_collided() {
            Outcome::Collided
        } else if let Some(features) = self.look() {
            self.percept = Percept::new(features, &self.joints);
            if !task.at_goal(&self.percept) {
                Outcome::Continuing
            } else if self.devices.is_some() {
                self.grip()
            } else {
                Outcome::Reached
            }
        } else {
            Outcome::Lost
        };
        self.over = outcome != Outcome::Continuing;
        (task.reward(&before, &self.percept, outcome), outcome)
    }

    /// Moves the arm; `false` if it refuses.
    fn go(&mut self, target: Joints) -> bool {
        let Some(devices) = &mut self.devices else {
            (self.joints, self.links) = (target, target);
            return true;
        };
        let Ok(joints) = devices.arm.move_to(target) else {
            return false;
        };
        self.joints = joints;
        self.links = devices.arm.pose()();
        true
    }

    fn has_collided(&self) -> bool {
        let joints = self.links;
        self.devices.is_some()
            && (self.cell.contacts().collisions > 0
                || self.cell.with(|cell| cell.collides(&joints)))
    }

    /// Turns the hand down to the ball and closes the jaws.
    fn grip(&mut self) -> Outcome {
        let turn = JointDelta::from_degrees([0.0, 0.0, 0.0, 0.0, GRIP_DEGREES, 0.0]);
        let Some(devices) = &mut self.devices else {
            return Outcome::Reached;
        };
        let arm = &mut devices.arm;
        let done = arm
            .move_by(turn)
            .and_then(|_| arm.set_gripper(Gripper::Closed));
        match self.cell.contacts().grasp {
            Some(Grasp::Held) if done.is_ok() => Outcome::Grasped,
            _ => Outcome::Missed,
        }
    }

    /// Joint angles as the arm reports them, degrees.
    pub fn degrees(&self) -> [f64; 6] {
        self.joints.0.map(f64::to_degrees)
    }

    /// The frame that is observed.
    pub fn frame(&mut self) -> Result<GrayImage, String> {
        let mut frame = GrayImage::default();
        match self
            .devices
            .as_mut()
            .and_then(|devices| devices.camera.as_mut())
        {
            Some(camera) => camera.grab(&mut frame).map_err(text)?,
            None => frame = self.picture(FRAME)?,
        }
        Ok(frame)
    }

    /// A picture from the camera on the hand, of this size.
    pub fn picture(&mut self, (width, height): (u32, u32)) -> Result<GrayImage, String> {
        let mut cell = self.cell.get();
        cell.camera = cell.camera.resized(width, height).map_err(text)?;
        if self.renderer.is_none() {
            let seed = self.rng.random();
            self.renderer = Some(Renderer::new(&Scene::laboratory(), seed));
        }
        let renderer = self.renderer.as_mut().ok_or("no renderer")?;
        Ok(renderer.render(&cell, &self.links).clone())
    }
}

fn text(error: impl std::fmt::Display) -> String {
    error.to_string()
}

/// A normal deviate by the polar method.
fn standard_normal(rng: &mut impl Rng) -> f64 {
    loop {
        let u: f64 = rng.random_range(-1.0..1.0);
        let v: f64 = rng.random_range(-1.0..1.0);
        let s = u * u + v * v;
        if s > 0.0 && s < 1.0 {
            return u * (-2.0 * s.ln() / s).sqrt();
        }
    }
}
