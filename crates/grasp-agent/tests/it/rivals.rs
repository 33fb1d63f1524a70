//! Every rival reaches the ball with the right model.

use grasp_agent::{
    Agent, CameraModel, Controller, EventLog, Fuzzy, ImageBased, JacobianAt, LookAhead, PositionBased,
    ServoSettings,
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
            assert!(outcome.cycles <= most, "{name} {ball:?}: {}", outcome.cycles);
        }
    }
}
