//! The fewest moves to a goal.

use hough_heuristic::Features;
use pipeline_sim::{Ball, Cell, Workspace};
use puma_val2::{JointDelta, Joints};

use crate::rng;

/// Returns the paper's moves of `JT2` and `JT3` together.
fn moves() -> Vec<JointDelta> {
    let jt2 = [-20.0, -6.0, -2.0, -0.6, 0.0, 0.6, 2.0, 6.0, 20.0];
    let jt3 = [-16.0, -5.0, -1.6, -0.5, 0.0, 0.5, 1.6, 5.0, 16.0];
    let pairs = jt2.into_iter().flat_map(|d2| jt3.map(|d3| (d2, d3)));
    pairs
        .map(|(d2, d3)| JointDelta::from_degrees([0.0, d2, d3, 0.0, 0.0, 0.0]))
        .collect()
}

fn reached(f: &Features, _: &Joints) -> bool {
    (74.0..=82.0).contains(&f.y) && (32.0..=34.0).contains(&f.r)
}

#[test]
fn goal_is_four_to_five_moves_from_the_search_poses() {
    let mut rng = rng(1);
    let (workspace, moves) = (Workspace::paper(), moves());
    let nominal = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    let (mut total, mut starts) = (0, 0);
    while starts < 20 {
        let seen = workspace.sample_seen_ball(&nominal, &mut rng);
        let (ball, mut pose) = seen.expect("most balls are seen");
        let cell = Cell::paper(ball);
        // Turned to the ball: the optimum of the approach alone.
        pose.0[0] = cell.goal_pose(45.0).expect("within reach").0[0];
        let steps = cell.fewest_moves(&pose, &moves, reached, 11);
        if let Some(steps) = steps.expect("sound limits") {
            total += steps;
            starts += 1;
        }
    }
    let mean = f64::from(total) / f64::from(starts);
    assert!((4.0..4.8).contains(&mean), "{mean}");
}

#[test]
fn search_ends_at_the_goal_and_without_a_way() {
    let cell = Cell::paper(Ball::at(0.62, 0.2, -0.1));
    let there = cell.goal_pose(45.0).expect("within reach");
    assert_eq!(cell.fewest_moves(&there, &moves(), reached, 5), Ok(Some(0)));
    for nowhere in [
        Joints::from_degrees([0.0, -110.0, 210.0, 0.0, -45.0, 0.0]),
        Joints::from_degrees([0.0, 20.0, 210.0, 0.0, 45.0, 0.0]),
    ] {
        assert_eq!(cell.fewest_moves(&nowhere, &moves(), reached, 5), Ok(None));
    }
    // Without any move there is only the start.
    assert_eq!(cell.fewest_moves(&there, &[], |_, _| true, 5), Ok(Some(0)));
    let never = |_: &Features, _: &Joints| false;
    assert_eq!(cell.fewest_moves(&there, &[], never, u32::MAX), Ok(None));
    // A single move that leads out of the limits at once, however long.
    let leap = [JointDelta::from_degrees([0.0, 1e30, 0.0, 0.0, 0.0, 0.0])];
    assert_eq!(cell.fewest_moves(&there, &leap, never, 5), Ok(None));
}

#[test]
fn unbounded_searches_are_refused_by_name() {
    let cell = Cell::paper(Ball::at(0.62, 0.2, -0.1));
    let there = cell.goal_pose(45.0).expect("within reach");
    let refused = |cell: &Cell, start: &Joints, moves: &[JointDelta]| {
        let answer = cell.fewest_moves(start, moves, reached, u32::MAX);
        answer.expect_err("no bounds").to_string()
    };
    for bad in [f64::INFINITY, f64::NEG_INFINITY, f64::NAN, 1e300] {
        let mut endless = cell;
        endless.limits = [(-bad, bad); 6];
        let message = refused(&endless, &there, &moves());
        assert!(message.contains("working limits"), "{message}");
    }
    let mut nowhere = there;
    nowhere.0[3] = f64::NAN;
    assert!(refused(&cell, &nowhere, &moves()).contains("start of JT4"));
    let mut wild = moves();
    wild[2].0[2] = f64::NEG_INFINITY;
    assert!(refused(&cell, &there, &wild).contains("move of JT3"));
    let mut lost = cell;
    lost.ball.centre.y = f64::NAN;
    assert!(refused(&lost, &there, &moves()).contains("y coordinate of the ball"));
    let all = [JointDelta::from_degrees([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])];
    assert!(refused(&cell, &there, &all).contains("at most 2, but is 3"));
}
