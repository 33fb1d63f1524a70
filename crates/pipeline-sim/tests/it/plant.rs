//! The cell as a plant: grasps and pushes.

use nalgebra::{Point3, Vector3};
use pipeline_sim::{Ball, Cell, Grasp, SharedCell, SimulatedArm, Workspace};
use puma_val2::{Gripper, JointDelta, Manipulator, ProximitySensor};

use crate::{at_goal, rng};

fn swing() -> JointDelta {
    JointDelta::from_degrees([0.0, 0.0, 0.0, 0.0, -18.01, 0.0])
}

#[test]
fn ball_at_the_pads_is_held_carried_and_put_down() {
    let (cell, goal) = at_goal();
    let shared = SharedCell::new(cell);
    let mut arm = SimulatedArm::new(shared.clone(), goal).expect("within limits");
    arm.move_by(swing()).expect("within limits");
    assert_eq!(shared.contacts().collisions, 0, "the open jaws straddle it");
    arm.set_gripper(Gripper::Closed).expect("always");
    assert_eq!(shared.contacts().grasp, Some(Grasp::Held));
    let joints = arm
        .move_by(JointDelta::from_degrees([10.0, -15.0, 0.0, 0.0, 0.0, 0.0]))
        .expect("within limits");
    assert_eq!(shared.contacts().collisions, 0);
    assert!(
        shared.get().ball.centre.z > cell.ball.centre.z + 0.05,
        "lifted"
    );
    assert!(shared.get().grip_miss(&joints) < 0.001);
    assert!(
        !arm.object_near().expect("always"),
        "what the hand holds is not in its way"
    );
    arm.set_gripper(Gripper::Open).expect("always");
    let z = shared.get().ball.centre.z;
    assert!(
        (z - (cell.table + 0.020)).abs() < 1e-12,
        "it fell onto the table: {z}"
    );
}

#[test]
fn ball_released_over_the_holder_stands_there_again() {
    let (mut cell, goal) = at_goal();
    let start = cell.ball.centre;
    let grip = goal + swing();
    assert_eq!(cell.close_gripper(&grip), Grasp::Held);
    cell.open_gripper();
    assert!((cell.ball.centre - start).norm() < 1e-4);
    assert_eq!(cell.jaws, Gripper::Open);
}

#[test]
fn grasp_beside_the_ball_pushes_it_or_misses() {
    let (cell, goal) = at_goal();
    let grip = goal + swing();
    let mut outcomes = [0; 3];
    for mm in 0..=40 {
        // The hand stands short of the ball or beyond it, along the tool axis: by construction the
        // ball is between the jaws.
        let mut off = cell;
        let axis = off.arm.wrist(&grip) * Vector3::z();
        off.ball.centre += axis * (f64::from(mm) / 1000.0);
        let before = off.ball.centre;
        let moved = |cell: &Cell| (cell.ball.centre - before).norm();
        match off.close_gripper(&grip) {
            Grasp::Held => {
                assert!(mm <= 10);
                outcomes[0] += 1;
            }
            Grasp::Pushed { by } => {
                assert!(mm >= 10 && (moved(&off) - by).abs() < 1e-9 && by > 0.0);
                outcomes[1] += 1;
            }
            Grasp::Missed => {
                assert!(mm >= 25 && moved(&off) == 0.0);
                outcomes[2] += 1;
            }
        }
    }
    assert!(outcomes.iter().all(|n| *n > 5), "{outcomes:?}");
}

#[test]
fn pads_that_slide_off_leave_the_ball_where_they_miss_it() {
    let (cell, goal) = at_goal();
    // The pads stand above, below, before and behind the ball.
    for (up, ahead) in [
        (0.02, 0.0),
        (-0.02, 0.0),
        (0.0, 0.02),
        (0.0, -0.02),
        (0.012, 0.012),
    ] {
        let mut off = cell;
        let grip = goal + swing();
        let level = off.arm.wrist(&grip) * Vector3::x();
        let level = Vector3::new(level.x, level.y, 0.0).normalize();
        off.ball.centre += Vector3::z() * up + level * ahead;
        let before = off.ball.centre;
        let Grasp::Pushed { by } = off.close_gripper(&grip) else {
            panic!("{up} {ahead}: not pushed");
        };
        assert!(((off.ball.centre - before).norm() - by).abs() < 1e-12);
        assert!(
            (off.ball.centre.z - before.z).abs() < 1e-12,
            "along the table"
        );
        let ball = off
            .arm
            .wrist(&grip)
            .inverse_transform_point(&off.ball.centre);
        let miss = ball.x.hypot(ball.z - off.arm.flange() - off.hand.tool);
        let touching = off.ball.radius + off.hand.finger_radius;
        assert!((miss - touching).abs() < 1e-9, "{up} {ahead}: {miss}");
    }
}

#[test]
fn jaws_hold_only_what_they_straddle_and_only_when_they_close() {
    let (cell, goal) = at_goal();
    let grip = goal + swing();
    let mut closed = cell;
    closed.jaws = Gripper::Closed;
    assert_eq!(
        closed.close_gripper(&grip),
        Grasp::Missed,
        "they were closed"
    );
    assert_eq!(closed.ball, cell.ball);
    let mut wide = cell;
    wide.ball.radius = 0.031;
    assert_eq!(
        wide.close_gripper(&grip),
        Grasp::Missed,
        "wider than the jaws open"
    );
    let mut twice = cell;
    assert_eq!(twice.close_gripper(&grip), Grasp::Held);
    assert_eq!(twice.close_gripper(&grip), Grasp::Held);
}

#[test]
fn ball_off_its_holder_is_pushed_without_it() {
    let (cell, goal) = at_goal();
    let mut cell = cell;
    let holder = cell.holder.expect("on a holder");
    assert!(holder.carries(&cell.ball));
    let grip = goal + swing();
    assert_eq!(cell.close_gripper(&grip), Grasp::Held);
    // A little aside, where it falls past the holder, then far away.
    for degrees in [2.0, 12.0] {
        let mut aside = cell;
        let there = grip + JointDelta::from_degrees([degrees, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert!(aside.sweep(&there, &there) <= 0.0);
        aside.open_gripper();
        assert!(!holder.carries(&aside.ball));
        let apart = (aside.ball.centre.xy() - holder.foot).norm();
        assert!(
            apart > holder.radius + aside.ball.radius - 1e-9,
            "{degrees}: {apart}"
        );
        // A finger meets it from the side.
        let reach = aside.arm.flange() + aside.hand.tool - 0.02;
        let finger = Point3::new(0.0, aside.hand.half_opening, reach);
        aside.ball.centre = aside.arm.wrist(&there) * finger + Vector3::new(0.01, 0.0, 0.0);
        assert!(aside.sweep(&there, &there) > 0.005);
        assert_eq!(aside.holder, Some(holder), "the holder stays where it is");
    }
}

#[test]
fn impossible_workspace_is_refused_and_has_no_balls() {
    type Spoil = fn(&mut Workspace);
    let (cell, _) = at_goal();
    assert_eq!(Workspace::paper().check(), Ok(()));
    let spoilt: [(&str, Spoil); 5] = [
        ("distance", |w| w.rho = (0.8, 0.5)),
        ("distance", |w| w.rho = (-0.5, 0.5)),
        ("azimuth", |w| w.azimuth = (0.0, f64::INFINITY)),
        ("height", |w| w.height = (f64::NAN, 0.0)),
        ("search poses", |w| w.search_elbow = (f64::NAN, 0.0)),
    ];
    for (name, spoil) in spoilt {
        let mut broken = Workspace::paper();
        spoil(&mut broken);
        let refused = broken.check().expect_err("no such workspace").to_string();
        assert!(refused.contains(name), "{refused}");
        assert!(broken.sample_ball(&mut rng(1)).centre.x.is_nan());
        assert_eq!(broken.sample_seen_ball(&cell, &mut rng(1)), None);
    }
}

#[test]
fn arm_pushes_the_ball_out_of_its_way() {
    let (cell, goal) = at_goal();
    let shared = SharedCell::new(cell);
    let mut arm = SimulatedArm::new(
        shared.clone(),
        goal + JointDelta::from_degrees([8.0, 0.0, 0.0, 0.0, -18.01, 0.0]),
    )
    .expect("within limits");
    arm.move_by(JointDelta::from_degrees([-16.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
        .expect("within limits");
    let contacts = shared.contacts();
    assert!(
        contacts.pushed > 0.02 && contacts.collisions == 1,
        "{contacts:?}"
    );
    let now = shared.get();
    let joints = arm.joints().expect("always");
    assert!(!now.collides(&joints));
    assert_eq!(
        now.holder.expect("still there").foot,
        now.ball.centre.xy(),
        "the holder went along"
    );
}

#[test]
fn long_hand_meets_the_ball_on_its_way() {
    // Fingers half a metre long: they reach the ball where the wrist stays far from it.
    let mut cell = Cell::paper(Ball::at(0.6, 0.1, -0.1));
    let goal = cell
        .goal_pose(Cell::REACHING_JT5_DEGREES)
        .expect("within reach");
    cell.hand.tool = 0.5;
    let wrist = cell.arm.wrist(&goal);
    let turned = |degrees: f64| goal + JointDelta::from_degrees([degrees, 0.0, 0.0, 0.0, 0.0, 0.0]);
    cell.ball.centre = wrist * Point3::new(0.0, 0.0, cell.arm.flange() + 0.45);
    cell.holder = None;
    cell.table = -1.0;
    let ball = cell.ball.centre;
    assert!(cell.sweep(&turned(-12.0), &turned(12.0)) > 0.0);
    assert!(cell.ball.centre != ball);
}
