//! The rig: an arm behind a VAL II controller, with the simulated cell around it.

use std::io;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use grasp_agent::{Agent, AgentError, CameraEye, Controller, Event, Outcome};
use hough_heuristic::{CircleDetector, FrameSource};
use pipeline_sim::{Ball, Cell, CellCamera, Renderer, Scene, SharedCell};
#[cfg(feature = "serial")]
use puma_val2::SerialLine;
use puma_val2::nalgebra::Point3;
use puma_val2::{
    ArmError, ClientConfig, Emulator, Gripper, GuardedArm, JointDelta, Joints, Manipulator,
    Profile, ProximitySensor, PumaParams, ServeConfig, TcpLine, Transport, Val2Client,
};

use crate::Contacts;
use crate::surroundings::Surroundings;

/// An arm behind a VAL II controller, calibrated, with a simulated cell around it: a ball to place,
/// a camera on the hand whose frames are rendered from where the arm stands, proximity sensors, and
/// a gripper that holds the ball or misses it.
///
/// With [`Rig::emulated`] the controller is emulated here; camera, sensors and ball follow the
/// emulated arm itself, on its way too, and the sensors are wired to the controller, which stops
/// the arm. With [`Rig::on_port`] and [`Rig::on_socket`] it is somebody else's, and the cell
/// follows what that controller reports at the end of each move; its moves are guarded by its own
/// sensors' input.
pub struct Rig {
    name: String,
    arm: Box<dyn Manipulator>,
    pose: Pose,
    cell: SharedCell,
    surroundings: Surroundings,
    camera: CellCamera<Box<dyn FnMut() -> Joints + Send>>,
}

/// Where the joints are, now and later.
type Pose = Arc<dyn Fn() -> Joints + Send + Sync>;

/// Baud rate of VAL II's terminal line (8 data bits, no parity, one stop bit).
const BAUD: u32 = 9600;

/// How long a socket may take to be connected.
const SOCKET_TIMEOUT: Duration = Duration::from_secs(5);

impl Rig {
    /// Starts a controller emulator on a line of its own and connects to it: a pseudo-terminal
    /// opened through `serialport` like a serial line where the system has them (Unix, feature
    /// `serial`), a local socket elsewhere.
    ///
    /// The emulated arm takes no time unless `realtime`. `scene` and `seed` are the renderer's.
    ///
    /// # Errors
    /// The system has no line to spare, or the emulator cannot be reached through it.
    pub fn emulated(realtime: bool, scene: &Scene, seed: u64) -> Result<Self, RigError> {
        let (cell, client_config) = (paper_cell(), ClientConfig::for_emulator());
        let surroundings = Surroundings::new(cell.clone());
        let mut emulator = Emulator::new(PumaParams::unimation(), Profile::val2());
        let around = surroundings.clone();
        emulator
            .attach_sensor(client_config.proximity_signal, move |joints| {
                around.hand_at(joints)
            })
            .map_err(|fault| RigError::Serve(io::Error::other(fault.to_string())))?;
        let config = ServeConfig {
            realtime,
            ..ServeConfig::default()
        };
        #[cfg(all(unix, feature = "serial"))]
        let (server, line) = {
            let server = puma_val2::PtyServer::spawn(emulator, config).map_err(RigError::Serve)?;
            let line = SerialLine::open(&server.path().to_string_lossy(), BAUD)?;
            (server, line)
        };
        #[cfg(not(all(unix, feature = "serial")))]
        let (server, line) = {
            let server = puma_val2::TcpServer::spawn("127.0.0.1:0", emulator, config)
                .map_err(RigError::Serve)?;
            let line = TcpLine::connect(&server.address().to_string(), SOCKET_TIMEOUT)?;
            (server, line)
        };
        let name = line.name().to_owned();
        let pose: Pose = Arc::new(move || server.joints());
        let arm = ArmInCell {
            arm: connect(line, client_config)?,
            surroundings: surroundings.clone(),
            pose: Arc::clone(&pose),
            reported: None,
        };
        Ok(Self::assemble(
            name,
            Box::new(arm),
            pose,
            surroundings,
            cell,
            (scene, seed),
        ))
    }

    /// Connects to the controller on the serial device `path`.
    ///
    /// # Errors
    /// No such device, a busy one, or no VAL II monitor at its other end.
    #[cfg(feature = "serial")]
    pub fn on_port(path: &str, scene: &Scene, seed: u64) -> Result<Self, RigError> {
        Self::elsewhere(SerialLine::open(path, BAUD)?, scene, seed)
    }

    /// Connects to the controller behind the socket `address` (`host:port`).
    ///
    /// # Errors
    /// Nobody listens there, or no VAL II monitor does.
    pub fn on_socket(address: &str, scene: &Scene, seed: u64) -> Result<Self, RigError> {
        Self::elsewhere(TcpLine::connect(address, SOCKET_TIMEOUT)?, scene, seed)
    }

    fn elsewhere<T: Transport + 'static>(
        line: T,
        scene: &Scene,
        seed: u64,
    ) -> Result<Self, RigError> {
        let name = line.name().to_owned();
        let mut arm = connect(line, ClientConfig::default())?;
        let reported = Arc::new(Mutex::new(arm.joints()?));
        let pose: Pose = {
            let reported = Arc::clone(&reported);
            Arc::new(move || *reported.lock().unwrap_or_else(PoisonError::into_inner))
        };
        let cell = paper_cell();
        let surroundings = Surroundings::new(cell.clone());
        surroundings.hand_at(&pose());
        let arm = ArmInCell {
            arm,
            surroundings: surroundings.clone(),
            pose: Arc::clone(&pose),
            reported: Some(reported),
        };
        Ok(Self::assemble(
            name,
            Box::new(arm),
            pose,
            surroundings,
            cell,
            (scene, seed),
        ))
    }

    fn assemble(
        name: String,
        arm: Box<dyn Manipulator>,
        pose: Pose,
        surroundings: Surroundings,
        cell: SharedCell,
        (scene, seed): (&Scene, u64),
    ) -> Self {
        let look_from: Box<dyn FnMut() -> Joints + Send> = {
            let pose = Arc::clone(&pose);
            Box::new(move || pose())
        };
        let camera = CellCamera::new(cell.clone(), Renderer::new(scene, seed), look_from);
        Self {
            name,
            arm,
            pose,
            cell,
            surroundings,
            camera,
        }
    }

    /// What the line to the controller is called: a device path or an address.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The cell around the arm.
    pub fn cell(&self) -> &SharedCell {
        &self.cell
    }

    /// Puts the ball, on a holder, at another place, out of the jaws if they held it; contacts are
    /// counted from here on.
    ///
    /// # Errors
    /// [`PlaceError::InHand`] where ball or holder would stand in the hand, which rests there; then
    /// nothing has changed.
    pub fn place(&mut self, ball: &Ball) -> Result<(), PlaceError> {
        let joints = (self.pose)();
        let placed = self.cell.with(|cell| {
            let (mut there, mut nowhere) = (*cell, *cell);
            there.place_ball(ball.centre);
            take_away(&mut nowhere);
            // A hand that overlaps the table does so wherever the ball is.
            let free = !there.collides(&joints) || nowhere.collides(&joints);
            if free {
                *cell = there;
            }
            free
        });
        if !placed {
            return Err(PlaceError::InHand {
                ball_mm: (ball.centre.coords * 1000.0).into(),
            });
        }
        self.surroundings.begin();
        Ok(())
    }

    /// As [`Rig::place`]; where the hand is in the way the arm first goes to VAL's READY pose,
    /// straight up.
    ///
    /// # Errors
    /// What kept the arm from getting there.
    pub fn place_making_room(&mut self, ball: &Ball) -> Result<(), PlaceError> {
        match self.place(ball) {
            Err(PlaceError::InHand { .. }) => {
                self.clear_for(Joints::from_degrees([0.0, -90.0, 90.0, 0.0, 0.0, 0.0]))?;
                self.place(ball)
            }
            placed => placed,
        }
    }

    /// Takes the ball and its holder out of the cell, opens the jaws, and takes the arm to `pose`;
    /// then the next ball can be placed.
    ///
    /// # Errors
    /// What kept the arm from getting there.
    pub fn clear_for(&mut self, pose: Joints) -> Result<(), ArmError> {
        self.cell.with(take_away);
        self.arm.set_gripper(Gripper::Open)?;
        match self.arm.move_to(pose) {
            // An arm that stood close to what has just been taken away.
            Err(ArmError::ProximityStop { .. }) => self.arm.move_to(pose).map(drop),
            outcome => outcome.map(drop),
        }
    }

    /// What the hand has done in the cell since the ball was placed.
    pub fn contacts(&self) -> Contacts {
        self.surroundings.contacts()
    }

    /// Whether the ball is in the jaws.
    pub fn holds_ball(&self) -> bool {
        self.cell.get().held.is_some()
    }

    /// Lets `agent` go for the ball.
    ///
    /// # Errors
    /// Those of [`Agent::run`].
    pub fn run<C: Controller + Clone>(
        &mut self,
        agent: &Agent<C>,
        detector: &mut dyn CircleDetector,
        observe: &mut dyn FnMut(&Event<'_>),
    ) -> Result<Outcome, AgentError> {
        self.run_and_learn(&mut agent.clone(), detector, observe)
    }

    /// As [`Rig::run`], keeping what the controller learns.
    ///
    /// # Errors
    /// Those of [`Agent::run_and_learn`].
    pub fn run_and_learn<C: Controller>(
        &mut self,
        agent: &mut Agent<C>,
        detector: &mut dyn CircleDetector,
        observe: &mut dyn FnMut(&Event<'_>),
    ) -> Result<Outcome, AgentError> {
        let RigParts {
            camera,
            arm,
            mut sensor,
        } = self.parts();
        agent.run_and_learn(
            &mut CameraEye::new(camera, detector),
            arm,
            &mut *sensor,
            observe,
        )
    }

    /// Camera, arm and sensor apart, for an eye of one's own or with something in between.
    pub fn parts(&mut self) -> RigParts<'_> {
        RigParts {
            camera: &mut self.camera,
            arm: &mut *self.arm,
            sensor: Box::new(CellSensor {
                cell: self.cell.clone(),
                pose: Arc::clone(&self.pose),
            }),
        }
    }

    /// Where the arm stands, now and whenever the closure is called.
    pub fn pose(&self) -> impl Fn() -> Joints + Send + Sync + use<> {
        let pose = Arc::clone(&self.pose);
        move || pose()
    }

    /// How far the point between the jaws is from the ball's centre, metres.
    pub fn grip_miss(&self) -> f64 {
        self.cell.get().grip_miss(&(self.pose)())
    }
}

/// What a [`Rig`] is made of.
pub struct RigParts<'a> {
    /// The camera on the hand.
    pub camera: &'a mut dyn FrameSource,
    /// The arm behind its controller.
    pub arm: &'a mut dyn Manipulator,
    /// The sensors on the hand.
    pub sensor: Box<dyn ProximitySensor>,
}

impl std::fmt::Debug for RigParts<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("RigParts").finish_non_exhaustive()
    }
}

impl std::fmt::Debug for Rig {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Rig")
            .field("name", &self.name)
            .field("cell", &self.cell)
            .finish_non_exhaustive()
    }
}

/// Takes the ball and its holder out of the cell.
fn take_away(cell: &mut Cell) {
    cell.place_ball(Point3::new(-9.0, 0.0, -0.1));
    cell.holder = None;
}

/// The cell that a rig begins with.
fn paper_cell() -> SharedCell {
    SharedCell::new(Cell::paper(Ball::at(0.6, 0.0, -0.1)))
}

/// Gets hold of the monitor, calibrates, and arms the proximity guard.
fn connect<T: Transport>(line: T, config: ClientConfig) -> Result<GuardedArm<T>, ArmError> {
    let config = ClientConfig {
        speed_percent: Some(100.0),
        power_retries: 15,
        ..config
    };
    let mut client = Val2Client::connect(line, config)?;
    client.calibrate()?;
    GuardedArm::new(client)
}

/// The proximity sensors of a simulated cell.
struct CellSensor {
    cell: SharedCell,
    pose: Pose,
}

impl ProximitySensor for CellSensor {
    fn object_near(&mut self) -> Result<bool, ArmError> {
        let joints = (self.pose)();
        Ok(self.cell.with(|cell| cell.proximity(&joints)))
    }
}

/// An arm that the cell follows.
struct ArmInCell<M> {
    arm: M,
    surroundings: Surroundings,
    pose: Pose,
    /// For the cell to know where the arm is, what it reports; `None` where the cell sees it move.
    reported: Option<Arc<Mutex<Joints>>>,
}

impl<M: Manipulator> ArmInCell<M> {
    fn note(&self, outcome: Result<Joints, ArmError>) -> Result<Joints, ArmError> {
        let stands = match &outcome {
            Ok(joints) | Err(ArmError::ProximityStop { joints, .. }) => Some(joints),
            Err(_) => None,
        };
        if let (Some(reported), Some(joints)) = (&self.reported, stands) {
            *reported.lock().unwrap_or_else(PoisonError::into_inner) = *joints;
            self.surroundings.hand_at(joints);
        }
        outcome
    }
}

impl<M: Manipulator> Manipulator for ArmInCell<M> {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        let joints = self.arm.joints();
        self.note(joints)
    }

    fn move_by(&mut self, delta: JointDelta) -> Result<Joints, ArmError> {
        let joints = self.arm.move_by(delta);
        self.note(joints)
    }

    fn move_to(&mut self, target: Joints) -> Result<Joints, ArmError> {
        let joints = self.arm.move_to(target);
        self.note(joints)
    }

    fn set_gripper(&mut self, gripper: Gripper) -> Result<(), ArmError> {
        self.arm.set_gripper(gripper)?;
        self.surroundings.jaws(gripper, &(self.pose)());
        Ok(())
    }

    fn stop(&mut self) -> Result<(), ArmError> {
        self.arm.stop()
    }
}

/// Why a ball could not be placed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlaceError {
    /// Ball or holder would stand in the hand.
    #[error(
        "a ball at {:.0} {:.0} {:.0} mm would stand in the hand, which rests there; take the arm away first",
        ball_mm[0], ball_mm[1], ball_mm[2]
    )]
    InHand {
        /// The ball's centre, millimetres.
        ball_mm: [f64; 3],
    },
    /// The arm could not be taken away.
    #[error(transparent)]
    Arm(#[from] ArmError),
}

/// Why a rig could not be set up.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RigError {
    /// The emulator could not be served.
    #[error("the controller emulator cannot be served: {0}")]
    Serve(#[source] io::Error),
    /// The line or the controller.
    #[error(transparent)]
    Arm(#[from] ArmError),
}
