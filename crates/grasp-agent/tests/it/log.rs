//! The log of a run replays to the same run.

use grasp_agent::qtable::QTable;
use grasp_agent::{
    Agent, AgentError, BehaviourPair, CameraModel, Controller, EventLog, Hybrid, HybridSettings, ImageBased,
    JacobianAt, Learned, OnlineLearning, PositionBased, ServoSettings,
};

use crate::cell::{Fault, Shared, config};

const FAULTS: [Fault; 10] = [
    Fault::None,
    Fault::Near(4),
    Fault::FalseCircle,
    Fault::Halted(3),
    Fault::HaltedTwice(3),
    Fault::HaltedNear(20.0),
    Fault::HaltedGrips(1),
    Fault::HaltedClosed(1),
    Fault::HaltedClosed(2),
    Fault::PhantomFromThere,
];

fn replays<C: Controller + Clone>(controller: C, fault: Fault) {
    let agent = Agent::with_controller(config(), controller).unwrap();
    let cell = Shared::new(CameraModel::paper(), [0.55, -0.2, -0.05], fault);
    let mut log = EventLog::default();
    let end = cell.run(&mut agent.clone(), &mut log);
    match (end, log.replay(&agent)) {
        (Ok(then), Ok((now, again))) => {
            assert_eq!(then, now);
            assert_eq!(log, again);
        }
        (Err(_), Err(now)) => assert!(!matches!(now, AgentError::Replay { .. }), "{now}"),
        (then, now) => panic!("{then:?} and {now:?}"),
    }
}

#[test]
fn logs_replay_to_the_same_run() {
    let servo = ServoSettings::paper();
    for fault in FAULTS {
        replays(PositionBased::new(servo), fault);
        replays(ImageBased::new(servo, JacobianAt::Goal), fault);
        replays(Hybrid::new(HybridSettings::paper()), fault);
    }
}

#[test]
fn logs_of_learned_behaviours_replay_frozen_and_learning() {
    let blank = |spec: grasp_agent::BehaviourSpec| {
        let table = QTable::new(spec.states(), spec.actions()).unwrap();
        grasp_agent::Behaviour::new(spec, table).unwrap()
    };
    let pair = BehaviourPair::paper_mended();
    let learned = Learned::new(blank(pair.centering), blank(pair.approaching));
    for fault in FAULTS {
        replays(learned.clone(), fault);
        replays(learned.clone().learning(OnlineLearning::careful(7)), fault);
    }
}

#[test]
fn logs_of_runs_that_failed_replay_to_the_same_failure() {
    let servo = ServoSettings::paper();
    for fault in [
        Fault::NoFrame(3),
        Fault::FrozenFrame(3),
        Fault::ArmStuck(3),
        Fault::LineDead(4),
    ] {
        replays(PositionBased::new(servo), fault);
    }
}

#[test]
fn another_controller_is_told_apart() {
    let servo = ServoSettings::paper();
    let agent = Agent::with_controller(config(), PositionBased::new(servo)).unwrap();
    let cell = Shared::new(CameraModel::paper(), [0.55, -0.2, -0.05], Fault::None);
    let mut log = EventLog::default();
    cell.run(&mut agent.clone(), &mut log).unwrap();
    let other = Agent::with_controller(config(), PositionBased::new(servo.with_gain(0.5))).unwrap();
    assert!(matches!(log.replay(&other), Err(AgentError::Replay { .. })));
    let cut = EventLog {
        events: log.events[..log.events.len() / 2].to_vec(),
    };
    assert!(matches!(cut.replay(&agent), Err(AgentError::Replay { .. })));
}
