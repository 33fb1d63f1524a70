//! The log of a run replays to the same run.

use grasp_agent::{
    AgentError, CameraModel, Controller, EventKind, EventLog, Servo, ServoLaw, ServoSettings,
};

use crate::cell::{Fault, Shared, agent_of, hybrid, servo};

pub(crate) const FAULTS: [Fault; 10] = [
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
    let agent = agent_of(controller);
    let cell = Shared::new(CameraModel::paper(), [0.55, -0.2, -0.05], fault);
    let mut log = EventLog::default();
    let end = cell.run(&mut agent.clone(), &mut log);
    {
        let json = serde_json::to_vec_pretty(&log).unwrap();
        let read: EventLog = serde_json::from_slice(&json).unwrap();
        assert_eq!(read, log);
        log = read;
    }
    match (end, log.replay(&agent)) {
        (Ok(then), Ok((now, again))) => {
            assert_eq!(then, now);
            assert_eq!(log, again);
        }
        (Err(then), Err(now)) => assert!(
            std::mem::discriminant(&then) == std::mem::discriminant(&now),
            "{fault:?}: {then}; {now}"
        ),
        (then, now) => panic!("{then:?} and {now:?}"),
    }
}

#[test]
fn logs_replay_to_the_same_run() {
    let servo = ServoSettings::paper();
    for fault in FAULTS {
        replays(Servo::new(ServoLaw::PositionBased, servo), fault);
        replays(Servo::new(ServoLaw::ImageBasedAtGoal, servo), fault);
        replays(hybrid(), fault);
    }
}

#[test]
fn logs_of_runs_that_failed_replay_to_the_same_failure() {
    let servo = ServoSettings::paper();
    for fault in [
        Fault::NoFrame(0),
        Fault::NoFrame(3),
        Fault::FrozenFrame(3),
        Fault::FrozenPicture(1),
        Fault::FrozenPicture(2),
        Fault::ArmStuck(3),
        Fault::LineDead(0),
        Fault::LineDead(4),
        Fault::GripperDead(0),
        Fault::GripperDead(1),
        Fault::SensorDead(0),
        Fault::SensorDead(3),
        Fault::StopDead(3),
        Fault::StoppedShort(3),
    ] {
        replays(Servo::new(ServoLaw::PositionBased, servo), fault);
    }
}

#[test]
fn a_failure_of_another_kind_is_another_run() {
    let agent = agent_of(servo());
    let log_of = |fault| {
        let cell = Shared::new(CameraModel::paper(), [0.55, -0.2, -0.05], fault);
        let mut log = EventLog::default();
        cell.run(&mut agent.clone(), &mut log).unwrap_err();
        log
    };
    let failed_with = |log: &EventLog, cause: &str| {
        let mut log = log.clone();
        log.events.last_mut().unwrap().kind = EventKind::Failed(cause.into());
        log.replay(&agent)
    };
    let (camera, arm, frozen) = (
        log_of(Fault::NoFrame(3)),
        log_of(Fault::LineDead(4)),
        log_of(Fault::FrozenPicture(2)),
    );
    let causes = [&camera, &arm, &frozen].map(|log| match &log.events.last().unwrap().kind {
        EventKind::Failed(cause) => cause.clone(),
        other => panic!("{other:?}"),
    });
    for (i, log) in [&camera, &arm, &frozen].into_iter().enumerate() {
        for (j, cause) in causes.iter().enumerate() {
            let replay = failed_with(log, cause).unwrap_err();
            if (i, j) == (0, 1) {
                // Where the camera failed, the sensors on the arm could have failed just as well.
                continue;
            }
            assert_eq!(
                matches!(replay, AgentError::Replay { .. }),
                i != j,
                "{i} {j}: {replay}"
            );
        }
    }
}

#[test]
fn another_controller_is_told_apart() {
    let servo = ServoSettings::paper();
    let agent = agent_of(Servo::new(ServoLaw::PositionBased, servo));
    let cell = Shared::new(CameraModel::paper(), [0.55, -0.2, -0.05], Fault::None);
    let mut log = EventLog::default();
    cell.run(&mut agent.clone(), &mut log).unwrap();
    let other = agent_of(Servo::new(ServoLaw::PositionBased, servo.with_gain(0.5)));
    assert!(matches!(log.replay(&other), Err(AgentError::Replay { .. })));
    let cut = EventLog {
        events: log.events[..log.events.len() / 2].to_vec(),
    };
    assert!(matches!(cut.replay(&agent), Err(AgentError::Replay { .. })));
}
