//! Closing the jaws, and telling a ball in them from one that is not.

use grasp_agent::puma_val2::JointDelta;
use grasp_agent::{
    Agent, AgentConfig, BehaviourPair, CameraModel, EventKind, EventLog, GaveUp, GoalInterval,
    RunOutcome,
};

use crate::cell::{Fault, Shared, config, servo};
use crate::faults::{end_of, words_from};

#[test]
fn a_grip_that_is_halted_is_tried_again_and_not_for_ever() {
    let (end, log, cell) = end_of(Fault::HaltedGrips(1));
    assert_eq!(end.unwrap().gave_up, None);
    assert!(cell.0.borrow().held);
    let expected = [
        "gripping",
        "too-near",
        "taken-back",
        "seen",
        "reaching",
        "at-goal",
        "seen",
        "gripping",
        "gripped",
    ];
    assert!(words_from(&log, "gripping").starts_with(&expected));
    let (end, _, cell) = end_of(Fault::HaltedGrips(100));
    assert_eq!(end.unwrap().gave_up, Some(GaveUp::Obstructed));
    assert!(!cell.0.borrow().closed);
}

#[test]
fn a_closed_hand_that_is_halted_has_not_succeeded() {
    // On its way back, which was free: the ball is in that way and not in the jaws. It is gripped
    // again.
    let (end, log, cell) = end_of(Fault::HaltedClosed(1));
    let expected = [
        "gripped",
        "withdrawn",
        "too-near",
        "taken-back",
        "missed",
        "recover",
        "seen",
    ];
    assert!(
        words_from(&log, "gripped").starts_with(&expected),
        "{log:?}"
    );
    assert_eq!(end.unwrap().gave_up, None);
    assert!(cell.0.borrow().held);
    // As it lifts: what is in the jaws is not known.
    let (end, log, _) = end_of(Fault::HaltedClosed(2));
    let expected = ["lifted", "too-near", "taken-back", "gave-up"];
    assert_eq!(words_from(&log, "lifted"), expected);
    assert_eq!(end.unwrap().gave_up, Some(GaveUp::Obstructed));
}

#[test]
fn false_circles_at_the_goal_are_no_success() {
    for (fault, gripped) in [
        (Fault::PhantomOnce, false),
        (Fault::PhantomFromThere, true),
        (Fault::PhantomEverywhere, true),
    ] {
        let (end, log, cell) = end_of(fault);
        assert!(end.unwrap().gave_up.is_some(), "{fault:?}");
        assert_eq!(
            !words_from(&log, "gripped").is_empty(),
            gripped,
            "{fault:?}"
        );
        assert_eq!(!words_from(&log, "missed").is_empty(), gripped, "{fault:?}");
        assert!(!cell.0.borrow().closed, "{fault:?}");
    }
}

#[test]
fn a_ball_that_is_not_gripped_is_reached_for_again() {
    let mut short = config();
    short.max_cycles = 12;
    let cell = Shared::paper(Fault::Slippery);
    let mut agent = Agent::with_controller(short, servo()).unwrap();
    let mut log = EventLog::default();
    let outcome = cell.run(&mut agent, &mut log).unwrap();
    let missed = log
        .events
        .iter()
        .filter(|event| event.kind == EventKind::Missed)
        .count();
    assert!(
        missed > 1 && outcome.gave_up == Some(GaveUp::KeptMissing),
        "{missed} {outcome:?}"
    );
    assert!(!cell.0.borrow().closed);
}

#[test]
fn a_ball_seen_in_the_jaws_is_not_one_left_behind() {
    let at_once: &[_] = &["lifted", "seen", "seen", "grasped"];
    let then: &[_] = &["lifted", "seen", "seen", "lifted", "seen", "grasped"];
    for (from, expected) in [(0, at_once), (2, then)] {
        let (end, log, cell) = end_of(Fault::ShowsInTheJaws(from));
        assert_eq!(end.unwrap().gave_up, None);
        assert!(cell.0.borrow().held);
        assert_eq!(words_from(&log, "lifted"), expected);
    }
}

#[test]
fn a_ball_that_was_squeezed_out_is_not_grasped() {
    let (end, log, cell) = end_of(Fault::SqueezedOut);
    assert_eq!(end.unwrap().gave_up, None);
    assert!(cell.0.borrow().held);
    let missed = words_from(&log, "gripped");
    let missed = missed.iter().filter(|word| **word == "missed");
    assert_eq!(missed.count(), 1);
}

#[test]
fn a_ball_at_two_places_in_turn_ends_with_the_cycles() {
    let mut wide = config();
    wide.goal = BehaviourPair::paper_mended()
        .with_y_goal(GoalInterval::Y_SECTION_4)
        .unwrap()
        .goal();
    let cell = Shared::new(
        CameraModel::paper(),
        [0.6, 0.1, -0.1],
        Fault::Restless(10_000),
    );
    let mut agent = Agent::with_controller(wide, servo()).unwrap();
    let outcome = cell.run(&mut agent, &mut EventLog::default()).unwrap();
    assert_eq!(outcome.gave_up, Some(GaveUp::Unsteady));
    assert!(!cell.0.borrow().closed);
}

/// The end of a run under the paper's settings, changed.
fn end_with(change: impl Fn(&mut AgentConfig)) -> (RunOutcome, Shared) {
    let mut changed = config();
    change(&mut changed);
    let cell = Shared::paper(Fault::None);
    let mut agent = Agent::with_controller(changed, servo()).unwrap();
    (
        cell.run(&mut agent, &mut EventLog::default()).unwrap(),
        cell,
    )
}

#[test]
fn a_grip_that_leads_out_of_the_limits_is_not_made() {
    let (outcome, cell) = end_with(|config| config.limits.0[4].0 = 30_f64.to_radians());
    assert_eq!(outcome.gave_up, Some(GaveUp::NoMoveLeft));
    assert!(!cell.0.borrow().closed);
}

#[test]
fn a_lift_that_the_limits_do_not_allow_is_no_verification() {
    let upward = |degrees: f64| {
        move |config: &mut AgentConfig| {
            // The wrist, which stands still while the ball is reached.
            config.lift = Some(JointDelta::from_degrees([0.0, 0.0, 0.0, 0.0, 15.0, 0.0]));
            config.limits.0[4].1 = (45.0 + degrees).to_radians();
        }
    };
    for (slack, gave_up) in [
        (0.0, Some(GaveUp::NoMoveLeft)),
        (9.0, Some(GaveUp::NoMoveLeft)),
        (11.0, None),
    ] {
        assert_eq!(end_with(upward(slack)).0.gave_up, gave_up, "{slack}");
    }
}
