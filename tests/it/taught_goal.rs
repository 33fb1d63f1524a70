//! A goal that is shown on the arm, in cells whose camera is not what it is taken to be.

use example_support::learning::ArmName;
use example_support::trial::TrialCell;
use grasp_agent::{
    Agent, AgentConfig, Controller, Hybrid, HybridSettings, Servo, ServoLaw, ServoSettings,
    TaughtGoal,
};
use pipeline_sim::{ErrorLevel, Errors};
use puma_val2::Joint;

/// Balls in each cell.
const BALLS: u64 = 3;

/// Returns the number of balls, of [`BALLS`], that the jaws hold in the end.
fn held<C: Controller + Clone>(cell: &TrialCell, config: &AgentConfig, controller: &C) -> usize {
    let agent = Agent::with_controller(config.clone(), controller.clone()).expect("sound settings");
    let run = |ball| {
        let result = cell.run(&mut agent.clone(), ball, &mut |_, _| (), &mut |_| ());
        result.expect("no fault").is_some_and(|result| result.held)
    };
    (0..BALLS).filter(|ball| run(*ball)).count()
}

/// A cell with drawn errors and the goal that is shown in it.
fn taught(level: ErrorLevel, seed: u64) -> Option<(TrialCell, TaughtGoal)> {
    let cell = TrialCell::draw(level, seed).expect("a camera");
    let goal = cell.teach_goal(seed).expect("no fault")?;
    Some((cell, goal))
}

#[test]
fn a_cell_without_errors_shows_the_papers_goal() {
    let (_, goal) = taught(ErrorLevel::None, 1).expect("in view");
    let f = goal.features();
    assert!((99.0..=108.0).contains(&f.x), "{f:?}");
    assert!(
        (74.0..=82.0).contains(&f.y) && (32.0..=34.0).contains(&f.r),
        "{f:?}"
    );
}

#[test]
fn servoing_with_a_wrong_camera_grasps_once_shown_the_goal() {
    let (mut with, mut without) = (0, 0);
    for seed in 0..4 {
        let (cell, goal) = taught(ErrorLevel::Moderate, seed).expect("in view");
        let (config, paper) = (cell.agent_config(), ServoSettings::paper());
        let shown = ServoSettings {
            goal: goal.features(),
            ..paper
        };
        without += held(&cell, &config, &Servo::new(ServoLaw::PositionBased, paper));
        with += held(
            &cell,
            &config.with_taught_goal(&goal),
            &Servo::new(ServoLaw::PositionBased, shown),
        );
    }
    assert!(
        with >= 11 && without <= 3,
        "{with} with, {without} without of 12"
    );
}

#[test]
fn what_was_shown_tells_the_hybrid_of_the_camera() {
    let hybrid = Hybrid::new(HybridSettings::paper());
    let shown: Vec<_> = (0..8)
        .filter_map(|seed| taught(ErrorLevel::Heavy, seed))
        .collect();
    assert_eq!(shown.len(), 8);
    // A ball that shows too far aside is brought into view by a turn of JT4.
    let turned = |goal: &TaughtGoal| goal.grip()[Joint::J4] != 0.0;
    assert!(shown.iter().any(|(_, goal)| turned(goal)));
    let (mut with, mut without) = (0, 0);
    for (cell, goal) in &shown {
        let hybrid_shown = hybrid.clone().shown(goal);
        with += held(
            cell,
            &cell.agent_config().with_taught_goal(goal),
            &hybrid_shown,
        );
        without += held(cell, &cell.agent_config(), &hybrid);
        // What it believes now explains what it was shown.
        let nominal = HybridSettings::paper().nominal;
        let between = nominal.tool_point(&(goal.seen_from() + goal.grip()));
        let model = hybrid_shown.belief().corrected(&nominal);
        let (f, expected) = (
            goal.features(),
            model.view(&goal.seen_from(), &between).expect("in front"),
        );
        let off = [f.x - expected.x, f.y - expected.y, f.r - expected.r];
        assert!(off.iter().all(|off| off.abs() < 2.0), "{off:?}");
    }
    let balls = BALLS as usize * shown.len();
    assert!(
        10 * with >= 9 * balls && 2 * without <= with,
        "{with} and {without} of {balls}"
    );
}

#[test]
fn a_goal_that_lies_within_the_hand_is_known_by_the_geometry() {
    // A camera far back shows the ball at the goal where the hand is.
    let shifted = |back: f64| {
        let errors = Errors {
            camera_shift: [0.0, 0.0, -back],
            ..Errors::none()
        };
        TrialCell::with_errors(errors, ArmName::Puma).expect("a camera")
    };
    let forbids = |cell: &TrialCell| cell.forbids(&cell.agent_config().goal);
    let cells = [-0.05, 0.0, 0.05, 0.095].map(shifted);
    assert_eq!(cells.each_ref().map(forbids), [false, false, false, true]);
    let [.., far] = cells;
    // A hand that touches nothing forbids nothing, nor is the goal forbidden that is shown there.
    assert!(!forbids(&far.clone().without_bodies()));
    let goal = far.teach_goal(1).expect("no fault").expect("in view");
    let config = far.agent_config().with_taught_goal(&goal);
    assert!(!far.forbids(&config.goal), "{:?}", goal.features());
}
