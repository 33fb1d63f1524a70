//! The log of a run replays to the same run.

use grasp_agent::qtable::QTable;
use grasp_agent::{
    Agent, AgentError, BehaviourPair, CameraModel, Controller, EventKind, EventLog, Hybrid,
    HybridSettings, Learned, OnlineLearning, Servo, ServoLaw, ServoSettings,
};

use crate::cell::{Fault, Shared, config, servo};

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
        replays(
            learned
                .clone()
                .learning(OnlineLearning::careful(7))
                .unwrap(),
            fault,
        );
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
    let agent = Agent::with_controller(config(), servo()).unwrap();
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
    let agent =
        Agent::with_controller(config(), Servo::new(ServoLaw::PositionBased, servo)).unwrap();
    let cell = Shared::new(CameraModel::paper(), [0.55, -0.2, -0.05], Fault::None);
    let mut log = EventLog::default();
    cell.run(&mut agent.clone(), &mut log).unwrap();
    let other = Agent::with_controller(
        config(),
        Servo::new(ServoLaw::PositionBased, servo.with_gain(0.5)),
    )
    .unwrap();
    assert!(matches!(log.replay(&other), Err(AgentError::Replay { .. })));
    let cut = EventLog {
        events: log.events[..log.events.len() / 2].to_vec(),
    };
    assert!(matches!(cut.replay(&agent), Err(AgentError::Replay { .. })));
}

mod saved {
    use grasp_agent::qtable::{Action, QTable, State};
    use grasp_agent::{
        Agent, AgentError, Behaviour, BehaviourPair, CameraModel, Controller, EventLog, Hybrid,
        HybridSettings, Learned, OnlineLearning, SavedRun,
    };

    use super::FAULTS;
    use crate::cell::{Fault, Shared, config};

    fn blank(spec: grasp_agent::BehaviourSpec) -> Behaviour {
        let table = QTable::new(spec.states(), spec.actions()).unwrap();
        Behaviour::new(spec, table).unwrap()
    }

    fn learned() -> Learned {
        let pair = BehaviourPair::paper_mended();
        Learned::new(blank(pair.centering), blank(pair.approaching)).with_kappa(3.0, 4.0)
    }

    /// Makes a run, saves it, and reads it again: all that the replay gets is the text.
    fn saved<C: Controller + Clone>(agent: &mut Agent<C>, cell: &Shared) -> String {
        let mut saved = SavedRun::before(agent);
        let end = agent.run_and_learn(
            &mut cell.clone(),
            &mut cell.clone(),
            &mut cell.clone(),
            &mut |event| {
                saved.note(event);
            },
        );
        let text = saved.to_json();
        let read = SavedRun::from_json(&text).unwrap();
        assert_eq!(read.log(), saved.log());
        assert_eq!(read.to_json(), text);
        match (end, read.replay()) {
            (Ok(then), Ok(now)) => assert_eq!(then, now),
            (Err(then), Err(now)) => assert_eq!(then.to_string(), now.to_string()),
            (then, now) => panic!("{then:?} and {now:?}"),
        }
        text
    }

    #[test]
    fn saved_runs_replay_from_their_text_alone() {
        let more = [
            Fault::NoFrame(3),
            Fault::FrozenPicture(2),
            Fault::LineDead(4),
            Fault::StopDead(3),
        ];
        for fault in FAULTS.into_iter().chain(more) {
            let cell = || Shared::new(CameraModel::paper(), [0.55, -0.2, -0.05], fault);
            let mut agent = Agent::with_controller(config(), learned()).unwrap();
            saved(&mut agent, &cell());

            // Learning, in the third run: what was learned in the first two is part of it.
            let mut agent = Agent::with_controller(config(), learned()).unwrap();
            for run in 0..3 {
                let learning = OnlineLearning::careful(run);
                let now = agent.controller().clone().learning(learning).unwrap();
                *agent.controller_mut() = now;
                saved(&mut agent, &cell());
            }

            // Not the paper's settings, which belong to it too.
            let bold = HybridSettings {
                caution: 1.0,
                nominal: CameraModel {
                    focal: 1.1 * CameraModel::paper().focal,
                    ..CameraModel::paper()
                },
                ..HybridSettings::paper()
            };
            let mut agent = Agent::with_controller(config(), Hybrid::new(bold)).unwrap();
            for _ in 0..3 {
                saved(&mut agent, &cell());
            }
        }
    }

    #[test]
    fn a_camera_that_froze_before_the_run_is_part_of_it() {
        let cell = Shared::new(
            CameraModel::paper(),
            [0.6, 0.1, -0.1],
            Fault::FrozenPicture(usize::MAX),
        );
        let mut agent =
            Agent::with_controller(config(), Hybrid::new(HybridSettings::paper())).unwrap();
        cell.run(&mut agent, &mut EventLog::default()).unwrap();
        let looks = cell.0.borrow().looks;
        cell.0.borrow_mut().fault = Fault::FrozenPicture(looks);
        assert!(saved(&mut agent, &cell).contains("frozen"));
    }

    #[test]
    fn another_course_is_told_with_the_event() {
        let cell = Shared::new(CameraModel::paper(), [0.6, 0.1, -0.1], Fault::None);
        let mut agent = Agent::with_controller(config(), learned()).unwrap();
        let text = saved(&mut agent, &cell);
        let differs = |text: &str| match SavedRun::from_json(text).unwrap().replay() {
            Err(AgentError::Replay { event, then, now }) => (event, then, now),
            same => panic!("{same:?}"),
        };
        // Other settings: of the bound on moves.
        let shorter = text.replace("\"max_cycles\":60", "\"max_cycles\":3");
        let (event, then, now) = differs(&shorter);
        let now = now.unwrap().kind;
        assert_eq!(
            (now.word(), event > 5),
            ("gave-up", true),
            "{event}: {now:?} for {then:?}"
        );
        // Other knowledge.
        let mut table = QTable::new(42, 9).unwrap();
        table.set(State(0), Action(0), 1.0).unwrap();
        (0..42).for_each(|state| table.set(State(state), Action(8), 2.0).unwrap());
        let pair = BehaviourPair::paper_mended();
        let other = Learned::new(
            Behaviour::new(pair.centering, table).unwrap(),
            blank(pair.approaching),
        );
        *agent.controller_mut() = other;
        let mut saved = SavedRun::before(&agent);
        let mut log = EventLog::default();
        cell.run(
            &mut Agent::with_controller(config(), learned()).unwrap(),
            &mut log,
        )
        .unwrap();
        for event in &log.events {
            saved.note(&grasp_agent::RunEvent {
                cycle: event.cycle,
                kind: event.kind.clone(),
                joints: event.joints,
                frame: None,
            });
        }
        assert!(matches!(saved.replay(), Err(AgentError::Replay { .. })));
    }

    #[test]
    fn damaged_saved_runs_are_refused_with_the_reason() {
        let cell = Shared::new(CameraModel::paper(), [0.6, 0.1, -0.1], Fault::None);
        let mut agent = Agent::with_controller(config(), learned()).unwrap();
        let text = saved(&mut agent, &cell);
        let cases = [
            ("grasp-agent run 3", "grasp-agent run 9", "run 9"),
            ("grasp-agent run 3", "grasp-agent run 2", "earlier version"),
            ("\"looks\":2", "\"looks\":0", "looks is 0"),
            (
                "\"lost_weight\":50",
                "\"lost_weight\":5",
                "lost_weight is 5",
            ),
            ("\"camera\"", "\"kamera\"", "camera"),
            ("\"events\"", "\"evens\"", "events"),
        ];
        for (old, new, said) in cases {
            let changed = text.replace(old, new);
            assert_ne!(changed, text, "{old}");
            let read = SavedRun::from_json(&changed);
            let refused = read.and_then(|saved| saved.replay()).unwrap_err();
            assert!(
                refused.to_string().contains(said),
                "{refused} does not say {said}"
            );
        }
        let half = SavedRun::from_json(&text[..text.len() / 2]);
        assert!(matches!(half, Err(AgentError::SavedRun(_))));
    }

    #[test]
    fn a_pose_that_is_not_finite_is_kept_and_replayed() {
        let hybrid = Hybrid::new(HybridSettings::paper()).frozen();
        let agent = Agent::with_controller(config(), hybrid).unwrap();
        let mut saved = SavedRun::before(&agent);
        let cell = Shared::new(CameraModel::paper(), [0.6, 0.1, -0.1], Fault::Nowhere(3));
        let mut log = EventLog::default();
        let end = cell.run(&mut agent.clone(), &mut log);
        assert!(matches!(
            end,
            Err(AgentError::Pose {
                joint: puma_val2::Joint::J2
            })
        ));
        for event in &log.events {
            saved.note(event);
        }
        let text = saved.to_json();
        assert!(text.contains("null"));
        let read = SavedRun::from_json(&text).unwrap();
        assert_eq!(read.to_json(), text);
        for run in [saved, read] {
            assert!(matches!(run.replay(), Err(AgentError::Pose { .. })));
        }
    }

    #[test]
    fn a_hybrid_that_cannot_work_is_refused() {
        let hybrid = Hybrid::new(HybridSettings::paper()).frozen();
        let agent = Agent::with_controller(config(), hybrid).unwrap();
        let text = SavedRun::before(&agent).to_json();
        let cases = [
            ("\"mean\":[0.0,", "\"mean\":[", "invalid length 12"),
            ("\"noise\":1.0", "\"noise\":0.0", "noise of the belief is 0"),
            ("\"turn\":0.17", "\"turn\":0.0", "prior"),
            ("\"play\":0.015", "\"play\":null", "null"),
            ("\"caution\":2.0", "\"caution\":-1.0", "caution"),
        ];
        for (old, new, said) in cases {
            let changed = text.replace(old, new);
            assert_ne!(changed, text, "{old}");
            let read = SavedRun::from_json(&changed).unwrap();
            let refused = read.replay().unwrap_err().to_string();
            assert!(refused.contains(said), "{refused} does not say {said}");
        }
    }
}
