//! Calibrates the camera on the hand of any arm by looks at a resting ball, and prints the result.
#![allow(clippy::print_stdout, reason = "a program for a terminal")]

use std::cell::Cell;

use grasp_agent::hough_heuristic::{Features, FrameError};
use grasp_agent::nalgebra::{Isometry3, Point3, Vector3};
use grasp_agent::puma_val2::{Arm, ArmError, Gripper, JointDelta, Joints, Kinematics, Manipulator};
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
}
impl Manipulator for &Robot {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        Ok(self.1.get())
    }
    fn move_to(&mut self, target: Joints) -> Result<Joints, ArmError> {
        self.1.set(target);
        Ok(target)
    }
    fn set_gripper(&mut self, _: Gripper) -> Result<(), ArmError> {
        Ok(())
    }
    fn stop(&mut self) -> Result<(), ArmError> {
        Ok(())
    }
}

/// Camera and detector; here a model of them, with the zeros of the joints off and some noise. With
/// frames, use a `CameraEye`.
struct Camera<'a>(&'a Robot, CameraModel, JointDelta, Point3<f64>, f64);
impl Eye for Camera<'_> {
    fn look(&mut self) -> Result<Option<Sighting>, FrameError> {
        let seen = self.1.view(&(self.0.1.get() + self.2), &self.3);
        let mut noise = || {
            self.4 = (self.4 * 997.0 + 0.123).fract();
            0.2 * (self.4 - 0.5)
        };
        let noisy = |f: Features| Features::new(f.x + noise(), f.y + noise(), f.r + noise());
        let inside = |f: &Features| (0.0..192.0).contains(&f.x) && (0.0..144.0).contains(&f.y);
        Ok(seen.filter(inside).map(noisy).map(Sighting::new))
    }
}

/// Calibrates by looks at a ball that is in view now. The table is 100 mm below the base.
fn calibrate(
    robot: &Robot,
    eye: &mut dyn Eye,
    guess: CameraModel,
) -> Result<Calibration, AgentError> {
    let arm = Arm::of(robot)?;
    let mut task = HandEye::new(CameraModel { arm, ..guess });
    task.limits = JointLimits([(-2.0, 2.0); 6]);
    let mut above_table = |joints: &Joints| guess.tool_point(joints).z > -0.08;
    task.calibrate(eye, &mut &*robot, &mut above_table)
}

fn main() -> Result<(), AgentError> {
    let begin = Joints::from_degrees([10.0, -30.0, 30.0, 0.0, 60.0, 0.0]);
    let robot = Robot(Arm::so101(), Cell::new(begin));
    let (arm, tool) = (Arm::so101(), 0.14);
    let guess = CameraModel {
        arm,
        tool,
        focal: 166.0,
        ..CameraModel::paper()
    };
    let mut real = CameraModel {
        focal: 181.0,
        ..guess
    };
    real.mount.translation.vector += Vector3::new(0.012, -0.008, 0.010);
    let zeros = JointDelta::from_degrees([0.0, 1.5, -1.0, 0.0, 0.7, 0.0]);
    let mut eye = Camera(&robot, real, zeros, Point3::new(0.27, 0.05, 0.02), 0.3);
    let found = calibrate(&robot, &mut eye, guess)?;
    println!("{found}");
    assert!(
        (found.model.focal - real.focal).abs() < 4.0,
        "the lens was not found"
    );
    Ok(())
}
