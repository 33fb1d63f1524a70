//! The errors of a cell: the four levels, and the odd ones.

use hough_heuristic::image::{GrayImage, imageops};
use hough_heuristic::{Features, FrameSource};
use pipeline_sim::{
    Cell, CellCamera, ErrorLevel, Errors, FeatureCamera, QuantityError, Renderer, Round, Scene,
    SharedCell, SimulatedArm, Workspace,
};
use puma_val2::{JointDelta, Joints, Manipulator};

use crate::{at_goal, rng};

fn shared(errors: &Errors) -> SharedCell {
    let shared = SharedCell::new(errors.apply(&at_goal().0).expect("sound errors"));
    shared.set_errors(errors).expect("sound errors");
    shared
}

fn odd(name: &str) -> Errors {
    Errors::none().with_odd(name).expect("a known error")
}

#[test]
fn levels_are_drawn_from_a_seed_and_make_the_cell_wrong() {
    let (cell, goal) = at_goal();
    for level in ErrorLevel::ALL {
        assert_eq!(level.draw(&mut rng(3)), level.draw(&mut rng(3)));
        assert_eq!(level.to_string().parse::<ErrorLevel>(), Ok(level));
        let off = |seed| {
            let wrong = level.draw(&mut rng(seed)).apply(&cell).expect("sound");
            let seen = wrong.features(&goal).ok();
            assert!(wrong.holder.expect("on a holder").carries(&wrong.ball));
            seen.map_or(0.0, |f| {
                (f.x - 103.5).hypot(f.y - 78.0).max((f.r - 33.0).abs())
            })
        };
        let worst = (0..20).map(off).fold(0.0, f64::max);
        let expected = if level == ErrorLevel::None {
            0.0..0.2
        } else {
            5.0..200.0
        };
        assert!(expected.contains(&worst), "{level}: {worst}");
    }
    assert!("severe".parse::<ErrorLevel>().is_err());
}

#[test]
fn impossible_errors_are_refused_by_name() {
    type Spoil = fn(&mut Errors);
    let spoil: [(&str, Spoil); 19] = [
        ("focal factor", |e| e.focal_factor = 0.0),
        ("radius of the ball", |e| e.radius_factor = -1.0),
        ("roll", |e| e.roll = f64::NAN),
        ("pitch", |e| e.pitch = f64::INFINITY),
        ("yaw", |e| e.yaw = f64::NAN),
        ("along its x axis", |e| e.camera_shift[0] = f64::NAN),
        ("along its z axis", |e| {
            e.camera_shift[2] = f64::NEG_INFINITY;
        }),
        ("folds", |e| e.distortion.k1 = -3.0),
        ("forearm", |e| e.link_shift[1] = f64::NAN),
        ("zero (rad) of JT3", |e| e.joint_zero[2] = f64::NAN),
        ("gear of JT2", |e| e.gear[1] = 0.0),
        ("drag of JT3", |e| e.drag[1] = f64::INFINITY),
        ("encoder step (rad) of JT4", |e| e.encoder_step[3] = -0.001),
        ("backlash", |e| e.backlash = 4.0),
        ("stiction", |e| e.stiction = f64::NAN),
        ("noise", |e| e.feature_noise = -1.0),
        ("lag", |e| e.lag = usize::MAX),
        ("missed looks", |e| e.missed = -0.1),
        ("missed looks and outliers", |e| {
            (e.missed, e.outliers) = (0.6, 0.6);
        }),
    ];
    for (named, spoil) in spoil {
        let mut errors = Errors::none();
        spoil(&mut errors);
        let refused = errors.apply(&at_goal().0).expect_err(named).to_string();
        assert!(refused.contains(named), "{named}: {refused}");
    }
    let unknown = Errors::none().with_odd("gremlins").expect_err("unknown");
    assert!(matches!(unknown, QuantityError::Name { .. }) && unknown.to_string().contains("sag"));
    for bad in [
        "zeros=",
        "zeros=many",
        "missed=140",
        "stiction=-1",
        "gears=-100",
    ] {
        assert!(Errors::none().with_odd(bad).is_err(), "{bad}");
    }
    let samples = at_goal().0.sample_moves(5, f64::NAN, &mut rng(1));
    assert!(samples.expect_err("no noise").to_string().contains("noise"));
}

/// Angles that an arm reports after each of some moves, and those of its links.
fn moved(errors: &Errors) -> (Vec<Joints>, Vec<Joints>) {
    let start = Workspace::paper().search_poses()[2];
    let mut arm = SimulatedArm::new(shared(errors), start).expect("within limits");
    let mut pose = arm.pose();
    let moves = [4.0, -3.0, 0.3, 0.1, -2.0];
    let moves = moves.map(|d| JointDelta::from_degrees([d, 0.5 * d, d, 0.0, 0.0, 0.0]));
    let step = |delta| (arm.move_by(delta).expect("within limits"), pose());
    moves.into_iter().map(step).unzip()
}

/// Features that a camera sees from links that stand at given angles.
fn looked(errors: &Errors) -> Vec<Option<Features>> {
    let (_, goal) = at_goal();
    let mut turn = 0.0;
    let pose = move || {
        turn += 0.5;
        goal + JointDelta::from_degrees([turn, 0.0, 0.0, 0.0, 0.0, 0.0])
    };
    let mut camera = FeatureCamera::new(shared(errors), pose, 7);
    (0..40).map(|_| camera.look()).collect()
}

#[test]
fn odd_errors_show_in_one_thing_and_in_nothing_else() {
    let true_moves = moved(&Errors::none());
    let true_looks = looked(&Errors::none());
    for (name, _) in Errors::ODD {
        let errors = odd(name);
        let ((reported, links), looks) = (moved(&errors), looked(&errors));
        let shows = (
            reported != true_moves.0,
            links != true_moves.1,
            looks != true_looks,
        );
        let expected = match name {
            "zeros" | "gears" | "sag" | "drag" | "back-drag" | "dead-zone" | "play" => {
                (false, true, false)
            }
            "stiction" => (true, true, false),
            // Not before it slips.
            "slip" => (false, false, false),
            _ => (false, false, true),
        };
        assert_eq!(shows, expected, "{name}");
        if name != "slip" {
            assert_eq!(odd(&format!("{name}=0")), Errors::none(), "{name}");
        }
    }
}

#[test]
fn odd_errors_of_the_arm_have_their_amounts() {
    let adjusted = Joints::from_degrees([0.0, -85.0, 167.5, 0.0, 45.0, 0.0]);
    let links = |name, turns: [f64; 3]| {
        let [a, b, c] = turns;
        let read = adjusted + JointDelta::from_degrees([a, b, c, 0.0, 0.0, 0.0]);
        let off = shared(&odd(name)).links(&read).degrees();
        std::array::from_fn::<f64, 3, _>(|i| off[i] - read.degrees()[i])
    };
    for (name, turns, expected) in [
        ("zeros=2", [5.0, 5.0, 5.0], [0.0, 2.0, 2.0]),
        ("gears=3", [5.0, 10.0, -20.0], [0.0, 0.3, -0.6]),
        ("drag=10", [0.0, 0.0, 30.0], [0.0, 3.0, 0.0]),
        ("back-drag=10", [0.0, -30.0, 0.0], [0.0, 0.0, -3.0]),
        ("sag=4", [0.0, 25.0, 0.0], [0.0, 2.0, 0.0]),
    ] {
        let off = links(name, turns);
        let close = off.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(close, "{name}: {off:?}");
    }
    // What sticks is reported, what stays in its dead zone is not; both give way to a longer move.
    for (name, reports) in [("stiction=0.5", [0.0, 0.8]), ("dead-zone=0.5", [0.4, 0.8])] {
        let mut arm = SimulatedArm::new(shared(&odd(name)), adjusted).expect("within limits");
        let mut pose = arm.pose();
        let mut step = |degrees: f64| {
            let target = adjusted + JointDelta::from_degrees([degrees, 0.0, 0.0, 0.0, 0.0, 0.0]);
            let reported = arm.move_to(target).expect("within limits");
            (reported.degrees()[0], pose().degrees()[0])
        };
        let near = |(a, b): (f64, f64), (c, d): (f64, f64)| (a - c).hypot(b - d) < 1e-9;
        assert!(near(step(0.4), (reports[0], 0.0)), "{name}");
        assert!(near(step(0.8), (reports[1], 0.8)), "{name}");
    }
    // Half of the play on either side, and whole counts of the encoders.
    let counts = Errors {
        encoder_step: Errors::PUMA_ENCODER_DEGREES.map(f64::to_radians),
        ..odd("play=0.2")
    };
    let mut arm = SimulatedArm::new(shared(&counts), adjusted).expect("within limits");
    let mut pose = arm.pose();
    let delta = |degrees| JointDelta::from_degrees([0.0, degrees, 0.0, 0.0, 0.0, 0.0]);
    let up = arm.move_by(delta(2.0)).expect("within limits").degrees()[1];
    assert!((up - pose().degrees()[1] - 0.1).abs() < 1e-9);
    let stands = pose();
    let back = arm.move_by(delta(-0.15)).expect("within limits").degrees()[1];
    assert_eq!(pose(), stands, "inside the play nothing moves");
    let count = back / Errors::PUMA_ENCODER_DEGREES[1];
    assert!((count - count.round()).abs() < 1e-6, "{count}");
}

#[test]
fn odd_errors_of_the_image_have_their_amounts() {
    let plain = looked(&Errors::none());
    let late = looked(&odd("lag=2"));
    assert_eq!(
        (&late[..3], &late[3..]),
        (&[plain[0]; 3][..], &plain[1..38])
    );
    for (mirrored, seen) in looked(&odd("mirrored")).iter().zip(&plain) {
        let x = mirrored.map(|f| Features {
            x: 192.0 - f.x,
            ..f
        });
        assert_eq!(x.map(|f| f.y), seen.map(|f| f.y));
        assert!(x.zip(*seen).is_none_or(|(a, b)| (a.x - b.x).abs() < 1e-9));
    }
    let (_, goal) = at_goal();
    let looks = |name: &str| {
        let mut camera = FeatureCamera::new(shared(&odd(name)), || goal, 1);
        (0..2000).map(|_| camera.look()).collect::<Vec<_>>()
    };
    let missed = looks("missed=20").iter().filter(|f| f.is_none()).count();
    assert!((340..460).contains(&missed), "{missed}");
    let outliers = looks("outliers=5");
    let outliers = outliers
        .iter()
        .flatten()
        .filter(|f| (f.r - 33.0).abs() > 1e-3)
        .count();
    assert!((65..140).contains(&outliers), "{outliers}");
    let noisy = looks("noise=0.5");
    let spread: f64 = noisy.iter().flatten().map(|f| (f.r - 33.0).powi(2)).sum();
    assert!(((spread / 2000.0).sqrt() - 0.5).abs() < 0.05, "{spread}");
}

#[test]
fn slipped_camera_stands_and_looks_elsewhere() {
    let (cell, goal) = at_goal();
    let mut slipped = cell;
    odd("slip=8").slip_camera(&mut slipped);
    let by = slipped.mount.translation.vector - cell.mount.translation.vector;
    assert!((by.norm() - 0.010).abs() < 1e-12);
    let turn = slipped.mount.rotation.angle_to(&cell.mount.rotation);
    assert!((turn.to_degrees() - 8.0).abs() < 1e-9);
    assert!(slipped.features(&goal) != cell.features(&goal));
    assert_eq!(
        Cell {
            mount: cell.mount,
            ..slipped
        },
        cell
    );
}

#[test]
fn odd_errors_of_the_image_show_in_frames() {
    let pose = Workspace::paper().search_poses()[3];
    let scene = Scene::plain();
    let frames = |name: &str| -> Vec<GrayImage> {
        let renderer = Renderer::new(&scene, 5);
        let turn = std::cell::Cell::new(0.0);
        let moving = || {
            turn.set(turn.get() + 1.0);
            pose + JointDelta::from_degrees([turn.get(), 0.0, 0.0, 0.0, 0.0, 0.0])
        };
        let mut camera = CellCamera::new(shared(&odd(name)), renderer, moving);
        let mut grab = || {
            let mut frame = GrayImage::default();
            camera.grab(&mut frame).expect("a frame");
            frame
        };
        (0..3).map(|_| grab()).collect()
    };
    let plain = frames("zeros");
    assert!(frames("lag=1") == [&plain[0], &plain[0], &plain[1]].map(Clone::clone));
    let mirrored = frames("mirrored");
    assert!(imageops::flip_horizontal(&mirrored[2]) == plain[2]);
    // Without the ball, and with the ball in other places.
    let (gone, elsewhere) = (frames("missed=100"), frames("outliers=100"));
    let changed = |a: &GrayImage, b: &GrayImage| {
        a.iter()
            .zip(b.iter())
            .filter(|(p, q)| p.abs_diff(**q) > 40)
            .count()
    };
    let renderer = Renderer::new(&scene, 5);
    let cell = at_goal().0;
    for k in 0..3 {
        let turned = JointDelta::from_degrees([k as f64 + 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let truth = renderer.truth(&cell, &(pose + turned));
        assert_eq!(truth[0].what, Round::Target);
        assert!(changed(&gone[k], &plain[k]) > 500, "{k}");
        assert!(changed(&elsewhere[k], &plain[k]) > 500, "{k}");
        assert!(changed(&elsewhere[k], &gone[k]) > 300, "{k}");
    }
}
