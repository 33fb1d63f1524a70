//! Time of a control cycle by stage: camera, detector, controller and arm.

use std::cell::RefCell;
use std::fmt;
use std::rc::Rc;
use std::time::{Duration, Instant};

use grasp_agent::{Controller, Decision, Feedback, GaveUp, Request, SavedController, Sighting};
use hough_heuristic::image::GrayImage;
use hough_heuristic::{CircleDetector, Detection, FrameError, FrameRefused, FrameSource};
use puma_val2::{ArmError, Gripper, JointDelta, Joints, Manipulator};

/// Returns the CPU time of this thread; wall time where the system does not tell.
pub fn cpu_time() -> Duration {
    #[cfg(unix)]
    {
        let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
        Duration::new(time.tv_sec.unsigned_abs(), time.tv_nsec as u32)
    }
    #[cfg(not(unix))]
    {
        static BEGIN: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
        BEGIN.get_or_init(Instant::now).elapsed()
    }
}

/// CPU time of this thread and wall time of all cycles so far, by stage.
#[derive(Clone, Debug, Default)]
pub struct Stages(Rc<RefCell<Spent>>);

#[derive(Clone, Copy, Debug, Default)]
struct Spent {
    moves: u32,
    /// Time of the camera: of rendering, unless it is a real one.
    camera: Duration,
    detect: Duration,
    decide: Duration,
    serial: Duration,
    /// Wall time while the arm was driven, and while frames were taken.
    driven: Duration,
    watched: Duration,
    /// Set if a real camera takes the frames.
    real: bool,
}

impl Stages {
    /// Wraps a part so that its time is added to these.
    pub fn around<T>(&self, inner: T) -> Timed<T> {
        Timed {
            inner,
            stages: self.clone(),
        }
    }

    /// Says that a real camera takes the frames.
    pub fn of_real_camera(&self) {
        self.0.borrow_mut().real = true;
    }

    fn measured<T>(&self, stage: fn(&mut Spent) -> &mut Duration, work: impl FnOnce() -> T) -> T {
        let begin = cpu_time();
        let result = work();
        *stage(&mut self.0.borrow_mut()) += cpu_time().saturating_sub(begin);
        result
    }

    fn driven<T>(&self, work: impl FnOnce() -> T) -> T {
        let begin = Instant::now();
        let result = self.measured(|spent| &mut spent.serial, work);
        self.0.borrow_mut().driven += begin.elapsed();
        result
    }
}

impl fmt::Display for Stages {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let spent = *self.0.borrow();
        let each = |time: Duration| 1e3 * time.as_secs_f64() / f64::from(spent.moves.max(1));
        write!(
            f,
            "per move, ms of CPU: edges and circle {:.2}, decision {:.3}, serial line {:.2}; \
             waiting for the arm {:.2} ms; ",
            each(spent.detect),
            each(spent.decide),
            each(spent.serial),
            each(spent.driven.saturating_sub(spent.serial)),
        )?;
        let (camera, waited) = (each(spent.camera), each(spent.watched));
        match spent.real {
            true => write!(f, "waiting for frames {waited:.0} ms")?,
            false => write!(
                f,
                "rendering {camera:.2} ms of CPU, which a camera would not need"
            )?,
        }
        write!(f, " ({} moves)", spent.moves)
    }
}

/// A part whose time is measured.
#[derive(Clone, Debug)]
pub struct Timed<T> {
    /// The measured part itself.
    pub inner: T,
    /// Times that the part adds to.
    pub stages: Stages,
}

impl FrameSource for Timed<&mut dyn FrameSource> {
    fn grab(&mut self, frame: &mut GrayImage) -> Result<(), FrameError> {
        let begin = Instant::now();
        let grabbed = self
            .stages
            .measured(|spent| &mut spent.camera, || self.inner.grab(frame));
        self.stages.0.borrow_mut().watched += begin.elapsed();
        grabbed
    }
}

impl CircleDetector for Timed<&mut dyn CircleDetector> {
    fn detect(&mut self, frame: &GrayImage) -> Result<&[Detection], FrameRefused> {
        self.stages
            .measured(|spent| &mut spent.detect, || self.inner.detect(frame))
    }
}

impl<C: Controller> Controller for Timed<C> {
    fn decide(&mut self, ball: &Sighting, request: &Request) -> Result<Decision, GaveUp> {
        self.stages.measured(
            |spent| &mut spent.decide,
            || self.inner.decide(ball, request),
        )
    }

    fn notice(&mut self, feedback: &Feedback) {
        self.stages
            .measured(|spent| &mut spent.decide, || self.inner.notice(feedback));
    }

    fn describe(&self) -> &str {
        self.inner.describe()
    }

    fn save(&self) -> Option<SavedController> {
        self.inner.save()
    }
}

impl Timed<&mut dyn Manipulator> {
    fn moved(
        &mut self,
        order: impl FnOnce(&mut dyn Manipulator) -> Result<Joints, ArmError>,
    ) -> Result<Joints, ArmError> {
        self.stages.0.borrow_mut().moves += 1;
        self.stages.driven(|| order(&mut *self.inner))
    }
}

impl Manipulator for Timed<&mut dyn Manipulator> {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        self.stages.driven(|| self.inner.joints())
    }

    fn move_by(&mut self, delta: JointDelta) -> Result<Joints, ArmError> {
        self.moved(|arm| arm.move_by(delta))
    }

    fn move_to(&mut self, target: Joints) -> Result<Joints, ArmError> {
        self.moved(|arm| arm.move_to(target))
    }

    fn set_gripper(&mut self, gripper: Gripper) -> Result<(), ArmError> {
        self.stages.driven(|| self.inner.set_gripper(gripper))
    }

    fn stop(&mut self) -> Result<(), ArmError> {
        self.inner.stop()
    }
}
