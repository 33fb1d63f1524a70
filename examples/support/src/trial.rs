//! One ball and an agent that goes for it; and the cell without rendering, the feature shortcut.

use grasp_agent::{
    Agent, AgentConfig, AgentError, CameraEye, CameraModel, Controller, EventKind, Eye,
    GoalInterval, Input, RunEvent, RunOutcome, Sighting, TaughtGoal,
};
use hough_heuristic::{CircleDetector, Features, FrameError};
use pipeline_sim::{
    Ball, Cell, ErrorLevel, Errors, FeatureCamera, HandShape, QuantityError, Scene, SharedCell,
    SimulatedArm, Workspace,
};
use puma_grasp::{Rig, RigParts};
use puma_val2::{Arm, ArmError, Gripper, Joint, JointDelta, Joints, Manipulator, ProximitySensor};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

use crate::learning::{ArmName, believed};
use crate::program::{Outcome, STOP};
use crate::stages::Stages;

/// A feature of the ball in the image: its name, its goal interval, its largest value of interest,
/// and its reader.
pub type Feature = (&'static str, (f64, f64), f64, fn(&Features) -> f64);

/// All features, in feature units.
pub const FEATURES: [Feature; 3] = [
    ("x", (99.0, 108.0), 192.0, |f| f.x),
    ("y", (74.0, 82.0), 144.0, |f| f.y),
    ("r", (32.0, 34.0), 68.0, |f| f.r),
];

/// Returns the interval of each feature in the goal of an agent, in the order of [`FEATURES`]; the
/// paper's if the agent has none.
pub fn goal_of(goal: &[GoalInterval]) -> [(f64, f64); 3] {
    let mut inputs = [Input::X, Input::Y, Input::R].into_iter();
    FEATURES.map(|(_, paper, ..)| {
        let input = inputs.next();
        let own = goal.iter().find(|interval| Some(interval.input) == input);
        own.map_or(paper, |own| (own.low, own.high))
    })
}

/// Returns whether the ball stands at the paper's goal.
pub fn at_goal(features: &Features) -> bool {
    let inside = |(_, (low, high), _, of): &Feature| (*low..=*high).contains(&of(features));
    FEATURES.iter().all(inside)
}

/// A closure that returns the features of the ball in view, as an [`Eye`].
#[derive(Debug)]
pub struct FeatureEye<F>(pub F);

impl<F: FnMut() -> Option<Features>> Eye for FeatureEye<F> {
    fn look(&mut self) -> Result<Option<Sighting>, FrameError> {
        Ok((self.0)().map(Sighting::new))
    }
}

/// The result of one run toward a ball.
#[derive(Clone, Debug)]
pub struct Trial {
    /// The agent's own account.
    pub outcome: RunOutcome,
    /// Moves until the ball stood at the goal for the first time, `None` if it never did.
    pub at_goal: Option<usize>,
    /// Set if the jaws hold the ball at the end; of a real ball, if the camera says so.
    pub held: bool,
    /// Stops by the proximity sensors.
    pub near: usize,
    /// Collisions of the hand; counted in rendered frames only.
    pub collisions: Option<usize>,
}

/// Lets `agent` go for the ball in the rig's cell, and adds the time of each stage to `stages`.
///
/// # Errors
/// Those of [`Agent::run_and_learn`].
pub fn run_on_rig<C: Controller>(
    rig: &mut Rig,
    detector: &mut dyn CircleDetector,
    agent: &mut Agent<C>,
    stages: &Stages,
    observe: &mut dyn FnMut(&RunEvent<'_>),
) -> Result<Trial, AgentError> {
    let (cell, simulated) = (rig.cell().clone(), rig.is_simulated());
    if !simulated {
        stages.of_real_camera();
    }
    let RigParts {
        camera,
        arm,
        mut sensor,
    } = rig.parts();
    let (mut camera, mut detector) = (stages.around(camera), stages.around(detector));
    let mut eye = CameraEye::new(&mut camera, &mut detector);
    let mut arm = stages.around(arm);
    let trial = reach(agent, &mut eye, &mut arm, &mut *sensor, &cell, observe)?;
    Ok(Trial {
        collisions: simulated.then(|| cell.contacts().collisions),
        // Of a real ball only the camera tells.
        held: if simulated {
            trial.held
        } else {
            trial.outcome.gave_up.is_none()
        },
        ..trial
    })
}

fn reach<C: Controller>(
    agent: &mut Agent<C>,
    eye: &mut dyn Eye,
    arm: &mut dyn Manipulator,
    sensor: &mut dyn ProximitySensor,
    cell: &SharedCell,
    observe: &mut dyn FnMut(&RunEvent<'_>),
) -> Result<Trial, AgentError> {
    let (mut at_goal, mut near) = (None, 0);
    let outcome = agent.run_and_learn(eye, arm, sensor, &mut |event| {
        match event.kind {
            EventKind::AtGoal => {
                at_goal.get_or_insert(event.cycle);
            }
            EventKind::TooNear => near += 1,
            _ => {}
        }
        observe(event);
    })?;
    Ok(Trial {
        outcome,
        at_goal,
        held: cell.get().held.is_some(),
        near,
        collisions: None,
    })
}

/// Starts an emulated controller, around whose arm the cell has these errors. All apply except the
/// backlash and the encoder steps of the arm, and the noise of features: frames have their own.
///
/// # Errors
/// Those of [`Rig::emulated`], and the quantity that is out of range.
pub fn rig_with_errors(errors: &Errors, scene: &Scene, seed: u64) -> Outcome<Rig> {
    let rig = Rig::emulated(false, scene, seed, &STOP)?;
    make_errors(&rig, errors)?;
    Ok(rig)
}

/// Gives the cell around an arm these errors, in the same way.
///
/// # Errors
/// The quantity that is out of range.
pub fn make_errors(rig: &Rig, errors: &Errors) -> Result<(), QuantityError> {
    let wrong = errors.apply(&rig.cell().get())?;
    rig.cell().with(|cell| *cell = wrong);
    rig.cell().set_errors(errors)
}

/// Draws a ball in view of one of the search poses.
///
/// # Errors
/// A camera that sees none.
pub fn ball_in_view(cell: &SharedCell, rng: &mut Xoshiro256PlusPlus) -> Outcome<Ball> {
    let seen = Workspace::paper().sample_seen_ball(&cell.get(), rng);
    let (ball, _) = seen.ok_or("no place of the workspace is in view from a search pose")?;
    Ok(ball)
}

/// Returns `true` if the sensors on the hand of `cell` respond to the ball wherever it shows in the
/// goal: the place that belongs to the goal in front of this camera lies within the hand.
///
/// That place moves with the hand, so one pose tells for all.
pub fn sensors_forbid(cell: &Cell, goal: &[GoalInterval]) -> bool {
    let joints = cell.reached;
    let respond = |x: f64, y: f64, r: f64| {
        let mut cell = Cell {
            table: f64::NEG_INFINITY,
            holder: None,
            jaws: Gripper::Open,
            held: None,
            ..*cell
        };
        let place = cell.ball_showing(&joints, &Features { x, y, r });
        place.is_none_or(|place| {
            cell.ball.centre = place;
            cell.proximity(&joints)
        })
    };
    let [xs, ys, rs] = goal_of(goal).map(|(low, high)| [low, 0.5 * (low + high), high]);
    let mut places = xs.iter().flat_map(|x| ys.map(|y| (*x, y)));
    places.all(|(x, y)| rs.iter().all(|r| respond(x, y, *r)))
}

/// A cell with drawn errors on the feature shortcut: no frames, and an arm that moves at once.
#[derive(Clone, Debug)]
pub struct TrialCell {
    errors: Errors,
    nominal: Cell,
    cell: Cell,
    workspace: Workspace,
    bodies: bool,
}

impl TrialCell {
    /// Draws errors of `level` from `seed` and applies them to the paper's cell.
    ///
    /// # Errors
    /// A camera that cannot be; none of the levels makes one.
    pub fn draw(level: ErrorLevel, seed: u64) -> Result<Self, QuantityError> {
        let errors = level.draw(&mut Xoshiro256PlusPlus::seed_from_u64(seed));
        Self::with_errors(errors, ArmName::Puma)
    }

    /// Applies errors to the cell of an arm.
    ///
    /// # Errors
    /// The quantity that is out of range.
    pub fn with_errors(errors: Errors, arm: ArmName) -> Result<Self, QuantityError> {
        let (nominal, workspace) = arm.cell();
        Ok(Self {
            cell: errors.apply(&nominal)?,
            nominal,
            errors,
            workspace,
            bodies: true,
        })
    }

    /// Returns `true` if the hand itself keeps the ball from the goal ([`sensors_forbid`]).
    pub fn forbids(&self, goal: &[GoalInterval]) -> bool {
        self.bodies && sensors_forbid(&self.cell, goal)
    }

    /// Returns what an arm without errors believes of this cell.
    pub fn believed(&self) -> CameraModel {
        believed(&self.nominal)
    }

    /// Returns poses with balls of more and more radius, from the search to the goal, which is the
    /// third.
    pub fn poses_on_the_way(&self) -> [Joints; 4] {
        let (goal, mut far) = (self.nominal.reached, self.workspace.search_poses()[0]);
        far.0[0] = goal.0[0];
        let middle = Joints(std::array::from_fn(|i| 0.5 * (far.0[i] + goal.0[i])));
        [far, middle, goal, goal]
    }

    /// Gives the cell a hand that touches nothing, so that nothing can stand in the way of
    /// *reaching* the ball.
    #[must_use]
    pub fn without_bodies(mut self) -> Self {
        // Everything of the hand at the wrist centre, where no ball can be.
        let at_the_wrist = -self.cell.arm.flange();
        self.cell.hand = HandShape {
            tool: at_the_wrist,
            beyond_tool: 0.0,
            finger_radius: 0.0,
            half_opening: 0.0,
            palm_radius: 0.0,
            finger_length: 0.0,
            camera_radius: 0.0,
            ..self.cell.hand
        };
        self.bodies = false;
        self
    }

    /// Lets the camera slip in its mount by the slip of the errors.
    pub fn slip(&mut self) {
        self.errors.slip_camera(&mut self.cell);
    }

    /// Shares a cell that is wrong as this one is.
    fn shared(&self, cell: Cell) -> SharedCell {
        let shared = SharedCell::new(cell);
        let set = shared.set_errors(&self.errors);
        debug_assert!(set.is_ok(), "checked when they were applied");
        shared
    }

    /// Returns the pose of the arm before a trial: VAL's READY, or another arm's first search pose.
    fn home(&self) -> Joints {
        match self.nominal.arm {
            Arm::Puma(_) => Joints::from_degrees([0.0, -90.0, 90.0, 0.0, 0.0, 0.0]),
            Arm::Serial { .. } => self.workspace.search_poses()[0],
        }
    }

    /// Draws a ball that is in view from one of the search poses as the arm really takes them.
    fn sample_seen_ball(&self, rng: &mut Xoshiro256PlusPlus) -> Result<Option<Ball>, ArmError> {
        let mut arm = SimulatedArm::new(self.shared(self.cell), self.home())?;
        let mut pose = arm.pose();
        let mut stands = Vec::new();
        for search_pose in self.workspace.search_poses() {
            arm.move_to(search_pose)?;
            stands.push(pose());
        }
        Ok((0..10_000).find_map(|_| {
            let ball = self.workspace.sample_ball(rng);
            let ball = Ball {
                radius: self.cell.ball.radius,
                ..ball
            };
            let cell = Cell { ball, ..self.cell };
            // Something to spare, for joints whose play is taken up from the other side.
            let seen = |joints: &Joints| cell.features(joints).is_ok_and(|f| well_inside(&f));
            stands.iter().any(seen).then_some(ball)
        }))
    }

    /// Returns the paper's settings, without the lift for a hand without bodies, which cannot hold
    /// the ball.
    pub fn agent_config(&self) -> AgentConfig {
        let mut config = match self.nominal.arm {
            Arm::Puma(_) => AgentConfig::paper(self.workspace.search_poses()),
            ref arm => AgentConfig::for_arm(arm, self.workspace.search_poses()),
        };
        config.lift = config.lift.filter(|_| self.bodies);
        config
    }

    /// Shows the goal on the arm: the ball is put between the open jaws, the grip's turn of `JT5`
    /// is taken back, and the camera looks a few times. If the ball is not well in view, shorter
    /// and longer turns are tried, then turns of `JT4` before them. `None` if no turn brings the
    /// ball into view.
    ///
    /// Both are turns of the wrist, which move jaws and camera alike wherever the arm stands.
    ///
    /// # Errors
    /// Faults that the arm reports.
    pub fn teach_goal(&self, seed: u64) -> Result<Option<TaughtGoal>, ArmError> {
        /// Angles added to the grip's turn, degrees, in the order of trial.
        const TURNS: [f64; 7] = [0.0, 4.0, -4.0, 8.0, -8.0, 12.0, -12.0];
        /// Turns of `JT4`, degrees, in the order of trial.
        const ASIDE: [f64; 8] = [4.0, -4.0, 8.0, -8.0, 12.0, -12.0, 16.0, -16.0];
        let from = self.nominal.reached;
        let config = self.agent_config();
        let upright = TURNS.map(|more| (0.0, more));
        let turned = TURNS
            .iter()
            .flat_map(|more| ASIDE.map(|aside| (aside, *more)));
        for (aside, more) in upright.into_iter().chain(turned) {
            let mut grip = config.grip;
            grip.0[Joint::J4.index()] += f64::to_radians(aside);
            grip.0[Joint::J5.index()] += more.to_radians();
            if let Some(seen) = self.seen_after_taking_back(&grip, from, seed)? {
                return Ok(TaughtGoal::new(&config.goal, seen, from, grip));
            }
        }
        Ok(None)
    }

    /// Returns the mean features, seen from `from`, of a ball that is between the jaws after
    /// `grip`; `None` if it is not well in view.
    fn seen_after_taking_back(
        &self,
        grip: &JointDelta,
        from: Joints,
        seed: u64,
    ) -> Result<Option<Features>, ArmError> {
        const LOOKS: usize = 20;
        if !self.nominal.within_limits(&(from + *grip)) {
            return Ok(None);
        }
        // The ball is shown between real jaws even where the hand has no bodies otherwise.
        let shared = self.shared(Cell {
            hand: self.nominal.hand,
            ..self.cell
        });
        let mut arm = SimulatedArm::new(shared.clone(), self.home())?;
        arm.move_to(from + *grip)?;
        let gripping = arm.pose()();
        shared.with(|cell| cell.place_ball(cell.tool_point(&gripping)));
        arm.move_to(from)?;
        let mut camera = FeatureCamera::new(shared, arm.pose(), seed);
        let looks = (0..LOOKS).map(|_| camera.look());
        // Looks that miss the ball, or see it somewhere else, do not count.
        let mut seen: Vec<Features> = looks.flatten().collect();
        let mut columns: Vec<f64> = seen.iter().map(|f| f.x).collect();
        columns.sort_by(f64::total_cmp);
        seen.retain(|f| (f.x - columns[columns.len() / 2]).abs() < 20.0);
        if 2 * seen.len() < LOOKS {
            return Ok(None);
        }
        let count = seen.len() as f64;
        let mean = |of: fn(&Features) -> f64| seen.iter().map(of).sum::<f64>() / count;
        let [x, y, r] = [mean(|f| f.x), mean(|f| f.y), mean(|f| f.r)];
        Ok(Some(Features { x, y, r }).filter(well_inside))
    }

    /// Lets `agent` go for the ball that `seed` places among those in view from the search poses;
    /// `None` if there is none. `world` may move the ball: it is called before each look with the
    /// cell and the arm's joint angles.
    ///
    /// # Errors
    /// Those of [`Agent::run_and_learn`].
    pub fn run<C: Controller>(
        &self,
        agent: &mut Agent<C>,
        seed: u64,
        world: &mut dyn FnMut(&mut Cell, &Joints),
        observe: &mut dyn FnMut(&RunEvent<'_>),
    ) -> Result<Option<Trial>, AgentError> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let Some(ball) = self.sample_seen_ball(&mut rng)? else {
            return Ok(None);
        };
        let mut cell = self.cell;
        cell.place_ball(ball.centre);
        let shared = self.shared(cell);
        let mut arm = SimulatedArm::new(shared.clone(), self.home())?;
        let mut camera = FeatureCamera::new(shared.clone(), arm.pose(), rng.random());
        let mut pose = arm.pose();
        let mut eye = FeatureEye(|| {
            let joints = pose();
            shared.with(|cell| world(cell, &joints));
            camera.look()
        });
        let mut sensor = Sensor(self.bodies.then(|| arm.clone()));
        reach(agent, &mut eye, &mut arm, &mut sensor, &shared, observe).map(Some)
    }
}

/// The arm's proximity sensors; without an arm, sensors that never respond.
struct Sensor(Option<SimulatedArm>);

impl ProximitySensor for Sensor {
    fn object_near(&mut self) -> Result<bool, ArmError> {
        self.0.as_mut().map_or(Ok(false), SimulatedArm::object_near)
    }
}

/// Returns whether the ball stays in view when the pose changes by the play of the joints.
fn well_inside(f: &Features) -> bool {
    const MARGIN: f64 = 8.0;
    f.r > 5.5
        && (MARGIN..Features::WIDTH - MARGIN).contains(&f.x)
        && (MARGIN..Features::HEIGHT - MARGIN).contains(&f.y)
}
