//! Learns the behaviour of an environment of one's own, and tries the learned policy in it.
//!
//! ```text
//! cargo run --release -p grasp-agent --example learn_behaviour
//! ```

#![allow(clippy::print_stdout, reason = "a program for a terminal")]

use std::error::Error;
use std::ops::ControlFlow;

use grasp_agent::hough_heuristic::Features;
use grasp_agent::puma_val2::{Joint, JointDelta};
use grasp_agent::qtable::rand::rngs::Xoshiro256PlusPlus;
use grasp_agent::qtable::rand::{Rng, RngExt, SeedableRng};
use grasp_agent::{BehaviourSpec, LearningSettings, Percept};

/// A camera on a turntable: a degree of the first joint moves the ball by four units in x. `None`
/// if the ball has left the image.
fn simulate(percept: &Percept, delta: &JointDelta) -> Option<Percept> {
    let mut next = *percept;
    next.features.x += 4.0 * delta[Joint::J1].to_degrees();
    (0.0..Features::WIDTH)
        .contains(&next.features.x)
        .then_some(next)
}

/// A ball anywhere in the image.
fn start(rng: &mut dyn Rng) -> Percept {
    let (x, y, r) = (rng.random_range(0.0..Features::WIDTH), 72.0, 33.0);
    Percept {
        features: Features::new(x, y, r),
        theta3: 0.0,
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let spec = BehaviourSpec::centering();
    let settings = LearningSettings::paper(50_000)?;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let lesson = spec.learn(simulate, start, &[], &settings, &mut rng, &mut |_| {
        ControlFlow::Continue(())
    })?;
    for record in lesson.curve.iter().step_by(10) {
        let success = record.success_share.unwrap_or(0.0);
        println!("{:6} actions: goal reached in {success:.2}", record.actions);
    }
    let behaviour = lesson.behaviour;
    for x in [5.0, 60.0, 150.0, 185.0] {
        let mut ball = start(&mut rng);
        ball.features.x = x;
        let steps = behaviour.steps_to_goal(&ball, 20.0, 60, |_, _| true, simulate);
        match steps {
            Ok(steps) => println!("from x = {x:5.1}: {steps} steps"),
            Err(_) => println!("from x = {x:5.1}: not reached"),
        }
    }
    Ok(())
}
