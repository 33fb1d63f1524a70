//! A cell: a model for the truth, a ball, joints; and ways to break it.

use std::cell::RefCell;
use std::rc::Rc;

use grasp_agent::hough_heuristic::image::{GrayImage, Luma};
use grasp_agent::hough_heuristic::{Detection, Features, FrameError};
use grasp_agent::nalgebra::Point3;
use grasp_agent::puma_val2::{ArmError, Gripper, JointDelta, Joints, Manipulator, ProximitySensor};
use grasp_agent::{
    Agent, AgentConfig, AgentError, CameraModel, Controller, EventLog, Eye, Look, Outcome, Sighting,
};

/// What can go wrong, and after how many looks or moves.
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
    /// After so many moves.
    SensorDead(usize),
    Near(usize),
}

pub(crate) struct Cell {
    pub(crate) truth: CameraModel,
    pub(crate) ball: Point3<f64>,
    pub(crate) fault: Fault,
    pub(crate) joints: Joints,
    pub(crate) closed: bool,
    pub(crate) stops: usize,
    pub(crate) looks: usize,
    moves: usize,
    grips: usize,
    old: Option<Features>,
}

impl Cell {
    fn dead_line(&self, doing: &str) -> ArmError {
        ArmError::Line {
            port: "ttyUSB0".into(),
            doing: doing.into(),
            source: std::io::Error::from(std::io::ErrorKind::BrokenPipe),
        }
    }
}

#[derive(Clone)]
pub(crate) struct Shared(pub(crate) Rc<RefCell<Cell>>);

impl Shared {
    pub(crate) fn new(truth: CameraModel, ball: [f64; 3], fault: Fault) -> Self {
        Self(Rc::new(RefCell::new(Cell {
            truth,
            ball: Point3::from(ball),
            fault,
            joints: Joints::from_degrees([0.0, -90.0, 90.0, 0.0, 0.0, 0.0]),
            closed: false,
            stops: 0,
            looks: 0,
            moves: 0,
            grips: 0,
            old: None,
        })))
    }

    pub(crate) fn run<C: Controller>(
        &self,
        agent: &mut Agent<C>,
        log: &mut EventLog,
    ) -> Result<Outcome, AgentError> {
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

pub(crate) fn config() -> AgentConfig {
    let poses = [-75.0, -50.0, -25.0, 0.0, 25.0, 50.0];
    AgentConfig::paper(poses.map(|pan| Joints::from_degrees([pan, -110.0, 210.0, 0.0, 45.0, 0.0])))
}

impl Eye for Shared {
    fn look(&mut self) -> Result<Look, FrameError> {
        let mut cell = self.0.borrow_mut();
        cell.looks += 1;
        let seen = cell.truth.view(&cell.joints, &cell.ball).filter(|f| {
            (0.0..192.0).contains(&f.x) && (0.0..144.0).contains(&f.y) && (5.0..68.0).contains(&f.r)
        });
        let seen = match cell.fault {
            Fault::NoFrame(after) if cell.looks > after => {
                return Err(FrameError::Failed {
                    origin: "camera".into(),
                    reason: "unplugged".into(),
                });
            }
            Fault::FrozenFrame(after) if cell.looks > after => cell.old,
            Fault::Garbage => Some(Features {
                x: f64::NAN,
                y: 1e300,
                r: -3.0,
            }),
            Fault::FalseCircle if cell.looks.is_multiple_of(7) => Some(Features {
                x: 20.0,
                y: 30.0,
                r: 25.0,
            }),
            Fault::Phantoms => {
                let wander = (cell.looks * 37 % 100) as f64;
                Some(Features {
                    x: 40.0 + wander,
                    y: 20.0 + wander,
                    r: 8.0 + 0.4 * wander,
                })
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
        let ball = seen.map(|features| Sighting {
            features,
            detection: Detection {
                circle: features.to_circle(768),
                score: 1.0,
            },
        });
        Ok(Look { frame, ball })
    }
}

impl Manipulator for Shared {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        Ok(self.0.borrow().joints)
    }

    fn move_by(&mut self, delta: JointDelta) -> Result<Joints, ArmError> {
        let target = self.0.borrow().joints + delta;
        self.move_to(target)
    }

    fn move_to(&mut self, target: Joints) -> Result<Joints, ArmError> {
        let mut cell = self.0.borrow_mut();
        cell.moves += 1;
        match cell.fault {
            Fault::ArmStuck(after) if cell.moves > after => {}
            Fault::LineDead(after) if cell.moves > after => return Err(cell.dead_line("DRIVE")),
            _ => cell.joints = target,
        }
        Ok(cell.joints)
    }

    fn set_gripper(&mut self, gripper: Gripper) -> Result<(), ArmError> {
        let mut cell = self.0.borrow_mut();
        cell.grips += 1;
        match cell.fault {
            Fault::GripperDead(after) if cell.grips > after => return Err(cell.dead_line("CLOSEI")),
            _ => cell.closed = gripper == Gripper::Closed,
        }
        Ok(())
    }

    fn stop(&mut self) -> Result<(), ArmError> {
        self.0.borrow_mut().stops += 1;
        Ok(())
    }
}

impl ProximitySensor for Shared {
    fn object_near(&mut self) -> Result<bool, ArmError> {
        let cell = self.0.borrow();
        match cell.fault {
            Fault::SensorDead(after) if cell.moves > after => Err(cell.dead_line("reading SIG 1001")),
            Fault::Near(at) => Ok(cell.moves == at),
            _ => Ok(false),
        }
    }
}
