//! The cell against the geometry it was designed to: named poses, the grip by JT5 alone, coverage.

use hough_heuristic::Features;
use nalgebra::{Point3, Vector3};
use pipeline_sim::{Ball, Cell, Grasp, SightError, Workspace};
use puma_val2::{Arm, Joint, JointDelta, Joints, PumaParams};

use crate::{at_goal, rng};

/// Cells with a ball that a search pose sees and the arm reaches, each with its goal pose.
fn goals(count: usize) -> Vec<(Cell, Joints)> {
    let mut rng = rng(1);
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    (0..count)
        .map(|_| {
            let (ball, _) = Workspace::paper()
                .sample_seen_ball(&cell, &mut rng)
                .expect("most balls are seen");
            let cell = Cell::paper(ball);
            let goal = cell
                .goal_pose(Cell::REACHING_JT5_DEGREES)
                .expect("every seen ball is within reach");
            (cell, goal)
        })
        .collect()
}

#[test]
fn camera_of_the_first_search_pose_is_at_its_place() {
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    let pose = Joints::from_degrees([0.0, -110.0, 210.0, 0.0, 45.0, 0.0]);
    let camera = cell.camera_pose(&pose).translation.vector * 1000.0;
    assert!(
        (camera - Vector3::new(343.0, 154.0, 369.0)).amax() < 1.0,
        "{camera}"
    );
    let tool = cell.tool_point(&pose).coords * 1000.0;
    // 10 mm past the tool point is the finger tip.
    assert!(
        (tool - Vector3::new(387.0, 149.0, 201.0)).norm() < 12.0,
        "{tool}"
    );
    let direction = cell.camera_pose(&pose) * Vector3::z();
    assert!(
        (direction.z.asin().to_degrees() + 55.0).abs() < 1e-9,
        "looks 55 degrees down"
    );
}

#[test]
fn goal_poses_show_the_goal_and_agree_with_known_ones() {
    for (cell, goal) in goals(300) {
        let Features { x, y, r } = cell.features(&goal).expect("the goal is in sight");
        assert!(
            (x - 103.5).abs() < 0.2,
            "the arm's plane is 7.5 units right of the axis: {x}"
        );
        assert!(
            (y - 78.0).abs() < 1e-3 && (r - 33.0).abs() < 1e-3,
            "{y} {r}"
        );
    }
    // Planar balls (u, w) in millimetres and their goal poses.
    for (u, w, jt2, jt3) in [
        (481.0, 45.0, -86.9, 211.0),
        (651.0, -108.0, -53.0, 186.2),
        (769.0, -194.0, -34.1, 164.7),
    ] {
        let cell = Cell::paper(Ball::at(u / 1000.0, 0.14909, w / 1000.0));
        let goal = cell.goal_pose(45.0).expect("within reach").degrees();
        assert!(
            goal[0].abs() < 1e-9 && (goal[1] - jt2).abs() < 0.3 && (goal[2] - jt3).abs() < 0.3,
            "{goal:?}"
        );
    }
}

#[test]
fn turn_of_jt5_brings_the_gripper_to_the_ball() {
    let (mut worst, mut angles) = (0.0_f64, Vec::new());
    for (cell, goal) in goals(300) {
        angles.push(cell.grip_angle(&goal).to_degrees());
        let grip = goal + JointDelta::of(Joint::J5, (26.99_f64 - 45.0).to_radians());
        worst = worst.max(cell.grip_miss(&grip));
    }
    assert!(worst < 0.0002, "{worst}");
    assert!(
        angles.iter().all(|a| (a - 26.99).abs() < 0.03),
        "{angles:?}"
    );
}

#[test]
fn proximity_sensors_are_quiet_in_a_correct_reach() {
    for (cell, goal) in goals(300) {
        // Straight in joint space from the pose that sees the ball, turned to it, to the goal; then
        // the swing of JT5.
        let start = Joints::from_degrees([goal.degrees()[0], -110.0, 210.0, 0.0, 45.0, 0.0]);
        for i in 0..=20 {
            let t = f64::from(i) / 20.0;
            let pose = Joints(std::array::from_fn(|j| {
                start.0[j] + t * (goal.0[j] - start.0[j])
            }));
            assert!(!cell.proximity(&pose), "{t} at {pose} of {cell:?}");
            let swing = goal + JointDelta::of(Joint::J5, -18.01_f64.to_radians() * t);
            assert!(!cell.proximity(&swing), "swing {t} at {swing}");
        }
    }
}

#[test]
fn proximity_sensors_warn_of_table_ball_and_holder() {
    for (cell, goal) in goals(50) {
        // Past the goal, onto the ball: the elbow opens further and further.
        let onto = (0..60).map(|i| {
            goal + JointDelta::from_degrees([0.0, 0.5 * f64::from(i), 0.0, 0.0, 0.0, 0.0])
        });
        assert!(onto.into_iter().any(|pose| cell.proximity(&pose)));
        let aside = goal + JointDelta::from_degrees([2.5, 0.0, 0.0, 0.0, -18.01, 0.0]);
        assert!(cell.proximity(&aside), "a finger on the ball");
        assert!(!cell.collides(&goal));
        // A little farther and the finger is in the ball; pushed aside, it touches it and no more.
        let into = goal + JointDelta::from_degrees([3.5, 0.0, 0.0, 0.0, -18.01, 0.0]);
        let mut pushed = cell;
        assert!(cell.collides(&into) && pushed.sweep(&into, &into) > 0.0);
        assert!(!pushed.collides(&into) && pushed.proximity(&into));
    }
}

#[test]
fn ball_is_pushed_along_the_whole_way_of_the_hand() {
    for (cell, goal) in goals(20) {
        // From one side of the ball to the other: at neither end is it touched.
        let beside =
            |degrees: f64| goal + JointDelta::from_degrees([degrees, 0.0, 0.0, 0.0, -18.01, 0.0]);
        let (from, to) = (beside(12.0), beside(-12.0));
        let (mut swept, mut looked) = (cell, cell);
        assert!(looked.sweep(&from, &from) + looked.sweep(&to, &to) <= 0.0);
        assert!(swept.sweep(&from, &to) > 0.02);
        // A held ball comes along.
        let grip = beside(0.0);
        let mut held = cell;
        assert_eq!(held.close_gripper(&grip), Grasp::Held);
        assert!(held.sweep(&grip, &goal) <= 0.0);
        assert!(held.grip_miss(&goal) < 0.001 && !held.collides(&goal));
    }
}

#[test]
fn search_poses_see_93_percent_of_the_workspace() {
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    let (workspace, mut rng) = (Workspace::paper(), rng(2));
    let (balls, mut seen, mut reached) = (20_000, 0, 0);
    for _ in 0..balls {
        let ball = workspace.sample_ball(&mut rng);
        let cell = Cell { ball, ..cell };
        let sees = |pose| cell.circle(&pose).is_ok();
        if workspace.search_poses().into_iter().any(sees) {
            seen += 1;
            reached += usize::from(cell.goal_pose(45.0).is_ok());
        }
    }
    let share = f64::from(seen) / f64::from(balls);
    assert!((share - 0.931).abs() < 0.02, "{share}");
    assert!(reached as f64 > 0.999 * f64::from(seen), "{reached}");
}

/// Returns the cell with its ball where it shows with these features.
fn showing(cell: &Cell, pose: &Joints, x: f64, y: f64, r: f64) -> Cell {
    let place = cell.ball_showing(pose, &Features { x, y, r });
    let mut shown = *cell;
    shown.ball.centre = place.expect("some place shows it");
    shown
}

#[test]
fn features_and_places_invert_each_other() {
    let (cell, pose) = at_goal();
    for (x, y, r) in [
        (96.0, 72.0, 33.0),
        (20.0, 130.0, 10.0),
        (150.0, 30.0, 30.0),
        (103.5, 78.0, 33.0),
    ] {
        let shown = showing(&cell, &pose, x, y, r);
        let f = shown.features(&pose).expect("seen");
        let error = (f.x - x).abs().max((f.y - y).abs()).max((f.r - r).abs());
        assert!(error < 1e-9, "{f:?}");
    }
}

#[test]
fn unseen_balls_are_refused_with_the_reason() {
    let (cell, goal) = at_goal();
    for (x, y, r, reason) in [
        (96.0, 72.0, 90.0, "larger than the view"),
        (96.0, 72.0, 70.0, "out of the range 5..68"),
        (96.0, 72.0, 4.0, "out of the range 5..68"),
        (-3.0, 72.0, 30.0, "centre of the ball is outside"),
        (1.0, 72.0, 30.0, "at least 60 %"),
    ] {
        let refused = showing(&cell, &goal, x, y, r).features(&goal);
        let refused = refused.expect_err(reason).to_string();
        assert!(refused.contains(reason), "{refused}");
    }
    // A rule that is content with part of a ball larger than the view sees it.
    let mut large = showing(&cell, &goal, 96.0, 72.0, 90.0);
    large.sight.max_radius = 300.0;
    let refused = large.features(&goal);
    assert!(matches!(refused, Err(SightError::LargerThanView { .. })));
    large.sight.min_share = 0.1;
    assert!(large.features(&goal).is_ok());
    // Inside the camera, behind it, nowhere.
    for (x, z, reason) in [
        (0.0, 0.01, "not before the camera"),
        (0.0, -0.3, "not before the camera"),
        (f64::NAN, 0.3, "distance of the ball"),
    ] {
        let mut put = cell;
        put.ball.centre = cell.camera_pose(&goal) * Point3::new(x, 0.0, z);
        let refused = put.features(&goal).expect_err(reason).to_string();
        assert!(refused.contains(reason), "{refused}");
    }
    let mut nowhere = goal;
    nowhere.0[2] = f64::INFINITY;
    let refused = cell.features(&nowhere).expect_err("nowhere").to_string();
    assert!(refused.contains("JT3"), "{refused}");
}

#[test]
fn finger_sensors_respond_on_their_own_side() {
    let (cell, goal) = at_goal();
    let mut grip = goal;
    grip.0[4] = cell.grip_angle(&goal);
    assert_eq!(cell.proximity_pair(&grip), [false, false], "straddled");
    for (side, expected) in [(1.0, [true, false]), (-1.0, [false, true])] {
        let mut near = cell;
        // Two millimetres short of the finger on this side.
        let gap = cell.hand.half_opening - cell.hand.finger_radius - cell.ball.radius - 0.002;
        near.ball.centre += cell.arm.wrist(&grip) * Vector3::y() * (side * gap);
        assert_eq!(near.proximity_pair(&grip), expected, "{side}");
        assert!(near.proximity(&grip));
    }
}

#[test]
fn unreachable_goals_are_refused_with_the_reason() {
    type Spoil = fn(&mut Cell);
    let refused = |jt5: f64, spoil: Spoil| {
        let mut cell = at_goal().0;
        spoil(&mut cell);
        cell.goal_pose(jt5).expect_err("no pose").to_string()
    };
    let spoilt: [(&str, Spoil); 9] = [
        ("m from the shoulder", |c| c.ball.centre.x = 3.0),
        ("from the waist's axis", |c| {
            c.ball.centre = Point3::new(0.1, 0.0, 0.0);
        }),
        ("the pose has JT1", |c| {
            c.ball.centre = Point3::new(-0.6, 0.0, -0.1);
        }),
        ("y coordinate", |c| c.ball.centre.y = f64::NAN),
        ("mount", |c| c.mount.translation.vector.x = f64::NAN),
        ("a2", |c| c.arm = without_upper_arm()),
        ("radius of the ball", |c| c.ball.radius = f64::NAN),
        ("radius of the ball", |c| c.ball.radius = -0.02),
        ("radius of the ball", |c| c.ball.radius = 0.0),
    ];
    for (named, spoil) in spoilt {
        let refused = refused(45.0, spoil);
        assert!(refused.contains(named), "{named}: {refused}");
    }
    assert!(refused(f64::INFINITY, |_| ()).contains("JT5"));
}

fn without_upper_arm() -> Arm {
    let mut params = PumaParams::unimation();
    params.a2 = f64::NAN;
    params.into()
}

#[test]
fn measures_that_are_not_finite_are_named() {
    let (cell, pose) = at_goal();
    let (mut mount, mut arm, mut rule) = (cell, cell, cell);
    mount.mount.translation.vector.x = f64::NAN;
    arm.arm = without_upper_arm();
    rule.sight.min_share = f64::NAN;
    for (wrong, named) in [(mount, "mount"), (arm, "a2"), (rule, "fraction")] {
        let error = wrong.features(&pose).expect_err("no number").to_string();
        assert!(error.contains(named), "{error}");
    }
}

#[test]
fn cells_of_other_arms_show_balls_reach_them_and_grip_by_jt5() {
    let rng = &mut rng(3);
    for (cell, workspace) in [
        (Cell::ur5(Ball::at(-0.5, 0.0, 0.0)), Workspace::ur5()),
        (Cell::so101(Ball::at(0.3, 0.0, 0.0)), Workspace::so101()),
    ] {
        let mut reached = 0;
        for _ in 0..20 {
            let (ball, _) = workspace.sample_seen_ball(&cell, rng).expect("in view");
            assert!(workspace.contains(&ball.centre), "{ball:?}");
            let cell = Cell { ball, ..cell };
            let Ok(pose) = cell.goal_pose(cell.reached[Joint::J5].to_degrees()) else {
                continue;
            };
            reached += 1;
            let seen = cell.features(&pose).expect("in view");
            let off = [
                seen.x - Cell::GOAL.x,
                seen.y - Cell::GOAL.y,
                seen.r - Cell::GOAL.r,
            ];
            assert!(off.iter().all(|off| off.abs() < 1e-3), "{seen:?}");
            let mut grip = pose;
            grip.0[4] = cell.grip_angle(&pose);
            let better = |turn: f64| cell.grip_miss(&(grip + JointDelta::of(Joint::J5, turn)));
            assert!(better(0.0) <= better(0.01).min(better(-0.01)), "{grip}");
        }
        assert!(reached >= 15, "{reached} of 20");
    }
}

#[test]
fn places_that_are_not_finite_count_as_near() {
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    let pose = Workspace::paper().search_poses()[3];
    assert!(!cell.proximity(&pose) && !cell.collides(&pose));
    let (mut table, mut ball) = (cell, cell);
    table.table = f64::NAN;
    ball.ball.centre.x = f64::NAN;
    let nowhere = Joints([f64::NAN; 6]);
    for (cell, joints) in [(cell, nowhere), (table, pose), (ball, pose)] {
        assert!(cell.proximity(&joints) && cell.collides(&joints));
        assert_eq!(cell.proximity_pair(&joints), [true; 2]);
    }
}
