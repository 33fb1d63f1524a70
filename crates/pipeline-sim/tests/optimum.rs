//! The fewest moves from where the search finds the ball to the goal.

use pipeline_sim::{Ball, Cell, GoalBox, MoveLists, QuantityError, Workspace};
use puma_val2::{JointDelta, Joints};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

#[test]
fn from_the_search_poses_the_goal_is_four_to_five_moves_away() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let nominal = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    let (moves, goal) = (MoveLists::paper(), GoalBox::paper());
    let (mut histogram, mut total) = ([0; 12], 0);
    let starts = 100;
    for _ in 0..starts {
        let (ball, pose) = Workspace::paper()
            .sample_seen_ball(&nominal, &mut rng)
            .expect("most balls are seen");
        let cell = Cell::paper(ball);
        let steps = cell
            .fewest_reaching_moves(&pose, &moves, &goal, 11)
            .expect("sound limits")
            .expect("every seen ball can be reached");
        histogram[steps as usize] += 1;
        total += steps;
    }
    let mean = f64::from(total) / f64::from(starts);
    println!("{mean} {histogram:?}");
    assert!((4.1..4.8).contains(&mean), "{mean} {histogram:?}");
}

#[test]
fn at_the_goal_nothing_is_left_to_do_and_nowhere_there_is_no_way() {
    let cell = Cell::paper(Ball::at(0.62, 0.2, -0.1));
    let (moves, goal) = (MoveLists::paper(), GoalBox::paper());
    let there = cell.goal_pose(45.0).expect("within reach");
    assert_eq!(
        cell.fewest_reaching_moves(&there, &moves, &goal, 5),
        Ok(Some(0))
    );
    assert_eq!(
        cell.fewest_centring_moves(&there, &moves, &goal, 5),
        Ok(Some(0))
    );
    // At a radius of 33 a degree of JT1 moves the ball by twenty units: 2.4 degrees off are two or
    // three moves.
    let mut aside = there;
    aside.0[0] += 2.4_f64.to_radians();
    let steps = cell
        .fewest_centring_moves(&aside, &moves, &goal, 5)
        .expect("sound limits")
        .expect("in sight");
    assert!((2..=3).contains(&steps), "{steps}");
    for nowhere in [
        Joints::from_degrees([0.0, -110.0, 210.0, 0.0, -45.0, 0.0]),
        Joints::from_degrees([0.0, 20.0, 210.0, 0.0, 45.0, 0.0]),
    ] {
        assert_eq!(
            cell.fewest_reaching_moves(&nowhere, &moves, &goal, 5),
            Ok(None)
        );
    }
}

#[test]
fn a_search_without_bounds_is_refused_by_name() {
    let cell = Cell::paper(Ball::at(0.62, 0.2, -0.1));
    let there = cell.goal_pose(45.0).expect("within reach");
    let (moves, goal) = (MoveLists::paper(), GoalBox::paper());
    let refused = |cell: &Cell, start: &Joints, moves: &MoveLists| {
        let [reaching, centring] = [
            cell.fewest_reaching_moves(start, moves, &goal, u32::MAX),
            cell.fewest_centring_moves(start, moves, &goal, u32::MAX),
        ];
        [reaching, centring].map(|answer| answer.expect_err("no bounds").to_string())
    };
    for bad in [f64::INFINITY, f64::NEG_INFINITY, f64::NAN, 1e300] {
        let mut endless = cell;
        (endless.limits.max, endless.limits.min) = ([bad; 6], [-bad; 6]);
        for message in refused(&endless, &there, &moves) {
            assert!(message.contains("working limits"), "{message}");
        }
    }
    let mut nowhere = there;
    nowhere.0[3] = f64::NAN;
    for message in refused(&cell, &nowhere, &moves) {
        assert!(message.contains("start of JT4"), "{message}");
    }
    let mut wild = moves;
    (wild.jt1[3], wild.jt3[2]) = (f64::INFINITY, f64::NEG_INFINITY);
    let [reaching, centring] = refused(&cell, &there, &wild);
    assert!(
        reaching.contains("move of JT3") && centring.contains("move of JT1"),
        "{reaching} {centring}"
    );
    let all = [JointDelta::from_degrees([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])];
    assert_eq!(
        cell.fewest_moves(&there, &all, |_, _| true, 5),
        Err(QuantityError::Joints { count: 3 })
    );
    // Without any move there is only the start.
    assert_eq!(cell.fewest_moves(&there, &[], |_, _| true, 5), Ok(Some(0)));
    assert_eq!(
        cell.fewest_moves(&there, &[], |_, _| false, u32::MAX),
        Ok(None)
    );
    // A single move that leads out of the limits at once, however long.
    let leap = [JointDelta::from_degrees([0.0, 1e30, 0.0, 0.0, 0.0, 0.0])];
    assert_eq!(cell.fewest_moves(&there, &leap, |_, _| false, 5), Ok(None));
}

#[test]
fn a_ball_that_is_nowhere_is_named() {
    let mut cell = Cell::paper(Ball::at(0.62, 0.20, -0.10));
    let there = cell.goal_pose(45.0).expect("within reach");
    cell.ball.centre.y = f64::NAN;
    let moves = MoveLists::paper();
    let goal = GoalBox::paper();
    for result in [
        cell.fewest_moves(&there, &[], |_, _| true, 5),
        cell.fewest_reaching_moves(&there, &moves, &goal, 5),
        cell.fewest_centring_moves(&there, &moves, &goal, 5),
    ] {
        let refused = result.expect_err("nowhere").to_string();
        assert!(refused.contains("y coordinate of the ball"), "{refused}");
    }
}
