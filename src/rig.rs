//! The rig: an arm behind a VAL II controller, with the simulated cell around it.

use std::io;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use grasp_agent::{Agent, AgentError, CameraEye, Controller, Event, Outcome};
use hough_heuristic::{CircleDetector, FrameSource};
use pipeline_sim::{Ball, Cell, CellCamera, Renderer, Scene, SharedCell};
#[cfg(feature = "serial")]
use puma_val2::SerialLine;
use puma_val2::{
    ArmError, ClientConfig, Emulator, Gripper, JointDelta, Joints, Manipulator, MoveWay, Profile,
    ProximitySensor, PumaParams, ServeConfig, TcpLine, Transport, Val2Client,
};

/// An arm behind a VAL II controller, calibrated, with a simulated cell around it: a ball to place, a camera on the hand whose
/// frames are rendered from where the arm stands, and proximity sensors.
///
/// With [`Rig::emulated`] the controller is emulated here and the camera follows the emulated arm itself. With [`Rig::on_port`] and
/// [`Rig::on_socket`] it is somebody else's, and the camera follows what that controller reports.
pub struct Rig {
    name: String,
    arm: Box<dyn Manipulator>,
    pose: Pose,
    cell: SharedCell,
    camera: CellCamera<Box<dyn FnMut() -> Joints + Send>>,
}

/// Where the joints are, now and later.
type Pose = Arc<dyn Fn() -> Joints + Send + Sync>;

/// Baud rate of VAL II's terminal line (8 data bits, no parity, one stop bit).
const BAUD: u32 = 9600;

/// How long a socket may take to be connected.
const SOCKET_TIMEOUT: Duration = Duration::from_secs(5);

impl Rig {
    /// Starts a controller emulator on a line of its own and connects to it: a pseudo-terminal opened through `serialport`
    /// like a serial line where the system has them (Unix, feature `serial`), a local socket elsewhere.
    ///
    /// The emulated arm takes no time unless `realtime`. `scene` and `seed` are the renderer's.
    ///
    /// # Errors
    /// The system has no line to spare, or the emulator cannot be reached through it.
    pub fn emulated(realtime: bool, scene: &Scene, seed: u64) -> Result<Self, RigError> {
        let emulator = Emulator::new(PumaParams::unimation(), Profile::val2());
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
            let server =
                puma_val2::TcpServer::spawn("127.0.0.1:0", emulator, config).map_err(RigError::Serve)?;
            let line = TcpLine::connect(&server.address().to_string(), SOCKET_TIMEOUT)?;
            (server, line)
        };
        let name = line.name().to_owned();
        let arm = connect(line, ClientConfig::for_emulator())?;
        Ok(Self::assemble(
            name,
            Box::new(arm),
            Arc::new(move || server.joints()),
            scene,
            seed,
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

    fn elsewhere<T: Transport + 'static>(line: T, scene: &Scene, seed: u64) -> Result<Self, RigError> {
        let name = line.name().to_owned();
        let (arm, pose) = Mirrored::new(connect(line, ClientConfig::default())?)?;
        Ok(Self::assemble(name, Box::new(arm), pose, scene, seed))
    }

    fn assemble(name: String, arm: Box<dyn Manipulator>, pose: Pose, scene: &Scene, seed: u64) -> Self {
        let cell = SharedCell::new(Cell::paper(Ball::at(0.6, 0.0, -0.1)));
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

    /// Puts the ball, on a holder, at another place.
    pub fn place(&mut self, ball: &Ball) {
        self.cell.with(|cell| cell.place_ball(ball.centre));
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
        agent.run_and_learn(&mut CameraEye::new(camera, detector), arm, &mut *sensor, observe)
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

/// Gets hold of the monitor and calibrates. Joints are moved one by one with `DRIVE`, as the paper's increments are.
fn connect<T: Transport>(line: T, config: ClientConfig) -> Result<Val2Client<T>, ArmError> {
    let config = ClientConfig {
        way: MoveWay::Drive,
        speed_percent: Some(100.0),
        power_retries: 15,
        ..config
    };
    let mut client = Val2Client::connect(line, config)?;
    client.calibrate()?;
    Ok(client)
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

/// An arm whose last reported joint angles others can read.
struct Mirrored<M> {
    arm: M,
    reported: Arc<Mutex<Joints>>,
}

impl<M: Manipulator> Mirrored<M> {
    fn new(mut arm: M) -> Result<(Self, Pose), ArmError> {
        let reported = Arc::new(Mutex::new(arm.joints()?));
        let pose = {
            let reported = Arc::clone(&reported);
            Arc::new(move || *reported.lock().unwrap_or_else(PoisonError::into_inner))
        };
        Ok((Self { arm, reported }, pose))
    }

    fn note(&self, joints: Joints) -> Joints {
        *self.reported.lock().unwrap_or_else(PoisonError::into_inner) = joints;
        joints
    }
}

impl<M: Manipulator> Manipulator for Mirrored<M> {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        let joints = self.arm.joints()?;
        Ok(self.note(joints))
    }

    fn move_by(&mut self, delta: JointDelta) -> Result<Joints, ArmError> {
        let joints = self.arm.move_by(delta)?;
        Ok(self.note(joints))
    }

    fn move_to(&mut self, target: Joints) -> Result<Joints, ArmError> {
        let joints = self.arm.move_to(target)?;
        Ok(self.note(joints))
    }

    fn set_gripper(&mut self, gripper: Gripper) -> Result<(), ArmError> {
        self.arm.set_gripper(gripper)
    }

    fn stop(&mut self) -> Result<(), ArmError> {
        self.arm.stop()
    }
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
