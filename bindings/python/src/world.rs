//! One simulated cell: the geometry alone, or with arm, gripper and contacts.

use grasp_agent::Percept;
use hough_heuristic::image::GrayImage;
use hough_heuristic::{Features, FrameSource};
use pipeline_sim::nalgebra::Point3;
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
    /// `true` if features are observed relative to the goal.
    pub scaled: bool,
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
        scaled: bool,
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
            scaled,
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

/// One cell and its episode. It is small, since a step of many goes through the memory of all.
pub struct World {
    rng: Xoshiro256PlusPlus,
    /// Centre of the ball at the start of the episode.
    ball: Point3<f64>,
    /// The cell of the episode, unless it is that of all and only the ball is another.
    own: Option<SharedCell>,
    /// Angles of the joints as reported.
    joints: Joints,
    /// Angles of the links.
    links: Joints,
    noise: f64,
    devices: Option<Box<Devices>>,
    renderer: Option<Box<Renderer>>,
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
            ball: Point3::origin(),
            own: None,
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
        self.over = true;
        for _ in 0..STARTS_TRIED {
            let seen = if setting.whole {
                self.start_whole(setting)?
            } else {
                self.start_shortcut(setting)?
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

    fn start_shortcut(&mut self, setting: &Setting) -> Result<Option<Features>, String> {
        let (drawn, noise);
        let cell = match &setting.fixed {
            Some((cell, errors)) => {
                noise = errors.feature_noise;
                cell
            }
            None => {
                let (cell, errors) = setting.cell(&mut self.rng).map_err(text)?;
                (drawn, noise) = (cell, errors.feature_noise);
                &drawn
            }
        };
        let Some((cell, joints)) = cell.exploring_start(&mut self.rng) else {
            return Ok(None);
        };
        self.ball = cell.ball.centre;
        if setting.fixed.is_none() {
            self.own = Some(SharedCell::new(cell));
        }
        (self.joints, self.links, self.noise) = (joints, joints, noise);
        Ok(self.look(setting))
    }

    fn start_whole(&mut self, setting: &Setting) -> Result<Option<Features>, String> {
        let (cell, errors) = setting.cell(&mut self.rng).map_err(text)?;
        let found = Workspace::paper().sample_seen_ball(&cell, &mut self.rng);
        let Some((ball, pose)) = found else {
            return Ok(None);
        };
        let shared = SharedCell::new(cell);
        shared.set_errors(&errors).map_err(text)?;
        shared.place_ball(ball.centre, &pose);
        let mut arm = SimulatedArm::new(shared.clone(), pose).map_err(text)?;
        let seed = self.rng.random();
        let joints_of = |arm: &SimulatedArm| -> Pose { Box::new(arm.pose()) };
        let features = FeatureCamera::new(shared.clone(), joints_of(&arm), seed);
        let camera = setting.frames.then(|| {
            let renderer = Renderer::new(&Scene::laboratory(), seed);
            CellCamera::new(shared.clone(), renderer, joints_of(&arm))
        });
        self.joints = arm.joints().map_err(text)?;
        self.links = joints_of(&arm)();
        self.own = Some(shared);
        self.devices = Some(Box::new(Devices {
            arm,
            features,
            camera,
        }));
        Ok(self.look(setting))
    }

    /// The cell as it is now.
    fn cell(&self, setting: &Setting) -> Cell {
        if let Some(own) = &self.own {
            return own.get();
        }
        let fixed = setting.fixed.as_ref().map(|(cell, _)| *cell);
        let mut cell = fixed.unwrap_or(setting.nominal);
        cell.ball.centre = self.ball;
        cell
    }

    /// The features of the ball as they are seen now.
    fn look(&mut self, setting: &Setting) -> Option<Features> {
        if let Some(devices) = &mut self.devices {
            return devices.features.look();
        }
        let seen = self.cell(setting).features(&self.links).ok()?;
        if self.noise == 0.0 {
            return Some(seen);
        }
        let Features { x, y, r } = seen;
        let mut noisy = |value: f64| value + self.noise * standard_normal(&mut self.rng);
        Some(Features::new(noisy(x), noisy(y), noisy(r)))
    }

    /// Turns `JT1`, `JT2` and `JT3` by these degrees and returns the reward and the outcome. A turn
    /// that leaves the working range of its joint is left out.
    pub fn step(&mut self, setting: &Setting, degrees: [f64; 3]) -> (f64, Outcome) {
        let mut target = self.joints;
        for (i, turn) in degrees.into_iter().enumerate() {
            let angle = target.0[i] + turn.to_radians();
            let (low, high) = setting.nominal.limits[i];
            if (low..=high).contains(&angle) {
                target.0[i] = angle;
            }
        }
        self.steps += 1;
        let (task, before) = (&setting.task, self.percept);
        let outcome = if !self.go(target) || self.has_collided() {
            Outcome::Collided
        } else if let Some(features) = self.look(setting) {
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
        let (Some(_), Some(cell)) = (&self.devices, &self.own) else {
            return false;
        };
        cell.contacts().collisions > 0 || cell.with(|cell| cell.collides(&self.links))
    }

    /// Turns the hand down to the ball and closes the jaws.
    fn grip(&mut self) -> Outcome {
        let turn = JointDelta::from_degrees([0.0, 0.0, 0.0, 0.0, GRIP_DEGREES, 0.0]);
        let (Some(devices), Some(cell)) = (&mut self.devices, &self.own) else {
            return Outcome::Reached;
        };
        let arm = &mut devices.arm;
        let done = arm
            .move_by(turn)
            .and_then(|_| arm.set_gripper(Gripper::Closed));
        match cell.contacts().grasp {
            Some(Grasp::Held) if done.is_ok() => Outcome::Grasped,
            _ => Outcome::Missed,
        }
    }

    /// Joint angles as the arm reports them, degrees.
    pub fn degrees(&self) -> [f64; 6] {
        self.joints.0.map(f64::to_degrees)
    }

    /// The frame that is observed.
    pub fn frame(&mut self, setting: &Setting) -> Result<GrayImage, String> {
        let mut frame = GrayImage::default();
        match self
            .devices
            .as_mut()
            .and_then(|devices| devices.camera.as_mut())
        {
            Some(camera) => camera.grab(&mut frame).map_err(text)?,
            None => frame = self.picture(setting, FRAME)?,
        }
        Ok(frame)
    }

    /// A picture from the camera on the hand, of this size.
    pub fn picture(
        &mut self,
        setting: &Setting,
        (width, height): (u32, u32),
    ) -> Result<GrayImage, String> {
        let mut cell = self.cell(setting);
        if self.own.is_none() {
            cell.place_ball(self.ball);
        }
        cell.camera = cell.camera.resized(width, height).map_err(text)?;
        if self.renderer.is_none() {
            let seed = self.rng.random();
            self.renderer = Some(Box::new(Renderer::new(&Scene::laboratory(), seed)));
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
