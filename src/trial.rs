//! Trials on the feature shortcut: one ball in a cell that may be wrong, and an agent that goes for
//! it, without rendering.

use grasp_agent::{
    Agent, AgentConfig, AgentError, Controller, Event, Eye, ImageBased, Look, Outcome, Sighting,
    TaughtGoal,
};
use hough_heuristic::{Detection, Features, FrameError};
use pipeline_sim::{
    Ball, CameraError, Cell, ErrorLevel, Errors, FeatureCamera, Hand, SharedCell, SimulatedArm,
    Workspace,
};
use puma_val2::{ArmError, Joint, JointDelta, Joints, Manipulator, ProximitySensor};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

/// [`FeatureCamera`] as an [`Eye`].
#[derive(Debug)]
pub struct FeatureEye<P>(pub FeatureCamera<P>);

impl<P: FnMut() -> Joints> Eye for FeatureEye<P> {
    fn look(&mut self) -> Result<Look, FrameError> {
        /// Width that the circle of a sighting is given for: that of the paper's frame.
        const FRAME: u32 = 768;
        let ball = self.0.look().map(|features| Sighting {
            long_axis: None,
            features,
            detection: Detection {
                circle: features.to_circle(FRAME),
                score: 1.0,
            },
        });
        Ok(Look { frame: None, ball })
    }
}

/// A cell with drawn errors, in which balls can be placed and gone for.
#[derive(Clone, Debug)]
pub struct TrialCell {
    /// What is wrong with it.
    pub errors: Errors,
    cell: Cell,
    workspace: Workspace,
    bodies: bool,
}

/// What came of a trial.
#[derive(Clone, Debug)]
pub struct TrialResult {
    /// What the agent says.
    pub outcome: Outcome,
    /// Whether the ball stood at the goal.
    pub reached: bool,
    /// Whether the jaws hold the ball at the end.
    pub held: bool,
    /// From the point between the finger pads to the ball's centre when the jaws closed, metres;
    /// `None` if they did not.
    pub miss: Option<f64>,
    /// How often something came too near to the hand.
    pub near: usize,
}

impl TrialCell {
    /// The paper's cell with errors of `level`, drawn from `seed`.
    ///
    /// # Errors
    /// None of the levels makes an impossible camera; the type says that others could.
    pub fn draw(level: ErrorLevel, seed: u64) -> Result<Self, CameraError> {
        let errors = level.draw(&mut Xoshiro256PlusPlus::seed_from_u64(seed));
        let nominal = Cell::paper(Ball::at(0.6, 0.0, -0.1));
        Ok(Self {
            cell: errors.apply(&nominal)?,
            errors,
            workspace: Workspace::paper(),
            bodies: true,
        })
    }

    /// The same cell with a hand that touches nothing: whether the ball is *reached* does not
    /// depend then on what stands in the way.
    #[must_use]
    pub fn without_bodies(mut self) -> Self {
        // Everything of the hand at the wrist centre, where no ball can be.
        let at_the_wrist = -self.cell.params.d6;
        self.cell.hand = Hand {
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

    /// A ball that the arm, as it really stands in the search poses, sees from one of them.
    fn sample_seen_ball(&self, rng: &mut Xoshiro256PlusPlus) -> Result<Option<Ball>, ArmError> {
        let shared = SharedCell::new(self.cell);
        let mut arm = SimulatedArm::with_errors(shared.clone(), home(), &self.errors)?;
        let mut pose = arm.pose();
        let mut stands = Vec::new();
        for search_pose in self.search_poses() {
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
            let seen = |joints: &Joints| cell.features(joints).is_some_and(|f| well_inside(&f));
            stands.iter().any(seen).then_some(ball)
        }))
    }

    /// The paper's settings for this cell. A hand without bodies cannot hold the ball, and is not
    /// asked to lift it.
    pub fn agent_config(&self) -> AgentConfig {
        let paper = AgentConfig::paper(self.search_poses());
        AgentConfig {
            lift: paper.lift.filter(|_| self.bodies),
            ..paper
        }
    }

    /// The poses from which balls are looked for.
    pub fn search_poses(&self) -> [Joints; 6] {
        self.workspace.search_poses()
    }

    /// Shows the goal on the arm: the ball is put between the open jaws, the grip's turn of `JT5`
    /// is taken back, and the camera looks a few times. Where the ball is not well in view then, a
    /// shorter or a longer turn is tried, and then one of `JT4` before it, which brings a ball that
    /// shows too far aside into view. `None` where it is with none of them.
    ///
    /// Both are turns of the wrist, by which jaws and camera move in the same way wherever the arm
    /// stands.
    ///
    /// # Errors
    /// What the arm reports.
    pub fn teach_goal(&self, seed: u64) -> Result<Option<TaughtGoal>, ArmError> {
        /// What is added to the grip's turn, degrees, in the order it is tried.
        const TURNS: [f64; 7] = [0.0, 4.0, -4.0, 8.0, -8.0, 12.0, -12.0];
        /// The turns of `JT4` that are tried, degrees.
        const ASIDE: [f64; 8] = [4.0, -4.0, 8.0, -8.0, 12.0, -12.0, 16.0, -16.0];
        let from = Joints::from_degrees(ImageBased::GOAL_POSE);
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

    /// The ball as it shows on average from `from`, having been between the jaws when `grip` led
    /// there; `None` if it is not well in view.
    fn seen_after_taking_back(
        &self,
        grip: &JointDelta,
        from: Joints,
        seed: u64,
    ) -> Result<Option<Features>, ArmError> {
        const LOOKS: usize = 20;
        // The jaws that the ball is shown between, also where the hand has no bodies otherwise.
        let shared = SharedCell::new(Cell {
            hand: Hand::paper(),
            ..self.cell
        });
        let mut arm = SimulatedArm::with_errors(shared.clone(), home(), &self.errors)?;
        arm.move_to(from + *grip)?;
        let gripping = arm.pose()();
        shared.with(|cell| cell.place_ball(cell.tool_point(&gripping)));
        arm.move_to(from)?;
        let mut camera = FeatureCamera::new(shared, arm.pose(), self.errors.feature_noise, seed);
        let seen: Option<Vec<Features>> = (0..LOOKS).map(|_| camera.look()).collect();
        let mean = |seen: Vec<Features>| {
            let mean = |of: fn(&Features) -> f64| seen.iter().map(of).sum::<f64>() / LOOKS as f64;
            Features {
                x: mean(|f| f.x),
                y: mean(|f| f.y),
                r: mean(|f| f.r),
            }
        };
        Ok(seen.map(mean).filter(well_inside))
    }

    /// Lets `agent` go for the ball that `seed` places among those that can be seen from the search
    /// poses. `world` is called after each look, before it is answered, with the cell and the
    /// joints as they are: it may move the ball. `None` if no ball can be seen.
    ///
    /// # Errors
    /// What the agent reports.
    pub fn run<C: Controller>(
        &self,
        agent: &mut Agent<C>,
        seed: u64,
        world: &mut dyn FnMut(&mut Cell, &Joints),
        observe: &mut dyn FnMut(&Event<'_>),
    ) -> Result<Option<TrialResult>, AgentError> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let Some(ball) = self.sample_seen_ball(&mut rng)? else {
            return Ok(None);
        };
        let mut cell = self.cell;
        cell.place_ball(ball.centre);
        let shared = SharedCell::new(cell);
        let mut arm = SimulatedArm::with_errors(shared.clone(), home(), &self.errors)?;
        let noise = self.errors.feature_noise;
        let camera = FeatureCamera::new(shared.clone(), arm.pose(), noise, rng.random());
        let mut eye = ChangingWorld {
            eye: FeatureEye(camera),
            cell: shared.clone(),
            pose: arm.pose(),
            world,
        };
        let (mut sensor, mut near, mut miss, mut reached) = (arm.clone(), 0, None, false);
        let mut pose = arm.pose();
        let outcome = agent.run_and_learn(
            &mut eye,
            &mut arm,
            &mut Sensor {
                arm: self.bodies.then_some(&mut sensor),
                near: &mut near,
            },
            &mut |event| {
                reached |= event.kind == grasp_agent::EventKind::AtGoal;
                if let grasp_agent::EventKind::Gripping(_) = event.kind {
                    miss = Some(shared.with(|cell| cell.grip_miss(&pose())));
                }
                observe(event);
            },
        )?;
        let held = shared.get().held.is_some();
        Ok(Some(TrialResult {
            outcome,
            reached,
            held,
            miss,
            near,
        }))
    }
}

/// An eye in a world that moves on with every look.
struct ChangingWorld<'a, E, P> {
    eye: E,
    cell: SharedCell,
    pose: P,
    world: &'a mut dyn FnMut(&mut Cell, &Joints),
}

impl<E: Eye, P: FnMut() -> Joints> Eye for ChangingWorld<'_, E, P> {
    fn look(&mut self) -> Result<Look, FrameError> {
        let joints = (self.pose)();
        self.cell.with(|cell| (self.world)(cell, &joints));
        self.eye.look()
    }
}

/// A proximity sensor that is counted; without an arm, one that never senses anything.
struct Sensor<'a> {
    arm: Option<&'a mut SimulatedArm>,
    near: &'a mut usize,
}

impl ProximitySensor for Sensor<'_> {
    fn object_near(&mut self) -> Result<bool, ArmError> {
        let near = match &mut self.arm {
            Some(arm) => arm.object_near()?,
            None => false,
        };
        *self.near += usize::from(near);
        Ok(near)
    }
}

/// Whether a ball that shows like this still does from a pose that differs by the play of the
/// joints.
fn well_inside(f: &Features) -> bool {
    const MARGIN: f64 = 8.0;
    f.r > 5.5
        && (MARGIN..Features::WIDTH - MARGIN).contains(&f.x)
        && (MARGIN..Features::HEIGHT - MARGIN).contains(&f.y)
}

/// Where the arm stands before a trial: VAL's READY pose.
fn home() -> Joints {
    Joints::from_degrees([0.0, -90.0, 90.0, 0.0, 0.0, 0.0])
}
