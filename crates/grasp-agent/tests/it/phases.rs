//! The state machine: every transition and every order is in the log.

use std::collections::BTreeSet;

use grasp_agent::{CameraModel, EventKind, EventLog};

use crate::cell::{Fault, Shared, agent_of, hybrid};
use crate::faults::{end_of, words_from};

/// Phases of the state machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Phase {
    Search,
    Reach,
    Recover,
    Grip,
    End,
}
use Phase::{End, Grip, Reach, Recover, Search};

/// The phase that begins with an event, if one does.
fn enters(kind: &EventKind) -> Option<Phase> {
    Some(match kind {
        EventKind::Searching => Search,
        EventKind::Reaching => Reach,
        EventKind::Lost | EventKind::Missed => Recover,
        EventKind::AtGoal | EventKind::Cornered => Grip,
        EventKind::Grasped | EventKind::GaveUp(_) | EventKind::Failed(_) => End,
        _ => return None,
    })
}

/// The transitions in the diagram on the crate's front page.
const DIAGRAM: [(Phase, Phase); 13] = [
    (Search, Reach),
    (Search, End),
    (Reach, Recover),
    (Reach, Grip),
    (Reach, End),
    (Recover, Reach),
    (Recover, Search),
    (Recover, End),
    (Grip, Reach),
    (Grip, Recover),
    (Grip, Search),
    (Grip, End),
    // Of the fault before the first search.
    (End, End),
];

const FAULTS: [Fault; 27] = [
    Fault::None,
    Fault::NoFrame(0),
    Fault::NoFrame(5),
    Fault::FrozenFrame(3),
    Fault::FrozenPicture(2),
    Fault::Garbage,
    Fault::FalseCircle,
    Fault::Phantoms,
    Fault::ArmStuck(3),
    Fault::LineDead(0),
    Fault::LineDead(4),
    Fault::GripperDead(0),
    Fault::GripperDead(1),
    Fault::SensorDead(3),
    Fault::StopDead(3),
    Fault::StoppedShort(3),
    Fault::Near(4),
    Fault::HaltedTwice(3),
    Fault::HaltedNear(20.0),
    Fault::HaltedGrips(1),
    Fault::HaltedGrips(100),
    Fault::HaltedClosed(1),
    Fault::HaltedClosed(2),
    Fault::Slippery,
    Fault::SqueezedOut,
    Fault::PhantomOnce,
    Fault::PhantomFromThere,
];

/// The phases of a log, one after the other.
fn phases(log: &EventLog) -> Vec<Phase> {
    log.events
        .iter()
        .filter_map(|event| enters(&event.kind))
        .collect()
}

/// The phases in which an event can happen.
fn belongs_to(kind: &EventKind) -> &'static [Phase] {
    match kind {
        EventKind::AtSearchPose(_) => &[Search],
        EventKind::Recovering(_) => &[Recover],
        EventKind::Moved(_) | EventKind::TooFast => &[Reach],
        EventKind::Gripping(_) | EventKind::Gripped | EventKind::Withdrawn | EventKind::Lifted => {
            &[Grip]
        }
        _ => &[Search, Reach, Recover, Grip],
    }
}

#[test]
fn every_transition_is_one_of_the_diagram_and_in_the_log() {
    let mut seen = BTreeSet::new();
    for fault in FAULTS {
        let (_, log, _) = end_of(fault);
        let phases = phases(&log);
        for pair in phases.windows(2) {
            assert!(
                DIAGRAM.contains(&(pair[0], pair[1])),
                "{fault:?}: {phases:?}"
            );
            seen.insert((pair[0], pair[1]));
        }
        assert_eq!(phases.last(), Some(&End), "{fault:?}");
        assert_eq!(
            phases.iter().filter(|phase| **phase == End).count(),
            1,
            "{fault:?}"
        );
        // What is not in the log as a transition has not happened: every event is one of the phase
        // that the log is in.
        let mut phase = None;
        for event in &log.events {
            phase = enters(&event.kind).or(phase);
            let here =
                phase.is_none_or(|phase| phase == End || belongs_to(&event.kind).contains(&phase));
            assert!(here, "{fault:?}: {:?} in {phase:?}", event.kind);
        }
    }
    assert!(seen.len() >= 9, "{seen:?}");
}

#[test]
fn a_grip_away_from_the_goal_is_in_the_log() {
    // Three moves have been taken back, not in a row: a servo controller cannot aim, and reaches
    // on.
    let (_, log, _) = end_of(Fault::HaltedNear(20.0));
    let words = words_from(&log, "cornered");
    assert_eq!(words[..3], ["cornered", "seen", "reaching"], "{words:?}");
    // The hybrid can aim.
    let mut agent = agent_of(hybrid());
    let cell = Shared::new(
        CameraModel::paper(),
        [0.6, 0.0, -0.1],
        Fault::HaltedNear(20.0),
    );
    let mut log = EventLog::default();
    cell.run(&mut agent, &mut log).unwrap();
    assert!(phases(&log).windows(2).any(|pair| pair == [Reach, Grip]));
}

#[test]
fn an_order_that_is_not_answered_is_in_the_log() {
    let of = |fault| {
        let (end, log, _) = end_of(fault);
        assert!(end.is_err(), "{fault:?}");
        let [.., event, failed] = &log.events[..] else {
            panic!("{fault:?}: {log:?}");
        };
        assert!(matches!(failed.kind, EventKind::Failed(_)), "{fault:?}");
        event.kind.clone()
    };
    for after in 0..5 {
        let kind = of(Fault::LineDead(after));
        let order = matches!(&kind, EventKind::Unanswered(order) if order.starts_with("move to"));
        assert!(order, "{after}: {kind:?}");
    }
    assert_eq!(
        of(Fault::GripperDead(0)),
        EventKind::Unanswered("open the jaws".into())
    );
    assert_eq!(
        of(Fault::GripperDead(1)),
        EventKind::Unanswered("close the jaws".into())
    );
    assert_eq!(of(Fault::StopDead(3)), EventKind::Unanswered("stop".into()));
    // An arm that says where it stands has answered.
    assert!(matches!(
        of(Fault::StoppedShort(3)),
        EventKind::AtSearchPose(_) | EventKind::Moved(_)
    ));
}
