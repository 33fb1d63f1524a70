//! A controller of one's own: turns the first joint until the ball is in the middle of the image,
//! and looks at a ball in a simulated view.
//!
//! ```text
//! cargo run -p grasp-agent --example own_controller
//! ```

#![allow(clippy::print_stdout, reason = "a program for a terminal")]

use grasp_agent::hough_heuristic::Features;
use grasp_agent::nalgebra::Point3;
use grasp_agent::puma_val2::{Joint, JointDelta, Joints};
use grasp_agent::{
    CameraModel, Controller, Decision, Feedback, GaveUp, JointLimits, Request, Sighting,
};

/// Turns `JT1` by a share of the error in x, a smaller one after each move that lost the ball.
struct Turn {
    gain: f64,
}

impl Controller for Turn {
    fn decide(&mut self, ball: &Sighting, request: &Request) -> Result<Decision, GaveUp> {
        let middle = 0.5 * Features::WIDTH;
        let turn = self.gain * (middle - ball.features.x);
        let delta = JointDelta::of(Joint::J1, turn);
        if request.limits.admit(&(request.joints + delta)) {
            Ok(Decision::Move(delta))
        } else {
            Err(GaveUp::NoMoveLeft)
        }
    }

    fn notice(&mut self, feedback: &Feedback) {
        if *feedback == Feedback::Lost {
            self.gain *= 0.5;
        }
    }

    fn describe(&self) -> &str {
        "turn"
    }
}

fn main() -> Result<(), GaveUp> {
    let (camera, ball) = (CameraModel::paper(), Point3::new(0.6, 0.1, -0.1));
    let mut joints = Joints::from_degrees([0.0, -110.0, 210.0, 0.0, 45.0, 0.0]);
    let mut turn = Turn { gain: 0.004 };
    for step in 0..12 {
        let Some(features) = camera.view(&joints, &ball) else {
            turn.notice(&Feedback::Lost);
            break;
        };
        println!(
            "{step:2}  x {:6.1}  JT1 {:6.2}",
            features.x,
            joints.degrees()[0]
        );
        let request = Request {
            joints,
            limits: JointLimits::paper(),
            grip: false,
        };
        if let Decision::Move(delta) = turn.decide(&Sighting::new(features), &request)? {
            joints = joints + delta;
        }
    }
    Ok(())
}
