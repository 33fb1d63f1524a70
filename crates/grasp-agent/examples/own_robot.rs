//! A robot of one's own: arm, camera and detector. Its camera is learned and the ball is reached.
#![allow(clippy::print_stdout, reason = "a program for a terminal")]
use grasp_agent::hough_heuristic::{Features, image};
use grasp_agent::nalgebra::{Isometry3, Point3, Translation3, Vector3};
use grasp_agent::puma_val2::{Arm, ArmError, Joint, JointDelta, Joints, Kinematics, Manipulator};
use grasp_agent::{Agent, AgentConfig, CameraModel, Hybrid, HybridSettings, Sighting, TaughtGoal};
use std::cell::Cell;

/// An arm of four joints. A real one passes the orders on to its driver.
struct Robot(Cell<Joints>);
impl Kinematics for Robot {
    fn forward(&self, joints: &Joints) -> Isometry3<f64> {
        let ([pan, lift, elbow, flex, ..], y) = (joints.0, Vector3::y());
        let link = |turn, x, z| Isometry3::rotation(turn) * Translation3::new(x, 0.0, z);
        let upper = link(Vector3::z() * pan, 0.03, 0.12) * link(y * lift, 0.0, 0.12);
        upper * link(y * elbow, 0.14, 0.0) * link(y * (flex + 1.571), 0.0, 0.0)
    }
    fn limits(&self) -> [(f64, f64); 6] {
        [1.9, 1.7, 1.7, 1.6, 0.0, 0.0].map(|most| (-most, most))
    }
    fn names(&self) -> [&str; 6] {
        ["pan", "lift", "elbow", "flex", "", ""]
    }
}
impl Manipulator for &Robot {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        Ok(self.0.get())
    }
    fn move_to(&mut self, target: Joints) -> Result<Joints, ArmError> {
        self.0.set(target);
        Ok(target)
    }
    fn stop(&mut self) -> Result<(), ArmError> {
        Ok(())
    }
}

/// The camera, which shows the ball as a white disk, and the detector.
fn photo(ball: Option<Features>) -> image::GrayImage {
    image::GrayImage::from_fn(192, 144, |x, y| {
        let inside = |f: Features| (f64::from(x) - f.x).hypot(f64::from(y) - f.y) < f.r;
        image::Luma([if ball.is_some_and(inside) { 255 } else { 0 }])
    })
}
fn detect(frame: &image::GrayImage) -> Option<Sighting> {
    let white = frame.enumerate_pixels().filter(|at| at.2.0[0] > 128);
    let [n, x, y] = white.fold([0.0; 3], |[n, x, y], (column, row, _)| {
        [n + 1.0, x + f64::from(column), y + f64::from(row)]
    });
    (n > 50.0).then(|| Sighting::new(Features::new(x / n, y / n, 0.5642 * n.sqrt())))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let pose = |pan, lift, elbow| Joints::from_degrees([pan, lift, elbow, 60.0, 0.0, 0.0]);
    let search = [-40.0, 0.0, 40.0].map(|pan| pose(pan, -30.0, 30.0));
    let robot = Robot(Cell::new(search[1]));
    let mut nominal = CameraModel::paper();
    (nominal.arm, nominal.focal, nominal.tool) = (Arm::of(&robot)?, 166.0, 0.14);
    let mut config = AgentConfig::for_arm(&robot, search);
    config.lift = None;
    // The goal: from this pose the grip brings the jaws around the ball.
    let (from, grip) = (pose(0.0, 53.0, -33.0), JointDelta::of(Joint::J4, -0.35));
    let seen = nominal.view(&from, &nominal.tool_point(&(from + grip)));
    let goal = TaughtGoal::new(&config.goal, seen.ok_or("no view")?, from, grip);
    let goal = goal.ok_or("no goal")?;
    let (mut real, mut settings) = (nominal, HybridSettings::paper());
    (settings.nominal, settings.goal) = (nominal, goal.features());
    let mut agent = Agent::with_controller(config.with_taught_goal(&goal), Hybrid::new(settings))?;
    real.focal = 179.3;
    for ball in [-0.1, 0.0, 0.1, 0.05].map(|y| Point3::new(0.27, y, 0.02)) {
        let mut eye = || Ok(detect(&photo(real.view(&robot.0.get(), &ball))));
        let end = agent.run_and_learn(&mut eye, &mut &robot, &mut (), &mut |_| {})?;
        println!("moves: {}", end.cycles);
        assert_eq!(end.gave_up, None);
    }
    let learned = agent.controller().belief().corrected(&nominal).focal;
    println!("focal length: {learned:.1}, in truth {:.1}", real.focal);
    assert!((learned - real.focal).abs() < 5.0);
    Ok(())
}
