//! Every rival reaches the ball with the right model.

use grasp_agent::hough_heuristic::Features;
use grasp_agent::puma_val2::Joints;
use grasp_agent::{
    Agent, CameraModel, Consequence, Controller, EventLog, Fuzzy, ImageBased, JacobianAt,
    JointLimits, LookAhead, PositionBased, ServoSettings, Situation,
};

use crate::cell::{Fault, Shared, config};

#[test]
fn every_rival_reaches_the_ball_with_the_right_model() {
    let servo = ServoSettings::paper();
    let rivals: Vec<(usize, Box<dyn Controller>)> = vec![
        (5, Box::new(PositionBased::new(servo))),
        (12, Box::new(ImageBased::new(servo, JacobianAt::Goal))),
        (12, Box::new(ImageBased::new(servo, JacobianAt::Now))),
        (12, Box::new(Fuzzy::new(servo))),
        (20, Box::new(LookAhead::new(servo))),
    ];
    for (most, rival) in rivals {
        let mut agent = Agent::with_controller(config(), rival).unwrap();
        for ball in [[0.6, 0.1, -0.1], [0.55, -0.25, -0.15], [0.7, 0.2, -0.05]] {
            let cell = Shared::new(CameraModel::paper(), ball, Fault::None);
            let outcome = cell.run(&mut agent, &mut EventLog::default()).unwrap();
            let name = agent.controller().name();
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
fn look_ahead_does_not_repeat_a_move_that_lost_the_ball_or_was_taken_back() {
    let limits = JointLimits::paper();
    let now = Situation {
        long_axis: None,
        features: Features {
            x: 60.0,
            y: 100.0,
            r: 12.0,
        },
        joints: Joints::from_degrees([0.0, -80.0, 200.0, 0.0, 45.0, 0.0]),
    };
    let mut elsewhere = now;
    elsewhere.joints.0[0] += 0.02;
    for consequence in [Consequence::Lost, Consequence::TakenBack] {
        let mut rival = LookAhead::new(ServoSettings::paper());
        let first = rival.decide(&now, &limits).unwrap();
        rival.judge(&Consequence::Seen(now));
        assert_eq!(rival.decide(&now, &limits).unwrap(), first);
        rival.judge(&consequence);
        let second = rival.decide(&now, &limits).unwrap();
        assert_ne!(second, first);
        rival.judge(&consequence);
        let third = rival.decide(&now, &limits).unwrap();
        assert!(third != first && third != second);
        // From another pose, and in another run, it is a move like any other.
        assert_eq!(rival.decide(&elsewhere, &limits).unwrap(), first);
        rival.begin();
        assert_eq!(rival.decide(&now, &limits).unwrap(), first);
    }
}
