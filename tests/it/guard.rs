//! The proximity guard, the cell that follows the arm, and the honest grasp: through an emulated
//! controller on a pseudo-terminal (a socket where the system has none), and with the arm of the
//! cell itself.

use std::sync::Arc;

use example_support::trial::{FeatureEye, TrialCell};
use grasp_agent::{
    Agent, AgentConfig, Controller, Decision, EventKind, EventLog, Feedback, GaveUp, Request,
    Servo, ServoLaw, ServoSettings, Sighting,
};
use pipeline_sim::{Ball, Cell, ErrorLevel, FeatureCamera, Grasp, Scene, Workspace};
use puma_grasp::{Rig, RigParts};
use puma_val2::{ArmError, Gripper, JointDelta, Joints};

fn rig() -> Rig {
    Rig::emulated(false, &Scene::bright_ball(), 5, &Arc::default()).expect("an emulated controller")
}

/// A ball in view of a search pose, the pose in which it shows in the middle of the goal, and the
/// one in which the jaws are around it.
fn ball_and_goal() -> (Ball, Joints, Joints) {
    let ball = Ball::at(0.6, 0.1, -0.1);
    let goal = Cell::paper(ball)
        .goal_pose(Cell::REACHING_JT5_DEGREES)
        .expect("within reach");
    (
        ball,
        goal,
        goal + JointDelta::from_degrees([0.0, 0.0, 0.0, 0.0, -18.01, 0.0]),
    )
}

#[test]
fn the_controller_stops_before_a_ball_and_is_armed_again() {
    let (ball, goal, grip) = ball_and_goal();
    let mut rig = rig();
    rig.place(&ball).expect("away from the hand");
    // Beside the ball, with a finger on each side of where it is not, and slowly toward it.
    let beside = grip + JointDelta::from_degrees([4.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let across = JointDelta::from_degrees([-4.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    for _ in 0..2 {
        let RigParts {
            arm, mut sensor, ..
        } = rig.parts();
        arm.move_to(goal).expect("free");
        assert!(!sensor.object_near().expect("a simulated sensor"));
        let above = beside + JointDelta::from_degrees([4.0, 0.0, 0.0, 0.0, 18.01, 0.0]);
        arm.move_to(above).expect("free");
        let stopped = arm.move_to(grip + across);
        assert!(
            matches!(stopped, Err(ArmError::ProximityStop { .. })),
            "{stopped:?}"
        );
        assert!(sensor.object_near().expect("a simulated sensor"));
        // The way back is free.
        arm.move_to(above).expect("the way back");
        drop(sensor);
    }
}

#[test]
fn the_ball_goes_with_the_jaws_and_is_pushed_by_fingers() {
    let (ball, goal, grip) = ball_and_goal();
    let mut rig = rig();
    rig.place(&ball).expect("away from the hand");
    {
        let RigParts { arm, .. } = rig.parts();
        arm.move_to(goal).expect("free");
        arm.move_to(grip).expect("free");
        arm.set_gripper(Gripper::Closed).expect("closes");
        arm.move_to(goal + JointDelta::from_degrees([10.0, -15.0, 0.0, 0.0, 0.0, 0.0]))
            .expect("free");
    }
    assert!(rig.holds_ball() && rig.cell().get().grip_miss(&rig.pose()()) < 0.001);
    let contacts = rig.contacts();
    assert_eq!(
        (contacts.collisions, contacts.grasp),
        (0, Some(Grasp::Held))
    );
    assert!((rig.cell().get().ball.centre - ball.centre).norm() > 0.1);
    // Placed elsewhere, it is out of the jaws, and what comes of it is counted anew.
    rig.place(&ball).expect("away from the hand");
    assert!(!rig.holds_ball() && rig.contacts().grasp.is_none());
}

#[test]
fn the_arm_moves_away_for_a_ball_placed_in_the_hand() {
    let (ball, _, grip) = ball_and_goal();
    let mut rig = rig();
    rig.place(&Ball::at(-0.6, 0.0, -0.1))
        .expect("away from the hand");
    rig.parts().arm.move_to(grip).expect("free");
    // With the hand a finger's width to the side.
    let aside = Ball::at(ball.centre.x, ball.centre.y + 0.04, ball.centre.z);
    rig.place(&aside).expect("the arm moves away");
    assert!((rig.cell().get().ball.centre - aside.centre).norm() < 1e-9);
    let (joints, cell) = (rig.pose()(), rig.cell().get());
    assert!(!cell.collides(&joints));
}

/// Servoing that once, with the ball near, drives a finger onto it.
#[derive(Clone, Default)]
struct Clumsy {
    slipped: bool,
    taken_back: usize,
}

impl Controller for Clumsy {
    fn decide(&mut self, ball: &Sighting, request: &Request) -> Result<Decision, GaveUp> {
        if ball.features.r > 29.0 && !self.slipped && !request.grip {
            self.slipped = true;
            // A finger lands where the middle between them should.
            let onto_it = JointDelta::from_degrees([3.5, 0.0, 0.0, 0.0, -18.01, 0.0]);
            return Ok(Decision::Move(onto_it));
        }
        let settings = ServoSettings::paper().with_gain(0.6);
        Servo::new(ServoLaw::PositionBased, settings).decide(ball, request)
    }

    fn notice(&mut self, feedback: &Feedback) {
        match feedback {
            Feedback::Begin => *self = Self::default(),
            Feedback::TakenBack => self.taken_back += 1,
            _ => {}
        }
    }

    fn describe(&self) -> &str {
        "clumsy"
    }
}

fn words(log: &EventLog) -> Vec<&'static str> {
    log.events.iter().map(|event| event.kind.word()).collect()
}

#[test]
fn a_stopped_run_goes_back_and_on_to_the_grip() {
    let mut rig = rig();
    let config = AgentConfig::paper(Workspace::paper().search_poses());
    let mut agent = Agent::with_controller(config, Clumsy::default()).expect("valid settings");
    for ball in [Ball::at(0.6, 0.1, -0.1), Ball::at(0.55, -0.2, -0.05)] {
        rig.place(&ball).expect("away from the hand");
        let mut camera = FeatureCamera::new(rig.cell().clone(), rig.pose(), 1);
        let mut eye = FeatureEye(|| camera.look());
        let mut log = EventLog::default();
        let RigParts {
            arm, mut sensor, ..
        } = rig.parts();
        let outcome = agent
            .run_and_learn(&mut eye, arm, &mut *sensor, &mut |event| log.note(event))
            .expect("a stop is no failure");
        drop(sensor);
        let words = words(&log);
        let near = words
            .iter()
            .position(|word| *word == "too-near")
            .expect("the guard stopped it");
        assert_eq!(
            words[near - 1..=near + 1],
            ["moved", "too-near", "taken-back"]
        );
        assert_eq!(outcome.gave_up, None, "{words:?}");
        assert!(rig.holds_ball() && agent.controller().taken_back > 0);
        // It was stopped on the way, and not at its end.
        let halted = &log.events[near];
        let ordered = match log.events[near - 1].kind {
            EventKind::Moved(delta) => Some(delta),
            _ => None,
        };
        let ordered = ordered.expect("a move");
        let from = log.events[near + 1].joints;
        let went = (halted.joints.0[4] - from.0[4]) / ordered.0[4];
        assert!((0.0..0.95).contains(&went), "{went}");
    }
}

#[test]
fn a_stopped_run_without_a_controller_reaches_the_grip_too() {
    let cell = TrialCell::draw(ErrorLevel::None, 1).expect("a cell");
    let mut agent =
        Agent::with_controller(cell.agent_config(), Clumsy::default()).expect("valid settings");
    for seed in 0..5 {
        let mut log = EventLog::default();
        let result = cell
            .run(&mut agent, seed, &mut |_, _| (), &mut |event| {
                log.note(event);
            })
            .expect("nothing fails")
            .expect("a ball in view");
        assert!(
            result.near > 0 && result.held,
            "{seed}: {result:?} {:?}",
            words(&log)
        );
        assert_eq!(result.outcome.gave_up, None);
        let (_, again) = log
            .replay(&Agent::with_controller(cell.agent_config(), Clumsy::default()).expect("valid"))
            .expect("replays");
        assert_eq!(again, log);
    }
}
