//! A robot of one's own: arm, camera and detector. Its camera is learned and the ball is reached.
#![allow(clippy::print_stdout, reason = "a program for a terminal")]

use std::cell::Cell;

use grasp_agent::hough_heuristic::image::{GrayImage, Luma};
use grasp_agent::hough_heuristic::{Features, FrameError, FrameSource};
use grasp_agent::nalgebra::{Point3, Translation3};
use grasp_agent::puma_val2::{Arm, ArmError, Gripper, Joint, JointDelta, Joints};
use grasp_agent::puma_val2::{Kinematics, Manipulator};
use grasp_agent::{Agent, AgentConfig, CameraEye, CameraModel, Hybrid, HybridSettings};
use grasp_agent::{Sighting, Target, TaughtGoal};

/// The arm. A real one passes the calls on to its driver.
struct Robot<'a>(&'a Cell<Joints>);
impl Manipulator for Robot<'_> {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        Ok(self.0.get())
    }
    fn move_to(&mut self, target: Joints) -> Result<Joints, ArmError> {
        self.0.set(target);
        Ok(target)
    }
    fn set_gripper(&mut self, _: Gripper) -> Result<(), ArmError> {
        Ok(())
    }
    fn stop(&mut self) -> Result<(), ArmError> {
        Ok(())
    }
}

/// A camera on the hand. It shows the ball as a white disk.
struct Camera<'a>(CameraModel, Point3<f64>, &'a Cell<Joints>);
impl FrameSource for Camera<'_> {
    fn grab(&mut self, frame: &mut GrayImage) -> Result<(), FrameError> {
        let disk = self.0.view(&self.2.get(), &self.1);
        *frame = GrayImage::from_fn(192, 144, |column, row| {
            let (x, y) = (f64::from(column) + 0.5, f64::from(row) + 0.5);
            let white = disk.is_some_and(|disk| (x - disk.x).hypot(y - disk.y) < disk.r);
            Luma([if white { 255 } else { 20 }])
        });
        Ok(())
    }
}

/// A detector: centre and area of what is white.
struct White;
impl Target for White {
    fn find(&mut self, frame: &GrayImage) -> Result<Option<Sighting>, FrameError> {
        let white = frame.enumerate_pixels().filter(|pixel| pixel.2.0[0] > 128);
        let sum = white.fold([0.0; 3], |[n, x, y], (column, row, _)| {
            [n + 1.0, x + f64::from(column), y + f64::from(row)]
        });
        let (x, y) = (sum[1] / sum[0] + 0.5, sum[2] / sum[0] + 0.5);
        let r = (sum[0] / std::f64::consts::PI).sqrt();
        Ok((r > 5.0).then(|| Sighting::new(Features::new(x, y, r))))
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let pose = |pan, lift, elbow| Joints::from_degrees([pan, lift, elbow, 0.0, 60.0, 0.0]);
    let joints = Cell::new(pose(0.0, -30.0, 30.0));
    let mut nominal = CameraModel::paper();
    (nominal.arm, nominal.focal, nominal.tool) = (Arm::so101(), 166.0, 0.14);
    nominal.mount.translation = Translation3::new(-0.04, 0.0, 0.02);
    // The goal: from this pose the grip brings the jaws around the ball.
    let (from, grip) = (pose(0.0, 53.0, -33.0), JointDelta::of(Joint::J5, -0.35));
    let seen = nominal
        .view(&from, &nominal.tool_point(&(from + grip)))
        .ok_or("no view")?;
    let mut config = AgentConfig::paper([-40.0, 0.0, 40.0].map(|pan| pose(pan, -30.0, 30.0)));
    (config.limits.0, config.lift) = (nominal.arm.limits(), None);
    let goal = TaughtGoal::new(&config.goal, seen, from, grip).ok_or("no goal")?;
    let mut settings = HybridSettings::paper();
    (settings.nominal, settings.goal) = (nominal, goal.features());
    let mut agent = Agent::with_controller(config.with_taught_goal(&goal), Hybrid::new(settings))?;
    let mut real = nominal;
    real.focal *= 1.08;
    for y in [-0.10, 0.0, 0.10, 0.05, -0.05] {
        let mut camera = Camera(real, Point3::new(0.27, y, 0.02), &joints);
        let mut eye = CameraEye::looking_for(&mut camera, White);
        let end = agent.run_and_learn(&mut eye, &mut Robot(&joints), &mut (), &mut |_| {})?;
        println!("moves: {}, gave up: {:?}", end.cycles, end.gave_up);
    }
    let learned = agent.controller().belief().corrected(&nominal).focal;
    println!("focal length: {learned:.1}, in truth {:.1}", real.focal);
    assert!(
        (learned - real.focal).abs() < 5.0,
        "the lens was not learned"
    );
    Ok(())
}
