//! Every rival reaches the ball with the right model.

use grasp_agent::hough_heuristic::Features;
use grasp_agent::puma_val2::Joints;
use grasp_agent::{
    CameraModel, Controller, EventLog, Feedback, JointLimits, Request, Servo, ServoLaw,
    ServoSettings, Sighting,
};

use crate::cell::{Fault, Shared, agent_of};

#[test]
fn every_rival_reaches_the_ball_with_the_right_model() {
    let servo = ServoSettings::paper();
    let rivals = [
        (5, ServoLaw::PositionBased),
        (12, ServoLaw::ImageBasedAtGoal),
        (12, ServoLaw::ImageBased),
        (8, ServoLaw::Sphere),
        (8, ServoLaw::Broyden),
        (12, ServoLaw::GainScheduled),
        (20, ServoLaw::FuzzyRules),
        (20, ServoLaw::LookAhead),
    ];
    for (most, law) in rivals {
        let mut agent = agent_of(Servo::new(law, servo));
        for ball in [[0.6, 0.1, -0.1], [0.55, -0.25, -0.15], [0.7, 0.2, -0.05]] {
            let cell = Shared::new(CameraModel::paper(), ball, Fault::None);
            let outcome = cell.run(&mut agent, &mut EventLog::default()).unwrap();
            let name = agent.controller().describe();
            assert_eq!(outcome.gave_up, None, "{name} {ball:?}");
            assert!(
                outcome.cycles <= most,
                "{name} {ball:?}: {}",
                outcome.cycles
            );
        }
    }
}

#[test]
fn look_ahead_does_not_repeat_a_move_that_went_wrong() {
    let ball = Sighting::new(Features::new(60.0, 100.0, 12.0));
    let joints = Joints::from_degrees([0.0, -80.0, 200.0, 0.0, 45.0, 0.0]);
    let here = Request {
        joints,
        limits: JointLimits::paper(),
        grip: false,
    };
    let mut elsewhere = here;
    elsewhere.joints.0[0] += 0.02;
    for wrong in [Feedback::Lost, Feedback::TakenBack] {
        let mut rival = Servo::new(ServoLaw::LookAhead, ServoSettings::paper());
        let first = rival.decide(&ball, &here).unwrap();
        rival.notice(&Feedback::Seen { ball, joints });
        assert_eq!(rival.decide(&ball, &here).unwrap(), first);
        rival.notice(&wrong);
        let second = rival.decide(&ball, &here).unwrap();
        assert_ne!(second, first);
        rival.notice(&wrong);
        let third = rival.decide(&ball, &here).unwrap();
        assert!(third != first && third != second);
        // From another pose, and in another run, it is a move like any other.
        assert_eq!(rival.decide(&ball, &elsewhere).unwrap(), first);
        rival.notice(&Feedback::Begin);
        assert_eq!(rival.decide(&ball, &here).unwrap(), first);
    }
}
