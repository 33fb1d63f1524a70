//! Calibrates the camera on the hand of any arm by looks at a resting ball, and prints the result.
#![allow(clippy::print_stdout, reason = "a program for a terminal")]

use std::cell::Cell;

use grasp_agent::hough_heuristic::Features;
use grasp_agent::nalgebra::{Isometry3, Point3, Vector3};
use grasp_agent::puma_val2::{Arm, ArmError, JointDelta, Joints, Kinematics, Manipulator};
use grasp_agent::{AgentError, Calibration, CameraModel, Eye, HandEye, JointLimits, Sighting};

/// The arm: its kinematics, as for any arm of one's own, and the driver.
struct Robot(Arm, Cell<Joints>);
impl Kinematics for Robot {
    fn forward(&self, joints: &Joints) -> Isometry3<f64> {
        self.0.forward(joints)
    }
    fn limits(&self) -> [(f64, f64); 6] {
        self.0.limits()
    }
    fn names(&self) -> [&str; 6] {
        self.0.names()
    }
}
impl Manipulator for &Robot {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        Ok(self.1.get())
    }
    fn move_to(&mut self, target: Joints) -> Result<Joints, ArmError> {
        self.1.set(target);
        Ok(target)
    }
    fn stop(&mut self) -> Result<(), ArmError> {
        Ok(())
    }
}

/// Calibrates by looks at a ball that is in view now. The table is 100 mm below the base.
fn calibrate(
    robot: &Robot,
    eye: &mut dyn Eye,
    mut guess: CameraModel,
) -> Result<Calibration, AgentError> {
    guess.arm = Arm::of(robot)?;
    let mut task = HandEye::new(guess);
    task.limits = JointLimits([(-2.0, 2.0); 6]);
    let mut above_table = |joints: &Joints| guess.tool_point(joints).z > -0.08;
    task.calibrate(eye, &mut &*robot, &mut above_table)
}

fn main() -> Result<(), AgentError> {
    let begin = Joints::from_degrees([10.0, -30.0, 30.0, 0.0, 60.0, 0.0]);
    let robot = Robot(Arm::so101(), Cell::new(begin));
    let mut guess = CameraModel::paper();
    (guess.arm, guess.focal, guess.tool) = (Arm::so101(), 166.0, 0.14);
    let mut real = guess;
    real.focal = 181.0;
    real.mount.translation.vector += Vector3::new(0.012, -0.008, 0.010);
    // Camera and detector: here a model of them, with the zeros of the joints off and some noise.
    // With frames, use a `CameraEye`.
    let zeros = JointDelta::from_degrees([0.0, 1.5, -1.0, 0.0, 0.7, 0.0]);
    let (ball, mut seed) = (Point3::new(0.27, 0.05, 0.02), 0.3_f64);
    let mut noise = || {
        seed = (seed * 997.0 + 0.123).fract();
        0.2 * (seed - 0.5)
    };
    let mut eye = || {
        let seen = real.view(&(robot.1.get() + zeros), &ball);
        let inside = |f: &Features| (0.0..192.0).contains(&f.x) && (0.0..144.0).contains(&f.y);
        let noisy = |f: Features| Features::new(f.x + noise(), f.y + noise(), f.r + noise());
        Ok(seen.filter(inside).map(noisy).map(Sighting::new))
    };
    let found = calibrate(&robot, &mut eye, guess)?;
    println!("{found}");
    assert!((found.model.focal - real.focal).abs() < 4.0);
    Ok(())
}
