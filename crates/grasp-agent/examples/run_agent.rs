//! The state machine on an arm and a camera of one's own: prints every event of a run.
//!
//! ```text
//! cargo run -p grasp-agent --example run_agent
//! ```

#![allow(clippy::print_stdout, reason = "a program for a terminal")]

use std::cell::Cell;

use grasp_agent::hough_heuristic::{Features, FrameError};
use grasp_agent::nalgebra::Point3;
use grasp_agent::puma_val2::{ArmError, Gripper, JointDelta, Joints, Manipulator, ProximitySensor};
use grasp_agent::{
    Agent, AgentConfig, AgentError, CameraModel, Eye, Servo, ServoLaw, ServoSettings, Sighting,
};

/// An arm that goes where it is sent, with nothing near.
struct Arm<'a>(&'a Cell<Joints>);

impl Manipulator for Arm<'_> {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        Ok(self.0.get())
    }

    fn move_by(&mut self, delta: JointDelta) -> Result<Joints, ArmError> {
        self.move_to(self.0.get() + delta)
    }

    fn move_to(&mut self, target: Joints) -> Result<Joints, ArmError> {
        self.0.set(target);
        Ok(target)
    }

    fn set_gripper(&mut self, _gripper: Gripper) -> Result<(), ArmError> {
        Ok(())
    }

    fn stop(&mut self) -> Result<(), ArmError> {
        Ok(())
    }
}

impl ProximitySensor for Arm<'_> {
    fn object_near(&mut self) -> Result<bool, ArmError> {
        Ok(false)
    }
}

/// A camera on the arm's hand that sees a ball without noise.
struct Camera<'a>(CameraModel, Point3<f64>, &'a Cell<Joints>);

impl Eye for Camera<'_> {
    fn look(&mut self) -> Result<Option<Sighting>, FrameError> {
        let seen = self.0.view(&self.2.get(), &self.1);
        let in_view =
            |f: &Features| (0.0..192.0).contains(&f.x) && (0.0..144.0).contains(&f.y) && f.r > 5.0;
        Ok(seen.filter(in_view).map(Sighting::new))
    }
}

fn main() -> Result<(), AgentError> {
    let poses = [-50.0, 0.0, 50.0];
    let poses = poses.map(|pan| Joints::from_degrees([pan, -110.0, 210.0, 0.0, 45.0, 0.0]));
    let joints = Cell::new(poses[0]);
    // Nothing here holds the ball, so the grip is not verified.
    let config = AgentConfig {
        lift: None,
        ..AgentConfig::paper(poses)
    };
    let servo = Servo::new(ServoLaw::PositionBased, ServoSettings::paper());
    let mut agent = Agent::with_controller(config, servo)?;
    let mut camera = Camera(CameraModel::paper(), Point3::new(0.6, 0.1, -0.1), &joints);
    let (mut arm, mut sensor) = (Arm(&joints), Arm(&joints));
    let outcome = agent.run_and_learn(&mut camera, &mut arm, &mut sensor, &mut |event| {
        println!(
            "{:2} {:10} {}",
            event.cycle,
            event.kind.word(),
            event.joints
        );
    })?;
    println!("gave up: {:?}, moves: {}", outcome.gave_up, outcome.cycles);
    Ok(())
}
