//! Faults of camera, detector, arm and line: the arm stops, the cause is the last event and a typed
//! error, and the controller keeps what it had learned.

use std::sync::Arc;

use grasp_agent::{
    Agent, AgentConfig, AgentError, Belief, CameraEye, EventKind, EventLog, GaveUp, Hybrid,
    HybridSettings, Prior, RunOutcome,
};
use hough_heuristic::image::{GrayImage, Luma};
use hough_heuristic::{Circle, CircleDetector, Detection, FrameError, FrameRefused, FrameSource};
use pipeline_sim::{Ball, Scene, Workspace};
use puma_grasp::{BallDetector, Rig, RigParts};
use puma_val2::{ArmError, Gripper, JointDelta, Joints, Manipulator};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

const IN_VIEW: [f64; 3] = [0.6, 0.1, -0.1];
const BEHIND_THE_ARM: [f64; 3] = [-0.6, 0.0, -0.1];

fn rig(ball: [f64; 3]) -> Rig {
    let mut rig = Rig::emulated(false, &Scene::bright_ball(), 5, &Arc::default())
        .expect("an emulated controller");
    rig.place(&Ball::at(ball[0], ball[1], ball[2]))
        .expect("away from the hand");
    rig
}

fn agent() -> Agent<Hybrid> {
    let config = AgentConfig::paper(Workspace::paper().search_poses());
    Agent::with_controller(config, Hybrid::new(HybridSettings::paper())).expect("valid settings")
}

fn untaught() -> Belief {
    Belief::new(&Prior::by_eye())
}

type Grabbed = Result<GrayImage, FrameError>;

/// Layer between the parts and the agent that injects faults.
struct Between<'a> {
    detector: Box<dyn CircleDetector + 'a>,
    camera: Box<dyn FnMut(Grabbed) -> Grabbed + 'a>,
    arm: Box<dyn FnMut(JointDelta) -> JointDelta + 'a>,
}

impl Between<'_> {
    fn nothing() -> Self {
        Self {
            detector: BallDetector::AContrario.build(1).expect("valid settings"),
            camera: Box::new(|grabbed| grabbed),
            arm: Box::new(|delta| delta),
        }
    }

    fn run(
        &mut self,
        rig: &mut Rig,
        agent: &mut Agent<Hybrid>,
    ) -> (Result<RunOutcome, AgentError>, EventLog) {
        let mut log = EventLog::default();
        let RigParts {
            camera: inner,
            arm,
            mut sensor,
        } = rig.parts();
        let mut camera = Camera {
            inner,
            change: &mut self.camera,
        };
        let mut arm = Arm {
            inner: arm,
            change: &mut self.arm,
        };
        let mut eye = CameraEye::new(&mut camera, &mut *self.detector);
        let end = agent.run_and_learn(&mut eye, &mut arm, &mut *sensor, &mut |event| {
            log.note(event);
        });
        (end, log)
    }
}

struct Camera<'a> {
    inner: &'a mut dyn FrameSource,
    change: &'a mut dyn FnMut(Grabbed) -> Grabbed,
}

impl FrameSource for Camera<'_> {
    fn grab(&mut self, frame: &mut GrayImage) -> Result<(), FrameError> {
        let grabbed = self.inner.grab(frame).map(|()| std::mem::take(frame));
        *frame = (self.change)(grabbed)?;
        Ok(())
    }
}

struct Arm<'a> {
    inner: &'a mut dyn Manipulator,
    change: &'a mut dyn FnMut(JointDelta) -> JointDelta,
}

impl Manipulator for Arm<'_> {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        self.inner.joints()
    }

    fn move_by(&mut self, delta: JointDelta) -> Result<Joints, ArmError> {
        self.inner.move_by((self.change)(delta))
    }

    fn move_to(&mut self, target: Joints) -> Result<Joints, ArmError> {
        self.inner.move_to(target)
    }

    fn set_gripper(&mut self, gripper: Gripper) -> Result<(), ArmError> {
        self.inner.set_gripper(gripper)
    }

    fn stop(&mut self) -> Result<(), ArmError> {
        self.inner.stop()
    }
}

fn occurred(log: &EventLog, what: impl Fn(&EventKind) -> bool) -> bool {
    log.events.iter().any(|event| what(&event.kind))
}

/// The error of a run that failed, which is also its last event; the arm stands where it was then,
/// with the jaws open.
fn failure(end: Result<RunOutcome, AgentError>, log: &EventLog, rig: &Rig) -> AgentError {
    let error = end.expect_err("a fault");
    let last = log.events.last().expect("an event");
    assert_eq!(last.kind, EventKind::Failed(error.to_string()));
    assert!(!occurred(log, |kind| *kind == EventKind::Gripped));
    let off = (rig.pose())() - last.joints;
    assert!(off.0.iter().all(|angle| angle.abs() < 1e-3), "{off:?}");
    error
}

#[test]
fn a_camera_that_ends_ends_the_run_and_keeps_the_belief() {
    let (mut rig, mut agent) = (rig(IN_VIEW), agent());
    let mut frames = 0;
    let mut between = Between::nothing();
    between.camera = Box::new(|grabbed| {
        frames += 1;
        // Two sightings are something to learn from.
        if frames <= 3 {
            grabbed
        } else {
            Err(FrameError::End)
        }
    });
    let (end, log) = between.run(&mut rig, &mut agent);
    let error = failure(end, &log, &rig);
    assert!(
        matches!(error, AgentError::Camera(FrameError::End)),
        "{error}"
    );
    assert!(*agent.controller().belief() != untaught());
}

#[test]
fn a_frozen_camera_is_recognised_with_and_without_a_ball() {
    for (ball, good) in [(BEHIND_THE_ARM, 1), (IN_VIEW, 2)] {
        let (mut rig, mut agent) = (rig(ball), agent());
        let (mut frames, mut last) = (0, None);
        let mut between = Between::nothing();
        between.camera = Box::new(|grabbed| {
            frames += 1;
            if frames <= good {
                last = Some(grabbed?);
            }
            last.clone().ok_or(FrameError::End)
        });
        let (end, log) = between.run(&mut rig, &mut agent);
        let error = failure(end, &log, &rig);
        assert!(matches!(error, AgentError::FrozenCamera { .. }), "{error}");
        let seen = occurred(&log, |kind| matches!(kind, EventKind::Seen(_)));
        assert_eq!(seen, ball == IN_VIEW);
    }
}

#[test]
fn a_camera_frozen_at_the_goal_causes_no_grip_in_the_next_run() {
    let (mut rig, mut agent) = (rig(IN_VIEW), agent());
    let (last, frozen) = (std::cell::RefCell::new(None), std::cell::Cell::new(false));
    let mut between = Between::nothing();
    between.camera = Box::new(|grabbed| {
        if !frozen.get() {
            *last.borrow_mut() = Some(grabbed?);
        }
        last.borrow().clone().ok_or(FrameError::End)
    });
    // The run ends where the ball stands at the goal, since the way of the gripper leads nowhere.
    between.arm = Box::new(|delta| {
        if delta.degrees()[4].abs() > 10.0 {
            JointDelta::default()
        } else {
            delta
        }
    });
    let (end, log) = between.run(&mut rig, &mut agent);
    let error = failure(end, &log, &rig);
    assert!(
        matches!(error, AgentError::Arm(ArmError::NotReached { .. })),
        "{error}"
    );
    assert!(occurred(&log, |kind| *kind == EventKind::AtGoal));

    frozen.set(true);
    let (end, log) = between.run(&mut rig, &mut agent);
    let error = failure(end, &log, &rig);
    assert!(
        matches!(error, AgentError::FrozenCamera { looks: 2 }),
        "{error}"
    );
}

#[test]
fn garbage_frames_show_no_ball_to_any_detector() {
    let sizes = [(0, 0), (1, 1), (768, 1), (1, 576), (40, 30), (192, 144)];
    for kind in [BallDetector::AContrario, BallDetector::Heuristic] {
        let (mut rig, mut agent) = (rig(IN_VIEW), agent());
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let (mut frames, mut between) = (0, Between::nothing());
        between.detector = kind.build(1).expect("valid settings");
        between.camera = Box::new(|_| {
            frames += 1;
            let (width, height) = sizes[frames % sizes.len()];
            Ok(GrayImage::from_fn(width, height, |_, _| {
                Luma([rng.random()])
            }))
        });
        let (end, log) = between.run(&mut rig, &mut agent);
        let outcome = end.expect("no fault of a device");
        assert_eq!(outcome.gave_up, Some(GaveUp::NotFound), "{kind}");
        assert!(!occurred(&log, |kind| *kind == EventKind::Gripped));
        assert!(*agent.controller().belief() == untaught());
    }
}

/// A detector that finds a circle at a random place in every frame, or an impossible one.
struct Liar(Xoshiro256PlusPlus, Vec<Detection>);

impl CircleDetector for Liar {
    fn detect(&mut self, frame: &GrayImage) -> Result<&[Detection], FrameRefused> {
        let Self(rng, found) = self;
        let [x, y, radius] = match rng.random_range(0..10) {
            0 => [f64::NAN, 0.0, -1.0],
            1 => [1e300, -1e300, f64::INFINITY],
            _ => [
                rng.random_range(0.0..f64::from(frame.width())),
                rng.random_range(0.0..f64::from(frame.height())),
                rng.random_range(0.1..400.0),
            ],
        };
        let circle = Circle { x, y, radius };
        *found = vec![Detection { circle, score: 1.0 }];
        Ok(found)
    }
}

#[test]
fn false_circles_never_cause_a_grip() {
    let (mut rig, mut agent) = (rig(BEHIND_THE_ARM), agent());
    let mut between = Between::nothing();
    between.detector = Box::new(Liar(Xoshiro256PlusPlus::seed_from_u64(0), Vec::new()));
    let (end, log) = between.run(&mut rig, &mut agent);
    let outcome = end.expect("no fault of a device");
    assert!(
        outcome.gave_up.is_some() && !rig.holds_ball(),
        "{outcome:?}"
    );
    let config = agent.config();
    assert!(outcome.cycles <= config.max_cycles + config.recovery.len() + 1);
    for event in &log.events {
        if let EventKind::Moved(_) = event.kind {
            assert!(config.limits.admit(&event.joints), "{}", event.joints);
        }
    }
}

#[test]
fn an_arm_that_does_not_go_where_it_is_sent_ends_the_run() {
    let (mut rig, mut agent) = (rig(IN_VIEW), agent());
    let (mut moves, mut between) = (0, Between::nothing());
    between.arm = Box::new(|delta| {
        moves += 1;
        if moves < 2 {
            delta
        } else {
            // The controller believes that it has got there; the arm has not.
            JointDelta(delta.0.map(|angle| 0.5 * angle))
        }
    });
    let (end, log) = between.run(&mut rig, &mut agent);
    let error = failure(end, &log, &rig);
    assert!(
        matches!(error, AgentError::Arm(ArmError::NotReached { .. })),
        "{error}"
    );
    assert!(*agent.controller().belief() != untaught());
}

#[cfg(all(unix, feature = "serial"))]
#[test]
fn a_line_that_dies_ends_the_run_and_keeps_the_belief() {
    use puma_val2::{Emulator, EmulatorServer, Profile, PumaParams, ServeConfig};
    // When the controller goes: before anything moves, and in the middle.
    for after in [0, 2] {
        let emulator = Emulator::new(PumaParams::unimation(), Profile::val2());
        let server =
            EmulatorServer::pty(emulator, ServeConfig::default()).expect("a pseudo-terminal");
        let path = server.address().to_owned();
        let mut rig = Rig::on_port(&path, 100.0, &Scene::bright_ball(), 5, &Arc::default())
            .expect("the controller answers");
        rig.place(&Ball::at(IN_VIEW[0], IN_VIEW[1], IN_VIEW[2]))
            .expect("away from the hand");
        let (mut agent, mut log, mut moves) = (agent(), EventLog::default(), 0);
        let mut server = Some(server);
        let mut detector = BallDetector::AContrario.build(1).expect("valid settings");
        let end = rig.run(&mut agent, &mut *detector, &mut |event| {
            log.note(event);
            moves += usize::from(matches!(event.kind, EventKind::Moved(_)));
            if moves >= after {
                server = None;
            }
        });
        let error = failure(end, &log, &rig);
        assert!(matches!(error, AgentError::Arm(_)), "{error}");
        assert!(
            error.to_string().contains(&path),
            "{error} does not name {path}"
        );
        assert_eq!(*agent.controller().belief() != untaught(), after > 0);

        // Another run on the dead line fails at once, and the one before stays learned.
        let before = agent.controller().belief().clone();
        let again = rig.run(&mut agent, &mut *detector, &mut |_| ());
        assert!(matches!(again, Err(AgentError::Arm(_))), "{again:?}");
        assert!(*agent.controller().belief() == before);
    }
}
