//! A cell: a model for the truth, a ball, joints; and ways to break it.

use std::cell::RefCell;
use std::rc::Rc;

use grasp_agent::hough_heuristic::image::{GrayImage, Luma};
use grasp_agent::hough_heuristic::{Features, FrameError};
use grasp_agent::nalgebra::Point3;
use grasp_agent::puma_val2::{
    ArmError, Gripper, Joint, JointDelta, Joints, Manipulator, ProximitySensor,
};
use grasp_agent::qtable::QTable;
use grasp_agent::{
    Agent, AgentConfig, AgentError, Behaviour, BehaviourPair, BehaviourSpec, CameraModel,
    Controller, EventLog, Eye, Hybrid, HybridSettings, Learned, RunOutcome, Servo, ServoLaw,
    ServoSettings, Sighting,
};

/// Faults, with the number of looks or moves before them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Fault {
    None,
    NoFrame(usize),
    FrozenFrame(usize),
    /// Frames, and after so many looks always the same one, with what was in it.
    FrozenPicture(usize),
    Garbage,
    /// Every seventh look finds a circle that is not the ball.
    FalseCircle,
    /// The detector sees circles everywhere, and never the ball.
    Phantoms,
    ArmStuck(usize),
    LineDead(usize),
    /// After so many orders to the gripper.
    GripperDead(usize),
    /// Something is near at this move, and the line is dead when the arm is told to stop.
    StopDead(usize),
    /// The arm stops halfway in this move, for a reason of its own.
    StoppedShort(usize),
    /// After so many moves the arm reports no angle of its second joint, and something is near.
    Nowhere(usize),
    /// After so many moves.
    SensorDead(usize),
    Near(usize),
    /// The arm's own guard halts it halfway in this move.
    Halted(usize),
    /// It halts on the way there, and on the way back.
    HaltedTwice(usize),
    /// It halts the first three moves that show the ball with a radius above this.
    HaltedNear(f64),
    /// The hand itself stands where the ball would show with this radius: every move that shows it
    /// larger is halted, and every way of the gripper to it.
    HandInTheWay(f64),
    /// It halts so many ways of the gripper to the ball.
    HaltedGrips(usize),
    /// It halts the closed hand in its first or second way.
    HaltedClosed(usize),
    /// The jaws hold nothing.
    Slippery,
    /// The jaws squeeze the ball out the first time; where it lies then it cannot be seen from the
    /// lifted hand.
    SqueezedOut,
    /// The ball, once it is in the jaws, shows at the border of the image, from so many looks on.
    ShowsInTheJaws(usize),
    /// The only circle ever seen is one in the middle of the goal: in the first look.
    PhantomOnce,
    /// From the pose of the first look.
    PhantomFromThere,
    /// From everywhere.
    PhantomEverywhere,
    /// The only circle ever seen is at one of two heights in turn; no frames after so many looks.
    Restless(usize),
}

pub(crate) struct Cell {
    pub(crate) truth: CameraModel,
    pub(crate) ball: Point3<f64>,
    pub(crate) fault: Fault,
    pub(crate) joints: Joints,
    pub(crate) closed: bool,
    pub(crate) held: bool,
    /// Set if the jaws hold nothing, beside the fault.
    pub(crate) slippery: bool,
    pub(crate) stops: usize,
    pub(crate) looks: usize,
    looked_first: Option<Joints>,
    moves: usize,
    grips: usize,
    halts: usize,
    closed_moves: usize,
    looks_held: usize,
    closed_at: Option<Joints>,
    old: Option<Features>,
}

impl Cell {
    /// Returns the pose that the arm reports.
    fn reported(&self, mut joints: Joints) -> Joints {
        if matches!(self.fault, Fault::Nowhere(after) if self.moves >= after) {
            joints.0[1] = f64::NAN;
        }
        joints
    }

    fn dead_line(&self, doing: &str) -> ArmError {
        ArmError::Line {
            port: "ttyUSB0".into(),
            doing: doing.into(),
            source: std::io::Error::from(std::io::ErrorKind::BrokenPipe),
        }
    }
}

#[derive(Clone)]
pub(crate) struct Shared(pub(crate) Rc<RefCell<Cell>>, pub(crate) Option<GrayImage>);

impl Shared {
    pub(crate) fn new(truth: CameraModel, ball: [f64; 3], fault: Fault) -> Self {
        Self(
            Rc::new(RefCell::new(Cell {
                truth,
                ball: Point3::from(ball),
                fault,
                joints: Joints::from_degrees([0.0, -90.0, 90.0, 0.0, 0.0, 0.0]),
                closed: false,
                held: false,
                slippery: false,
                stops: 0,
                looks: 0,
                looked_first: None,
                moves: 0,
                grips: 0,
                halts: 0,
                closed_moves: 0,
                looks_held: 0,
                closed_at: None,
                old: None,
            })),
            None,
        )
    }

    /// The cell of the nominal camera, with a ball in easy reach.
    pub(crate) fn paper(fault: Fault) -> Self {
        Self::new(CameraModel::paper(), [0.6, 0.1, -0.1], fault)
    }

    pub(crate) fn run<C: Controller>(
        &self,
        agent: &mut Agent<C>,
        log: &mut EventLog,
    ) -> Result<RunOutcome, AgentError> {
        agent.run_and_learn(
            &mut self.clone(),
            &mut self.clone(),
            &mut self.clone(),
            &mut |event| log.note(event),
        )
    }

    pub(crate) fn miss(&self) -> f64 {
        let cell = self.0.borrow();
        (cell.truth.tool_point(&cell.joints) - cell.ball).norm()
    }
}

/// The plainest controller.
pub(crate) fn servo() -> Servo {
    Servo::new(ServoLaw::PositionBased, ServoSettings::paper())
}

pub(crate) fn hybrid() -> Hybrid {
    Hybrid::new(HybridSettings::paper())
}

/// A behaviour that has not learned anything yet.
pub(crate) fn blank(spec: BehaviourSpec) -> Behaviour {
    let table = QTable::new(spec.states(), spec.actions()).unwrap();
    Behaviour::new(spec, table).unwrap()
}

/// The paper's controller before it has learned anything.
pub(crate) fn learned() -> Learned {
    let pair = BehaviourPair::paper_mended();
    Learned::new(blank(pair.centering), blank(pair.approaching))
}

/// An agent with the settings of [`config`].
pub(crate) fn agent_of<C: Controller>(controller: C) -> Agent<C> {
    Agent::with_controller(config(), controller).unwrap()
}

pub(crate) fn config() -> AgentConfig {
    let poses = [-75.0, -50.0, -25.0, 0.0, 25.0, 50.0];
    AgentConfig::paper(poses.map(|pan| Joints::from_degrees([pan, -110.0, 210.0, 0.0, 45.0, 0.0])))
}

impl Eye for Shared {
    fn look(&mut self) -> Result<Option<Sighting>, FrameError> {
        let mut cell = self.0.borrow_mut();
        cell.looks += 1;
        let seen = cell.truth.view(&cell.joints, &cell.ball).filter(|f| {
            (0.0..192.0).contains(&f.x) && (0.0..144.0).contains(&f.y) && (5.0..68.0).contains(&f.r)
        });
        let seen = match cell.fault {
            Fault::SqueezedOut
                if cell.closed
                    && cell
                        .closed_at
                        .is_some_and(|at| at.0[1] - cell.joints.0[1] > 0.1) =>
            {
                None
            }
            Fault::ShowsInTheJaws(from) if cell.held => {
                cell.looks_held += 1;
                (cell.looks_held > from)
                    .then(|| Features::new(87.0 + 0.01 * cell.looks as f64, 141.0, 27.0))
            }
            Fault::NoFrame(after) if cell.looks > after => {
                return Err(FrameError::Failed {
                    origin: "camera".into(),
                    reason: "unplugged".into(),
                });
            }
            Fault::FrozenFrame(after) if cell.looks > after => cell.old,
            Fault::Garbage => Some(Features::new(f64::NAN, 1e300, -3.0)),
            Fault::PhantomOnce | Fault::PhantomFromThere | Fault::PhantomEverywhere => {
                let here = cell.joints;
                let first = *cell.looked_first.get_or_insert(here);
                let shows = match cell.fault {
                    Fault::PhantomOnce => cell.looks == 1,
                    Fault::PhantomFromThere => here == first,
                    _ => true,
                };
                // Not the same to the last digit: the camera is not frozen.
                shows.then(|| Features::new(103.5, 78.0 + 0.01 * cell.looks as f64, 33.0))
            }
            Fault::Restless(most) if cell.looks > most => {
                return Err(FrameError::Failed {
                    origin: "camera".into(),
                    reason: "looked at for too long".into(),
                });
            }
            Fault::Restless(_) => Some(Features::new(103.5, [75.0, 91.0][cell.looks % 2], 33.0)),
            Fault::FalseCircle if cell.looks.is_multiple_of(7) => {
                Some(Features::new(20.0, 30.0, 25.0))
            }
            Fault::Phantoms => {
                let wander = (cell.looks * 37 % 100) as f64;
                Some(Features::new(
                    40.0 + wander,
                    20.0 + wander,
                    8.0 + 0.4 * wander,
                ))
            }
            _ => seen,
        };
        let (seen, frame) = match cell.fault {
            Fault::FrozenPicture(after) => {
                let number = cell.looks.min(after);
                let seen = if cell.looks > after { cell.old } else { seen };
                cell.old = seen;
                let pixel = |x, y| Luma([(number * 7 + (x * y) as usize) as u8]);
                (seen, Some(GrayImage::from_fn(16, 12, pixel)))
            }
            _ => {
                cell.old = seen.or(cell.old);
                (seen, None)
            }
        };
        drop(cell);
        self.1 = frame;
        Ok(seen.map(Sighting::new))
    }

    fn frame(&self) -> Option<&GrayImage> {
        self.1.as_ref()
    }
}

impl Manipulator for Shared {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        let cell = self.0.borrow();
        Ok(cell.reported(cell.joints))
    }

    fn move_by(&mut self, delta: JointDelta) -> Result<Joints, ArmError> {
        let target = self.0.borrow().joints + delta;
        self.move_to(target)
    }

    fn move_to(&mut self, target: Joints) -> Result<Joints, ArmError> {
        let mut cell = self.0.borrow_mut();
        cell.moves += 1;
        let (moves, from) = (cell.moves, cell.joints);
        let gripping =
            !cell.closed && (target.0[4] - from.0[4]).to_degrees() < -10.0 && from.0[4] > 0.7;
        let halted = match cell.fault {
            Fault::ArmStuck(after) if moves > after => return Ok(from),
            Fault::LineDead(after) if moves > after => {
                return Err(cell.dead_line("DRIVE"));
            }
            Fault::StoppedShort(at) if moves == at => {
                cell.joints =
                    from + JointDelta(std::array::from_fn(|i| 0.5 * (target.0[i] - from.0[i])));
                return Err(ArmError::NotReached {
                    port: "ttyUSB0".into(),
                    joint: Joint::J1,
                    name: "JT1".into(),
                    wanted_degrees: target.degrees()[0],
                    reported_degrees: cell.joints.degrees()[0],
                });
            }
            Fault::Halted(at) => moves == at,
            Fault::HaltedTwice(at) => moves == at || moves == at + 1,
            Fault::HaltedNear(r) => {
                cell.halts < 3
                    && cell
                        .truth
                        .view(&target, &cell.ball)
                        .is_some_and(|f| f.r > r)
            }
            Fault::HandInTheWay(r) => {
                let seen = cell.truth.view(&target, &cell.ball);
                seen.is_none_or(|f| f.r > r) && cell.looks > 0
            }
            Fault::HaltedGrips(times) => gripping && cell.halts < times,
            Fault::HaltedClosed(way) => {
                cell.closed_moves += usize::from(cell.closed);
                cell.closed && cell.halts == 0 && cell.closed_moves == way
            }
            _ => false,
        };
        cell.joints = if halted {
            from + JointDelta(std::array::from_fn(|i| 0.5 * (target.0[i] - from.0[i])))
        } else {
            target
        };
        if cell.held {
            cell.ball = cell.truth.tool_point(&cell.joints);
        }
        if halted {
            cell.halts += 1;
            return Err(ArmError::ProximityStop {
                port: "ttyUSB0".into(),
                signal: 1001,
                joints: cell.joints,
            });
        }
        Ok(cell.reported(cell.joints))
    }

    fn set_gripper(&mut self, gripper: Gripper) -> Result<(), ArmError> {
        let mut cell = self.0.borrow_mut();
        cell.grips += 1;
        if matches!(cell.fault, Fault::GripperDead(after) if cell.grips > after) {
            return Err(cell.dead_line("CLOSEI"));
        }
        cell.closed = gripper == Gripper::Closed;
        let miss = (cell.truth.tool_point(&cell.joints) - cell.ball).norm();
        cell.held = cell.closed && miss < 0.010 && cell.fault != Fault::Slippery && !cell.slippery;
        if cell.fault == Fault::SqueezedOut && cell.held && cell.halts == 0 {
            (cell.held, cell.halts) = (false, 1);
            cell.ball.y += 0.02;
            cell.closed_at = Some(cell.joints);
        }
        Ok(())
    }

    fn stop(&mut self) -> Result<(), ArmError> {
        let mut cell = self.0.borrow_mut();
        cell.stops += 1;
        match cell.fault {
            Fault::StopDead(_) => Err(cell.dead_line("ABORT")),
            _ => Ok(()),
        }
    }
}

impl ProximitySensor for Shared {
    fn object_near(&mut self) -> Result<bool, ArmError> {
        let cell = self.0.borrow();
        match cell.fault {
            Fault::SensorDead(after) if cell.moves > after => {
                Err(cell.dead_line("reading SIG 1001"))
            }
            Fault::Near(at) | Fault::StopDead(at) | Fault::Nowhere(at) => Ok(cell.moves == at),
            _ => Ok(false),
        }
    }
}
