//! Bad input and faults: the arm stops, the cause is in the log and in a typed error, what was
//! learned is kept.

use grasp_agent::puma_val2::{ArmError, Joint, JointDelta};
use grasp_agent::{
    Agent, AgentConfig, AgentError, CameraModel, EventKind, EventLog, GaveUp, RunEvent, Servo,
    ServoLaw, ServoSettings,
};

use crate::cell::{Fault, Shared, agent_of, blank, config, hybrid, servo};

pub(crate) fn end_of(
    fault: Fault,
) -> (
    Result<grasp_agent::RunOutcome, AgentError>,
    EventLog,
    Shared,
) {
    let cell = Shared::paper(fault);
    let mut agent = agent_of(servo());
    let mut log = EventLog::default();
    (cell.run(&mut agent, &mut log), log, cell)
}

#[test]
fn without_a_fault_the_ball_is_gripped() {
    let (end, log, cell) = end_of(Fault::None);
    assert_eq!(end.unwrap().gave_up, None);
    let words: Vec<&str> = log.events.iter().map(|event| event.kind.word()).collect();
    // What was seen at the goal is seen again, gripped, and seen no more.
    let end = [
        "at-goal",
        "seen",
        "gripping",
        "gripped",
        "withdrawn",
        "not-seen",
        "not-seen",
        "lifted",
        "not-seen",
        "not-seen",
        "grasped",
    ];
    assert!(words.ends_with(&end), "{words:?}");
    assert!(
        cell.0.borrow().closed && cell.0.borrow().held && cell.miss() < 0.003,
        "{}",
        cell.miss()
    );
}

#[test]
fn a_failing_device_ends_the_run_with_its_cause_and_a_stop() {
    type Check = fn(&AgentError) -> bool;
    let cases: [(Fault, Check); 9] = [
        (Fault::NoFrame(3), |e| matches!(e, AgentError::Camera(_))),
        (Fault::FrozenFrame(3), |e| {
            matches!(e, AgentError::FrozenCamera { .. })
        }),
        // With no ball in view, and with one.
        (Fault::FrozenPicture(1), |e| {
            matches!(e, AgentError::FrozenCamera { .. })
        }),
        (Fault::FrozenPicture(2), |e| {
            matches!(e, AgentError::FrozenCamera { .. })
        }),
        (Fault::GripperDead(0), |e| {
            matches!(e, AgentError::Arm(ArmError::Line { .. }))
        }),
        (Fault::GripperDead(1), |e| {
            matches!(e, AgentError::Arm(ArmError::Line { .. }))
        }),
        (Fault::SensorDead(3), |e| {
            matches!(e, AgentError::Arm(ArmError::Line { .. }))
        }),
        (Fault::ArmStuck(3), |e| {
            matches!(e, AgentError::Arm(ArmError::NotReached { .. }))
        }),
        (Fault::LineDead(4), |e| {
            matches!(e, AgentError::Arm(ArmError::Line { .. }))
        }),
    ];
    for (fault, expected) in cases {
        let (end, log, cell) = end_of(fault);
        let error = end.unwrap_err();
        assert!(expected(&error), "{fault:?}: {error}");
        assert_eq!(
            log.events.last().unwrap().kind,
            EventKind::Failed(error.to_string()),
            "{fault:?}"
        );
        assert!(
            cell.0.borrow().stops > 0 && !cell.0.borrow().closed,
            "{fault:?}"
        );
    }
}

#[test]
fn an_arm_that_does_not_say_where_it_stands_is_moved_no_more() {
    for moves in [0, 1, 3] {
        let (end, log, cell) = end_of(Fault::Nowhere(moves));
        let error = end.unwrap_err();
        assert!(
            matches!(
                error,
                AgentError::Pose {
                    joint: Joint::J2,
                    ..
                }
            ),
            "{moves}: {error}"
        );
        assert!(cell.0.borrow().stops > 0 && cell.0.borrow().joints.non_finite().is_none());
        let before = agent_of(servo());
        let replayed = log.replay(&before).unwrap_err();
        assert_eq!(replayed.to_string(), error.to_string());
    }
}

#[test]
fn a_camera_that_froze_between_two_runs_brings_about_no_grip() {
    let mut without_lift = config();
    without_lift.lift = None;
    let mut agent = Agent::with_controller(without_lift, servo()).unwrap();
    let cell = Shared::new(
        CameraModel::paper(),
        [0.6, 0.1, -0.1],
        Fault::FrozenPicture(usize::MAX),
    );
    assert_eq!(
        cell.run(&mut agent, &mut EventLog::default())
            .unwrap()
            .gave_up,
        None
    );
    // From now on what was seen last, the ball at the goal, is seen from everywhere.
    let looks = cell.0.borrow().looks;
    cell.0.borrow_mut().fault = Fault::FrozenPicture(looks);
    let before = agent.clone();
    let mut log = EventLog::default();
    let error = cell.run(&mut agent, &mut log).unwrap_err();
    assert!(
        matches!(error, AgentError::FrozenCamera { looks: 2 }),
        "{error}"
    );
    assert!(
        log.events
            .iter()
            .any(|event| event.kind == EventKind::SameFrame)
    );
    assert!(!cell.0.borrow().closed && cell.0.borrow().stops > 0);
    let replayed = log.replay(&before).unwrap_err();
    assert!(
        matches!(replayed, AgentError::FrozenCamera { looks: 2 }),
        "{replayed}"
    );
}

#[test]
fn too_rapid_an_approach_is_taken_back_and_made_more_slowly() {
    let exceeded = |before: f64, after: f64| after > 20.0 && after > 1.5 * before;
    let mut slow = config();
    (slow.approach_radius, slow.approach_growth) = (20.0, 1.5);
    let mut agent = Agent::with_controller(slow, hybrid()).unwrap();
    let cell = Shared::paper(Fault::None);
    let mut log = EventLog::default();
    let outcome = cell.run(&mut agent, &mut log).unwrap();
    assert_eq!(outcome.gave_up, None);
    let radius = |event: &RunEvent<'_>| match event.kind {
        EventKind::Seen(sighting) => Some(sighting.features.r),
        _ => None,
    };
    let fast: Vec<usize> = (0..log.events.len())
        .filter(|&i| log.events[i].kind == EventKind::TooFast)
        .collect();
    assert!(!fast.is_empty());
    for i in fast {
        // Moved, Seen too near, TooFast, TakenBack: the arm is where it was before.
        assert!(radius(&log.events[i - 1]).unwrap() > 20.0);
        assert_eq!(log.events[i + 1].kind, EventKind::TakenBack);
        assert_eq!(log.events[i + 1].joints, log.events[i - 3].joints);
    }
    // What was let pass was slow enough.
    let mut last: Option<f64> = None;
    for (i, event) in log.events.iter().enumerate() {
        let taken_back = log
            .events
            .get(i + 1)
            .is_some_and(|next| next.kind == EventKind::TooFast);
        if let Some(r) = radius(event).filter(|_| !taken_back) {
            assert!(
                last.is_none_or(|last| !exceeded(last, r)),
                "{last:?} to {r}"
            );
            last = Some(r);
        }
    }
}

#[test]
fn what_is_no_number_is_no_ball() {
    let (end, ..) = end_of(Fault::Garbage);
    assert_eq!(end.unwrap().gave_up, Some(GaveUp::NotFound));
}

#[test]
fn something_near_stops_the_arm_and_takes_it_back() {
    let (end, log, cell) = end_of(Fault::Near(3));
    assert_eq!(end.unwrap().gave_up, None);
    let near = log
        .events
        .iter()
        .position(|event| event.kind == EventKind::TooNear)
        .unwrap();
    assert_eq!(log.events[near + 1].kind, EventKind::TakenBack);
    // The move before the last one led to where it is taken back to.
    assert_eq!(
        log.events[near + 1].joints,
        log.events[..near - 1].iter().last().unwrap().joints
    );
    assert!(cell.0.borrow().stops > 0);
}

/// The words of the events from the first of this kind on.
pub(crate) fn words_from(log: &EventLog, first: &str) -> Vec<&'static str> {
    let words = log.events.iter().map(|event| event.kind.word());
    words.skip_while(|word| *word != first).collect()
}

#[test]
fn an_arm_that_its_own_guard_halts_is_taken_back_and_goes_on() {
    for fault in [Fault::Halted(3), Fault::HaltedTwice(3)] {
        let (end, log, cell) = end_of(fault);
        assert_eq!(end.unwrap().gave_up, None, "{fault:?}");
        assert!(cell.0.borrow().held, "{fault:?}");
        let near = words_from(&log, "too-near");
        let twice = fault != Fault::Halted(3);
        assert_eq!(near[1], "taken-back", "{fault:?}");
        assert_eq!(near[2] == "too-near", twice, "{fault:?}: {near:?}");
        // The arm has stopped by itself; it need not be told.
        assert_eq!(cell.0.borrow().stops, 0, "{fault:?}");
        let at = log
            .events
            .iter()
            .position(|e| e.kind == EventKind::TooNear)
            .unwrap();
        let (before, halted, back) = (&log.events[at - 2], &log.events[at], &log.events[at + 1]);
        assert_ne!(halted.joints, before.joints, "{fault:?}");
        assert_eq!(back.joints == before.joints, !twice, "{fault:?}");
    }
}

#[test]
fn a_goal_within_the_hand_is_told() {
    let mut hybrid = agent_of(hybrid());
    let mut runs = vec![end_of(Fault::HandInTheWay(22.0)).0];
    for _ in 0..3 {
        let cell = Shared::paper(Fault::HandInTheWay(22.0));
        runs.push(cell.run(&mut hybrid, &mut EventLog::default()));
    }
    for end in runs {
        assert_eq!(end.unwrap().gave_up, Some(GaveUp::GoalBarred));
    }
}

#[test]
fn a_hybrid_grips_from_where_every_move_is_halted() {
    // The hybrid is halted again and again on its way, and knows by then where the ball is.
    let mut agent = agent_of(hybrid());
    for run in 0..10 {
        let y = 0.05 * f64::from(run) - 0.25;
        let cell = Shared::new(CameraModel::paper(), [0.6, y, -0.1], Fault::None);
        assert_eq!(
            cell.run(&mut agent, &mut EventLog::default())
                .unwrap()
                .gave_up,
            None
        );
    }
    let cell = Shared::new(
        CameraModel::paper(),
        [0.6, 0.0, -0.1],
        Fault::HaltedNear(30.0),
    );
    let mut log = EventLog::default();
    let outcome = cell.run(&mut agent, &mut log).unwrap();
    assert_eq!(outcome.gave_up, None);
    assert!(cell.0.borrow().held);
    assert!(words_from(&log, "at-goal").is_empty());
    let halts = log
        .events
        .iter()
        .filter(|event| event.kind == EventKind::TooNear);
    assert!(halts.count() >= 3);
}

#[test]
fn false_circles_do_not_mislead_the_hybrid_for_long() {
    let mut agent = agent_of(hybrid());
    let mut reached = 0;
    for run in 0..20 {
        let cell = Shared::new(
            CameraModel::paper(),
            [0.6, 0.02 * f64::from(run) - 0.2, -0.1],
            Fault::FalseCircle,
        );
        let outcome = cell.run(&mut agent, &mut EventLog::default()).unwrap();
        reached += usize::from(outcome.gave_up.is_none());
    }
    assert!(reached >= 18, "{reached}");
    let mean = agent.controller().belief().mean();
    assert!(
        mean[0].abs() < 0.02 && mean[3..6].iter().all(|turn| turn.abs() < 0.02),
        "{mean:?}"
    );
}

#[test]
fn what_was_learned_before_the_line_died_is_kept() {
    let mut agent = agent_of(hybrid());
    let untaught = agent.controller().belief().clone();
    let cell = Shared::new(CameraModel::paper(), [0.6, 0.1, -0.1], Fault::LineDead(3));
    assert!(cell.run(&mut agent, &mut EventLog::default()).is_err());
    assert_ne!(*agent.controller().belief(), untaught);
}

#[test]
fn phantoms_cause_no_grip_and_no_pose_out_of_limits() {
    let checked = config();
    for gain in [1.0, 0.5] {
        let servo = ServoSettings::paper().with_gain(gain);
        let mut agent =
            Agent::with_controller(checked.clone(), Servo::new(ServoLaw::PositionBased, servo))
                .unwrap();
        let cell = Shared::new(CameraModel::paper(), [-0.6, 0.0, -0.1], Fault::Phantoms);
        let mut log = EventLog::default();
        let outcome = cell.run(&mut agent, &mut log).unwrap();
        assert!(outcome.gave_up.is_some(), "{outcome:?}");
        assert!(outcome.cycles <= checked.max_cycles + checked.recovery.len() + 1);
        let moved = log
            .events
            .iter()
            .filter(|event| matches!(event.kind, EventKind::Moved(_)));
        assert!(moved.clone().count() > 3);
        assert!(
            moved
                .into_iter()
                .all(|event| checked.limits.admit(&event.joints))
        );
    }
}

#[test]
fn behaviours_learned_before_a_fault_are_saved_and_resumed() {
    use grasp_agent::{Behaviour, BehaviourPair, Learned, OnlineLearning};
    let pair = BehaviourPair::paper_mended();
    let (centering, approaching) = (
        blank(pair.centering.clone()),
        blank(pair.approaching.clone()),
    );
    let learned = Learned::new(centering, approaching.clone())
        .learning(OnlineLearning::careful(3))
        .unwrap();
    let mut agent = agent_of(learned);
    let cell = Shared::new(CameraModel::paper(), [0.6, 0.1, -0.1], Fault::LineDead(6));
    let error = cell.run(&mut agent, &mut EventLog::default()).unwrap_err();
    assert!(
        matches!(error, AgentError::Arm(ArmError::Line { .. })),
        "{error}"
    );
    let (centering, after) = agent.into_controller().into_behaviours();
    assert_ne!(after, approaching);

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("approaching.policy");
    after.save(&path).unwrap();
    let resumed = Behaviour::load(&path, &pair.approaching).unwrap();
    assert_eq!(resumed, after);
    let fine = Behaviour::load(&path, &BehaviourPair::fine().approaching).unwrap_err();
    assert!(fine.to_string().contains("differs"), "{fine}");
    // On another line it goes on from there.
    let learned = Learned::new(centering, resumed)
        .learning(OnlineLearning::careful(4))
        .unwrap();
    let mut agent = agent_of(learned);
    let cell = Shared::paper(Fault::None);
    cell.run(&mut agent, &mut EventLog::default()).unwrap();
    assert_ne!(*agent.controller().approaching(), after);
}

#[test]
fn settings_that_cannot_work_are_refused() {
    type Change = fn(&mut AgentConfig);
    let changes: [(&str, Change); 23] = [
        ("same_frames", |c| c.same_frames = 0),
        ("lift", |c| c.lift = Some(JointDelta::default())),
        ("lift", |c| c.lift = Some(JointDelta([f64::NAN; 6]))),
        ("left_behind", |c| c.left_behind = f64::NAN),
        ("left_behind", |c| c.left_behind = -1.0),
        ("left_behind", |c| c.left_behind = f64::INFINITY),
        ("grip", |c| c.grip.0[4] = 4.0),
        ("grip", |c| c.grip.0[0] = f64::NAN),
        ("looks", |c| c.looks = 0),
        ("max_cycles", |c| c.max_cycles = 0),
        ("max_views", |c| c.max_views = 0),
        ("goal of X", |c| {
            (c.goal[0].low, c.goal[0].high) = (108.0, 99.0);
        }),
        ("goal of Y", |c| c.goal[1].low = f64::NAN),
        ("goal of R", |c| c.goal[2].high = f64::INFINITY),
        ("approach_growth", |c| c.approach_growth = f64::NAN),
        ("approach_growth", |c| c.approach_growth = f64::INFINITY),
        ("approach_radius", |c| c.approach_radius = f64::NAN),
        ("reach_tolerance", |c| c.reach_tolerance = f64::INFINITY),
        ("reach_tolerance", |c| c.reach_tolerance = f64::NAN),
        ("reach_tolerance", |c| c.reach_tolerance = -0.1),
        ("limits of JT6", |c| {
            c.limits.0[5] = (f64::NEG_INFINITY, f64::INFINITY);
        }),
        ("search_again", |c| c.search_again[0].0[0] = f64::NAN),
        ("recovery", |c| c.recovery[0].0[1] = f64::INFINITY),
    ];
    for (name, change) in changes {
        let mut config = config();
        change(&mut config);
        let refused = Agent::with_controller(config, servo()).unwrap_err();
        assert!(refused.to_string().contains(name), "{name}: {refused}");
    }
}

#[test]
fn a_camera_that_freezes_at_any_look_brings_about_no_success() {
    for slippery in [false, true] {
        let (_, _, cell) = end_of(Fault::FrozenPicture(usize::MAX));
        let looks = cell.0.borrow().looks;
        // The lift is followed by two looks, and the picture before it cannot be an old one.
        for after in 0..looks - 1 {
            let cell = Shared::new(
                CameraModel::paper(),
                [0.6, 0.1, -0.1],
                Fault::FrozenPicture(after),
            );
            cell.0.borrow_mut().slippery = slippery;
            let servo = servo();
            let mut agent = agent_of(servo);
            let mut log = EventLog::default();
            let end = cell.run(&mut agent, &mut log);
            assert!(
                matches!(end, Err(AgentError::FrozenCamera { .. })),
                "slippery {slippery}, after {after} of {looks}: {end:?} {:?}",
                words_from(&log, "at-goal")
            );
        }
    }
}
