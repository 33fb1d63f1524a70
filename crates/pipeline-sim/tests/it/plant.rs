//! The cell as a plant: errors, play, grasps, pushes and moving balls.

use nalgebra::{Point3, Vector3};
use pipeline_sim::{
    Ball, Cell, ErrorLevel, Errors, FeatureCamera, Grasp, SharedCell, SimulatedArm, Workspace,
};
use puma_val2::{Gripper, JointDelta, Joints, Manipulator, ProximitySensor};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

fn at_goal() -> (Cell, Joints) {
    let cell = Cell::paper(Ball::at(0.62, 0.20, -0.10));
    let goal = cell.goal_pose(45.0).expect("within reach");
    (cell, goal)
}

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
        let axis = off.params.wrist(&grip) * Vector3::z();
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
        let level = off.params.wrist(&grip) * Vector3::x();
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
            .params
            .wrist(&grip)
            .inverse_transform_point(&off.ball.centre);
        let miss = ball.x.hypot(ball.z - off.params.d6 - off.hand.tool);
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
        let reach = aside.params.d6 + aside.hand.tool - 0.02;
        let finger = Point3::new(0.0, aside.hand.half_opening, reach);
        aside.ball.centre = aside.params.wrist(&there) * finger + Vector3::new(0.01, 0.0, 0.0);
        assert!(aside.sweep(&there, &there) > 0.005);
        assert_eq!(aside.holder, Some(holder), "the holder stays where it is");
    }
    // With another ball than one believes the holder still carries it.
    let bigger = Errors {
        radius_factor: 1.2,
        ..Errors::none()
    };
    let wrong = bigger.apply(&at_goal().0).expect("sound errors");
    assert!(wrong.holder.expect("on a holder").carries(&wrong.ball));
}

#[test]
fn impossible_play_and_encoders_are_refused_by_name() {
    let start = Workspace::paper().search_poses()[2];
    let arm =
        |errors: Errors| SimulatedArm::with_errors(SharedCell::new(at_goal().0), start, &errors);
    for bad in [f64::INFINITY, f64::NAN, -0.001, 4.0] {
        let mut errors = Errors::none();
        errors.encoder_step[3] = bad;
        let refused = arm(errors).expect_err("no such encoder").to_string();
        assert!(refused.contains("the encoder step of JT4"), "{refused}");
        let errors = Errors {
            backlash: bad,
            ..Errors::none()
        };
        let refused = arm(errors).expect_err("no such gear").to_string();
        assert!(refused.contains("the backlash"), "{refused}");
    }
}

#[test]
fn impossible_workspace_is_refused_and_has_no_balls() {
    let (cell, _) = at_goal();
    let paper = Workspace::paper();
    assert_eq!(paper.check(), Ok(()));
    let nan = f64::NAN;
    for (broken, name) in [
        (
            Workspace {
                rho: (0.8, 0.5),
                ..paper
            },
            "distance",
        ),
        (
            Workspace {
                rho: (-0.5, 0.5),
                ..paper
            },
            "distance",
        ),
        (
            Workspace {
                azimuth: (0.0, f64::INFINITY),
                ..paper
            },
            "azimuth",
        ),
        (
            Workspace {
                height: (nan, 0.0),
                ..paper
            },
            "height",
        ),
        (
            Workspace {
                search_elbow: (nan, 0.0),
                ..paper
            },
            "search poses",
        ),
    ] {
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
fn reported_and_real_joints_differ_by_play_and_counts() {
    let errors = Errors {
        backlash: 0.2_f64.to_radians(),
        ..ErrorLevel::Moderate.draw(&mut rng(1))
    };
    let start = Workspace::paper().search_poses()[2];
    let mut arm = SimulatedArm::with_errors(SharedCell::new(at_goal().0), start, &errors)
        .expect("within limits");
    let mut pose = arm.pose();
    let step = |arm: &mut SimulatedArm, degrees: f64| {
        let delta = JointDelta::from_degrees([0.0, degrees, 0.0, 0.0, 0.0, 0.0]);
        arm.move_by(delta).expect("within limits").degrees()[1]
    };
    let up = step(&mut arm, 2.0);
    let behind = up - pose().degrees()[1];
    assert!(
        (behind - 0.1).abs() < 0.005,
        "the links hang back by half the play: {behind}"
    );
    let back = step(&mut arm, -0.15);
    assert!(
        (pose().degrees()[1] - (up - behind)).abs() < 1e-9,
        "inside the play nothing moves"
    );
    let counts = back / Errors::PUMA_ENCODER_DEGREES[1];
    assert!(
        (counts - counts.round()).abs() < 1e-6,
        "whole counts: {counts}"
    );
}

fn rng(seed: u64) -> Xoshiro256PlusPlus {
    Xoshiro256PlusPlus::seed_from_u64(seed)
}

#[test]
fn error_levels_are_drawn_from_a_seed_and_make_the_cell_wrong() {
    let (cell, goal) = at_goal();
    for level in ErrorLevel::ALL {
        assert_eq!(level.draw(&mut rng(3)), level.draw(&mut rng(3)));
        assert_eq!(level.to_string().parse::<ErrorLevel>(), Ok(level));
        let mut worst: f64 = 0.0;
        for seed in 0..20 {
            let wrong = level
                .draw(&mut rng(seed))
                .apply(&cell)
                .expect("sound errors");
            if let Ok(f) = wrong.features(&goal) {
                worst = worst
                    .max((f.x - 103.5).hypot(f.y - 78.0))
                    .max((f.r - 33.0).abs());
            }
        }
        match level {
            ErrorLevel::None => assert!(worst < 0.2),
            _ => assert!(worst > 5.0, "{level}: {worst}"),
        }
    }
    assert!("severe".parse::<ErrorLevel>().is_err());
    assert!(
        Errors {
            focal_factor: 0.0,
            ..Errors::none()
        }
        .apply(&cell)
        .is_err()
    );
    assert!(
        Errors {
            radius_factor: -1.0,
            ..Errors::none()
        }
        .apply(&cell)
        .is_err()
    );
    assert!(
        Errors {
            yaw: f64::NAN,
            ..Errors::none()
        }
        .apply(&cell)
        .is_err()
    );
}

#[test]
fn feature_camera_adds_noise_to_the_cells_features() {
    let (cell, goal) = at_goal();
    let shared = SharedCell::new(cell);
    let arm = SimulatedArm::new(shared.clone(), goal).expect("within limits");
    let mut exact = FeatureCamera::new(shared.clone(), arm.pose(), 0.0, 1).expect("no noise");
    assert_eq!(exact.look(), cell.features(&goal).ok());
    let mut noisy = FeatureCamera::new(shared, arm.pose(), 0.5, 1).expect("noise");
    let spread = (0..2000)
        .map(|_| (noisy.look().expect("in sight").r - 33.0).powi(2))
        .sum::<f64>()
        / 2000.0;
    assert!((spread.sqrt() - 0.5).abs() < 0.05, "{spread}");
}

#[test]
fn errors_of_the_mount_are_named() {
    type Spoil = fn(&mut Errors);
    let (cell, _) = at_goal();
    let spoil: [(&str, Spoil); 6] = [
        ("roll", |e| e.roll = f64::NAN),
        ("pitch", |e| e.pitch = f64::INFINITY),
        ("yaw", |e| e.yaw = f64::NAN),
        ("along its x axis", |e| e.camera_shift[0] = f64::NAN),
        ("along its y axis", |e| e.camera_shift[1] = f64::NAN),
        ("along its z axis", |e| {
            e.camera_shift[2] = f64::NEG_INFINITY;
        }),
    ];
    for (named, spoil) in spoil {
        let mut errors = Errors::none();
        spoil(&mut errors);
        let refused = errors.apply(&cell).expect_err("not finite").to_string();
        assert!(refused.contains(named), "{named}: {refused}");
    }
}

#[test]
fn long_hand_meets_the_ball_on_its_way() {
    // Fingers half a metre long: they reach the ball where the wrist stays far from it.
    let mut cell = Cell::paper(Ball::at(0.6, 0.1, -0.1));
    let goal = cell
        .goal_pose(Cell::REACHING_JT5_DEGREES)
        .expect("within reach");
    cell.hand.tool = 0.5;
    let wrist = cell.params.wrist(&goal);
    let turned = |degrees: f64| goal + JointDelta::from_degrees([degrees, 0.0, 0.0, 0.0, 0.0, 0.0]);
    cell.ball.centre = wrist * Point3::new(0.0, 0.0, cell.params.d6 + 0.45);
    cell.holder = None;
    cell.table = -1.0;
    let ball = cell.ball.centre;
    assert!(cell.sweep(&turned(-12.0), &turned(12.0)) > 0.0);
    assert!(cell.ball.centre != ball);
}

#[test]
fn noise_that_is_not_a_finite_amount_is_refused_by_name() {
    let (cell, goal) = at_goal();
    let shared = SharedCell::new(cell);
    for noise in [-1.0, f64::NAN, f64::INFINITY] {
        let camera = FeatureCamera::new(shared.clone(), || goal, noise, 1).expect_err("no noise");
        let samples = cell
            .sample_moves(5, noise, &mut rng(1))
            .expect_err("no noise");
        assert_eq!(camera.to_string(), samples.to_string());
        assert!(camera.to_string().contains("noise"), "{camera}");
    }
    let refused = cell
        .sample_moves(usize::MAX, 0.1, &mut rng(1))
        .expect_err("too many");
    assert!(refused.to_string().contains("at most"), "{refused}");
    let (centering, reaching) = cell.sample_moves(5, 0.5, &mut rng(1)).expect("sound");
    assert_eq!((centering.len(), reaching.len()), (5, 5));
}
