//! The rig: an arm behind a VAL II controller, with the simulated cell around it.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use grasp_agent::{Agent, AgentError, CameraEye, Controller, RunEvent, RunOutcome};
use hough_heuristic::{CircleDetector, FrameSource};
use pipeline_sim::{Ball, Cell, CellCamera, Contacts, Renderer, Scene, SharedCell};
#[cfg(not(target_family = "wasm"))]
use puma_val2::EmulatorServer;
#[cfg(feature = "serial")]
use puma_val2::SerialLine;
use puma_val2::{
    ArmError, ClientConfig, Emulator, Gripper, GuardedArm, Joints, Manipulator, Profile,
    ProximitySensor, PumaParams, ServeConfig, TcpLine, Transport, Val2Client,
};

use crate::detector::BallDetector;
#[cfg(target_family = "wasm")]
use crate::shared_line::SharedLine;

/// An arm behind a VAL II controller, calibrated, in a simulated cell: a ball to place, a camera on
/// the hand whose frames are rendered from the arm's pose, proximity sensors, and a gripper that
/// holds the ball or misses it.
///
/// [`Rig::emulated`] starts an emulated controller. Camera, sensors and ball then follow the
/// emulated arm during its moves too, and the sensors are wired to the controller, which stops the
/// arm. [`Rig::on_port`] and [`Rig::on_socket`] connect to another controller. The cell then
/// follows the pose that it reports at the end of each move, and its own sensors guard the moves.
/// [`Rig::seen_by`] replaces the simulated cell by a real camera.
///
/// All three take a flag. Once it is set, the arm is stopped by the controller's own stop: the
/// order under way, or the next one, ends with an error.
pub struct Rig {
    name: String,
    arm: Box<dyn Manipulator>,
    pose: Pose,
    cell: SharedCell,
    camera: CellCamera<Box<dyn FnMut() -> Joints + Send>>,
    /// A real camera, if there is one.
    real: Option<Box<dyn FrameSource + Send>>,
}

/// Reader of the current angles of the arm's links.
type Pose = Arc<dyn Fn() -> Joints + Send + Sync>;

/// Baud rate of VAL II's terminal line (8 data bits, no parity, one stop bit).
#[cfg(feature = "serial")]
const BAUD: u32 = 9600;

/// Monitor speed of an emulated arm, percent.
const FULL_SPEED: f64 = 100.0;

/// Longest time for a socket to connect.
const SOCKET_TIMEOUT: Duration = Duration::from_secs(5);

impl Rig {
    /// Starts a controller emulator and connects to it: through a pseudo-terminal opened like a
    /// serial line where the system has them (Unix, feature `serial`), in memory in WebAssembly,
    /// through a local socket elsewhere.
    ///
    /// The emulated arm moves in no time unless `realtime` is set. `scene` and `seed` are the
    /// renderer's.
    ///
    /// # Errors
    /// The system has no free line, or the emulator does not answer on it.
    pub fn emulated(
        realtime: bool,
        scene: &Scene,
        seed: u64,
        stop: &Arc<AtomicBool>,
    ) -> Result<Self, RigError> {
        let (cell, client_config) = (paper_cell(), ClientConfig::for_emulator());
        let mut emulator = Emulator::new(PumaParams::unimation(), Profile::val2());
        let around = cell.clone();
        emulator
            .attach_sensor(client_config.proximity_signal, move |joints| {
                around.move_hand(&around.links(joints))
            })
            .map_err(|fault| RigError::Serve(io::Error::other(fault.to_string())))?;
        let config = ServeConfig {
            realtime,
            ..ServeConfig::default()
        };
        #[cfg(target_family = "wasm")]
        let (server, line) = {
            // There are no threads and no devices: the controller runs when it is waited for.
            let _ = config;
            let line = SharedLine::new(emulator);
            (line.clone(), line)
        };
        #[cfg(all(unix, feature = "serial"))]
        let (server, line) = {
            let server = EmulatorServer::pty(emulator, config).map_err(RigError::Serve)?;
            let line = SerialLine::open(server.address(), BAUD)?;
            (server, line)
        };
        #[cfg(not(any(target_family = "wasm", all(unix, feature = "serial"))))]
        let (server, line) = {
            let server =
                EmulatorServer::tcp("127.0.0.1:0", emulator, config).map_err(RigError::Serve)?;
            let line = TcpLine::connect(server.address(), SOCKET_TIMEOUT)?;
            (server, line)
        };
        let name = line.name().to_owned();
        let linked = cell.clone();
        let pose: Pose =
            Arc::new(move || linked.links(&server.with_emulator(|emulator| emulator.joints())));
        let arm = {
            let pose = Arc::clone(&pose);
            cell.with_jaws_of(connect(line, client_config, FULL_SPEED, stop)?, move || {
                pose()
            })
        };
        let arm = Box::new(arm);
        Ok(Self::assemble(name, arm, pose, cell, (scene, seed)))
    }

    /// Connects to the controller on the serial device `path`, sets its monitor speed to `speed`
    /// percent, and calibrates the arm, which turns every joint a little.
    ///
    /// # Errors
    /// No such device, a busy one, or no VAL II monitor at its other end.
    #[cfg(feature = "serial")]
    pub fn on_port(
        path: &str,
        speed: f64,
        scene: &Scene,
        seed: u64,
        stop: &Arc<AtomicBool>,
    ) -> Result<Self, RigError> {
        Self::elsewhere(SerialLine::open(path, BAUD)?, speed, (scene, seed), stop)
    }

    /// Connects to the controller behind the socket `address` (`host:port`), in the same way.
    ///
    /// # Errors
    /// Nothing listens there, or it is not a VAL II monitor.
    pub fn on_socket(
        address: &str,
        speed: f64,
        scene: &Scene,
        seed: u64,
        stop: &Arc<AtomicBool>,
    ) -> Result<Self, RigError> {
        let line = TcpLine::connect(address, SOCKET_TIMEOUT)?;
        Self::elsewhere(line, speed, (scene, seed), stop)
    }

    /// Replaces the simulated cell by what a real camera on the hand sees. The rendered ball is
    /// gone, and [`Rig::place`] moves nothing; the controller's own sensors guard the arm.
    #[must_use]
    pub fn seen_by(mut self, camera: impl FrameSource + Send + 'static) -> Self {
        self.cell.remove_ball();
        self.real = Some(Box::new(camera));
        self
    }

    /// Returns `false` if a real camera sees what the arm does.
    pub fn is_simulated(&self) -> bool {
        self.real.is_none()
    }

    fn elsewhere<T: Transport + 'static>(
        line: T,
        speed: f64,
        rendered: (&Scene, u64),
        stop: &Arc<AtomicBool>,
    ) -> Result<Self, RigError> {
        let name = line.name().to_owned();
        let mut arm = connect(line, ClientConfig::default(), speed, stop)?;
        let (cell, start) = (paper_cell(), arm.joints()?);
        let (arm, pose) = cell.follow(arm, start);
        let (arm, pose): (_, Pose) = (Box::new(arm), Arc::new(pose));
        Ok(Self::assemble(name, arm, pose, cell, rendered))
    }

    fn assemble(
        name: String,
        arm: Box<dyn Manipulator>,
        pose: Pose,
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
            camera,
            real: None,
        }
    }

    /// Returns the name of the line to the controller: a device path or an address.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the cell around the arm.
    pub fn cell(&self) -> &SharedCell {
        &self.cell
    }

    /// Puts the ball, on a holder, at another place, and counts contacts from zero. Where the hand
    /// is in the way, the arm first moves to VAL's READY pose, straight up.
    ///
    /// # Errors
    /// [`RigError::InHand`] if ball or holder would still stand in the hand, which leaves the
    /// cell unchanged, and what kept the arm from moving away.
    pub fn place(&mut self, ball: &Ball) -> Result<(), RigError> {
        if self.is_simulated() && !self.put(ball) {
            self.clear_for(Joints::from_degrees([0.0, -90.0, 90.0, 0.0, 0.0, 0.0]))?;
            if !self.put(ball) {
                return Err(RigError::InHand {
                    ball_mm: (ball.centre.coords * 1000.0).into(),
                });
            }
        }
        Ok(())
    }

    /// Puts the ball at its place. Returns `false`, and changes nothing, if it would overlap the
    /// hand.
    fn put(&self, ball: &Ball) -> bool {
        self.cell.place_ball(ball.centre, &(self.pose)())
    }

    /// Removes the ball and its holder from the cell, opens the jaws, and moves the arm to `pose`.
    ///
    /// # Errors
    /// [`ArmError`] if the arm does not reach the pose.
    pub fn clear_for(&mut self, pose: Joints) -> Result<(), ArmError> {
        self.cell.remove_ball();
        self.arm.set_gripper(Gripper::Open)?;
        match self.arm.move_to(pose) {
            // The arm stood close to what has just been removed.
            Err(ArmError::ProximityStop { .. }) => self.arm.move_to(pose).map(drop),
            outcome => outcome.map(drop),
        }
    }

    /// Returns the contacts of the hand with the cell since the ball was placed.
    pub fn contacts(&self) -> Contacts {
        self.cell.contacts()
    }

    /// Returns whether the ball is in the jaws.
    pub fn holds_ball(&self) -> bool {
        self.cell.get().held.is_some()
    }

    /// Lets `agent` find, reach and grasp the ball. The controller keeps what it learns.
    ///
    /// # Errors
    /// Those of [`Agent::run_and_learn`].
    pub fn run<C: Controller>(
        &mut self,
        agent: &mut Agent<C>,
        detector: &mut dyn CircleDetector,
        observe: &mut dyn FnMut(&RunEvent<'_>),
    ) -> Result<RunOutcome, AgentError> {
        let RigParts {
            camera,
            arm,
            mut sensor,
        } = self.parts();
        let mut eye = CameraEye::new(camera, detector);
        agent.run_and_learn(&mut eye, arm, &mut *sensor, observe)
    }

    /// Returns camera, arm and sensor, for a caller that puts something of its own in between.
    pub fn parts(&mut self) -> RigParts<'_> {
        let (camera, sensor): (&mut dyn FrameSource, Box<dyn ProximitySensor>) =
            match &mut self.real {
                Some(camera) => (&mut **camera, Box::new(ControllersOwn)),
                None => {
                    let pose = Arc::clone(&self.pose);
                    let sensor = self.cell.sensor(move || pose());
                    (&mut self.camera, Box::new(sensor))
                }
            };
        RigParts {
            camera,
            arm: &mut *self.arm,
            sensor,
        }
    }

    /// Returns a closure that reads the current angles of the arm's links, which are those that it
    /// reports unless the cell has other errors ([`SharedCell::set_errors`]).
    pub fn pose(&self) -> impl Fn() -> Joints + Send + Sync + use<> {
        let pose = Arc::clone(&self.pose);
        move || pose()
    }
}

/// The devices of a [`Rig`].
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

/// Sensors that the controller alone reads: it stops the arm, whose order then ends with
/// [`ArmError::ProximityStop`].
struct ControllersOwn;

impl ProximitySensor for ControllersOwn {
    fn object_near(&mut self) -> Result<bool, ArmError> {
        Ok(false)
    }
}

/// Returns the cell that a rig begins with.
fn paper_cell() -> SharedCell {
    SharedCell::new(Cell::paper(Ball::at(0.6, 0.0, -0.1)))
}

/// A line that fails once when a flag is set, upon which the client stops the arm.
#[derive(Debug)]
struct StoppableLine<T> {
    inner: T,
    stop: Arc<AtomicBool>,
    /// Set when the line has failed for the flag.
    told: bool,
}

/// Longest wait between two looks at the flag.
const LOOK: Duration = Duration::from_millis(20);

impl<T: Transport> Transport for StoppableLine<T> {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.inner.send(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<Option<usize>> {
        let until = self.inner.clock().saturating_add(timeout);
        loop {
            let stop = self.stop.load(Ordering::Relaxed);
            if stop && !std::mem::replace(&mut self.told, true) {
                return Err(io::Error::other("stopped on request"));
            }
            let left = until.saturating_sub(self.inner.clock());
            let count = self.inner.receive(buffer, left.min(LOOK))?;
            if count.is_some() || left <= LOOK {
                return Ok(count);
            }
        }
    }

    fn clock(&self) -> Duration {
        self.inner.clock()
    }

    fn name(&self) -> &str {
        self.inner.name()
    }
}

/// Connects to the monitor, calibrates, and arms the proximity guard.
fn connect<T: Transport>(
    line: T,
    config: ClientConfig,
    speed: f64,
    stop: &Arc<AtomicBool>,
) -> Result<GuardedArm<StoppableLine<T>>, ArmError> {
    let config = ClientConfig {
        speed_percent: Some(speed),
        power_retries: 15,
        ..config
    };
    let line = StoppableLine {
        inner: line,
        stop: Arc::clone(stop),
        told: false,
    };
    let mut client = Val2Client::connect(line, config)?;
    if let Err(error) = client.calibrate() {
        // The joints may be turning.
        let _ = client.stop();
        return Err(error);
    }
    GuardedArm::new(client)
}

/// Error of choosing a detector, setting up a rig, or placing a ball.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RigError {
    /// The emulator could not be served.
    #[error("the controller emulator cannot be served: {0}")]
    Serve(#[source] io::Error),
    /// No detector has this name.
    #[error(
        "there is no detector {0:?}; there are {names}",
        names = BallDetector::ALL.map(BallDetector::name).join(", ")
    )]
    UnknownDetector(String),
    /// Ball or holder would stand in the hand.
    #[error(
        "a ball at {:.0} {:.0} {:.0} mm would stand in the hand; move the arm away first",
        ball_mm[0], ball_mm[1], ball_mm[2]
    )]
    InHand {
        /// The ball's centre, millimetres.
        ball_mm: [f64; 3],
    },
    /// The line or the controller failed.
    #[error(transparent)]
    Arm(#[from] ArmError),
}
