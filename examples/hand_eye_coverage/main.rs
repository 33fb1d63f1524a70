//! Calibrates drawn cells by looks at a ball, and counts how often the truth lies within the 95 %
//! interval of each quantity.
//!
//! ```text
//! cargo run --release --example hand_eye_coverage -- --help
//! ```

use std::fs;
use std::path::PathBuf;

use clap::Parser;
use grasp_agent::nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use grasp_agent::{Calibration, CameraModel, HandEye};
use hough_heuristic::{Circle, Features};
use pipeline_sim::{Cell, ErrorLevel, Errors, FeatureCamera, SharedCell, SimulatedArm, Workspace};
use puma_val2::{Joint, JointDelta, Joints, Kinematics};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use serde_json::{Value, json};

use example_support::learning::{ArmName, believed};
use example_support::prelude::*;
use example_support::program::on_threads;
use example_support::trial::FeatureEye;

/// Calibrates camera, lens, ball and joint zeros of drawn cells by looks at a ball.
///
/// Joint zeros and lens are drawn within the given bounds, the rest by the level.
#[derive(Debug, Parser)]
struct Options {
    /// Arm: puma, ur5 or so101.
    #[arg(long, value_enum, default_value_t = ArmName::Puma)]
    arm: ArmName,
    /// Number of cells.
    #[arg(long, default_value_t = 200)]
    cells: usize,
    /// Errors of camera and ball: none, moderate, heavy or extreme.
    #[arg(long, default_value = "heavy")]
    level: ErrorLevel,
    /// Noise of the ball's features, units of 4 pixels.
    #[arg(long, default_value_t = 0.05)]
    noise: f64,
    /// Greatest zero of each joint, degrees.
    #[arg(long, default_value_t = 2.0)]
    zeros: f64,
    /// Greatest first radial term of the lens.
    #[arg(long, default_value_t = 0.2)]
    lens: f64,
    /// Play of the joints, degrees.
    #[arg(long, default_value_t = 0.0)]
    play: f64,
    /// Believe the encoders: estimate no zeros.
    #[arg(long)]
    no_zeros: bool,
    /// Number of looks.
    #[arg(long, default_value_t = 15)]
    looks: usize,
    /// Odd error that is added to each cell, such as links=5.
    #[arg(long)]
    odd: Vec<String>,
    /// Seed.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Write each cell, with poses before a board, as a line of JSON.
    #[arg(long)]
    cells_file: Option<PathBuf>,
}

/// Draws a ball that a search pose shows well, and places it there.
fn place_ball(
    shared: &SharedCell,
    workspace: &Workspace,
    rng: &mut Xoshiro256PlusPlus,
) -> Option<Joints> {
    let well =
        |f: &Features| (16.0..176.0).contains(&f.x) && (16.0..128.0).contains(&f.y) && f.r > 7.0;
    (0..10_000).find_map(|_| {
        let ball = workspace.sample_ball(rng);
        shared.with(|cell| cell.place_ball(ball.centre));
        let poses = workspace.search_poses();
        poses.into_iter().find(|pose| {
            let links = shared.links(pose);
            shared
                .with(|cell| cell.features(&links))
                .is_ok_and(|f| well(&f))
        })
    })
}

/// A cell as it is in truth, seen by an arm that does not know the zeros of its first and last
/// joint.
struct Truth {
    cell: Cell,
    errors: Errors,
    mount: Isometry3<f64>,
    ball: Point3<f64>,
}

fn main() -> ExitCode {
    start(run)
}

fn run(options: &Options) -> Outcome {
    let mut done = Vec::new();
    on_threads(None, options.cells, &mut done, |index| one(options, index))?;
    let cells: Vec<_> = done.into_iter().flatten().collect();
    say!("{} of {} cells calibrated", cells.len(), options.cells);
    if let Some(file) = &options.cells_file {
        let lines: String = cells.iter().map(|(_, json)| format!("{json}\n")).collect();
        fs::write(file, lines)?;
    }
    let Some((first, _)) = cells.first() else {
        return Err("no cell was calibrated".into());
    };
    say!(
        "{:<34} {:>8} {:>10} {:>10} {:>6}",
        "quantity",
        "within",
        "median off",
        "median se",
        "rms z"
    );
    for (i, (name, ..)) in first.iter().enumerate() {
        let all: Vec<(f64, f64)> = cells.iter().map(|(of, _)| (of[i].1, of[i].2)).collect();
        let count = all.len() as f64;
        let within = all.iter().filter(|(off, se)| off.abs() < 1.96 * se).count() as f64 / count;
        let squares: f64 = all.iter().map(|(off, se)| (off / se).powi(2)).sum();
        let median = |of: fn(&(f64, f64)) -> f64| {
            let mut sizes: Vec<f64> = all.iter().map(of).collect();
            sizes.sort_by(f64::total_cmp);
            sizes[sizes.len() / 2]
        };
        say!(
            "{name:<34} {:>6.1} % {:>10.4} {:>10.4} {:>6.2}",
            100.0 * within,
            median(|(off, _)| off.abs()),
            median(|(_, se)| *se),
            (squares / count).sqrt()
        );
    }
    Ok(())
}

/// Name, error and standard error of each quantity.
type Offs = Vec<(String, f64, f64)>;

/// Draws and calibrates one cell; `None`, with a line on the terminal, if that fails.
fn one(options: &Options, index: usize) -> Outcome<Option<(Offs, Value)>> {
    let rng =
        &mut Xoshiro256PlusPlus::seed_from_u64(options.seed.wrapping_add(1000 * index as u64));
    let mut errors = options.level.draw(rng);
    for odd in &options.odd {
        errors = errors.with_odd(odd)?;
    }
    let zero = options.zeros.to_radians();
    errors.joint_zero = std::array::from_fn(|_| zero * rng.random_range(-1.0..=1.0));
    errors.distortion.k1 = options.lens * rng.random_range(-1.0..=1.0);
    (errors.feature_noise, errors.backlash) = (options.noise, options.play.to_radians());
    let (meant, workspace) = options.arm.cell();
    let nominal = believed(&meant);
    let shared = SharedCell::new(errors.apply(&meant)?);
    shared.set_errors(&errors)?;
    let pose = place_ball(&shared, &workspace, rng).ok_or("no ball in view")?;
    let cell = shared.get();
    let mut arm = SimulatedArm::new(shared.clone(), pose)?;
    let mut camera = FeatureCamera::new(shared.clone(), arm.pose(), rng.random());
    let mut eye = FeatureEye(|| camera.look());
    let task = HandEye {
        looks: options.looks,
        zeros: !options.no_zeros,
        seed: index as u64,
        ..HandEye::new(nominal)
    };
    let mut free = |joints: &Joints| shared.with(|cell| !cell.proximity(joints));
    let found = match task.calibrate(&mut eye, &mut arm, &mut free) {
        Ok(found) => found,
        Err(error) => {
            say!("cell {index}: {error}");
            return Ok(None);
        }
    };
    if options.cells == 1 {
        say!("{found}\n");
    }
    let truth = truth(cell, errors, &nominal);
    let offs = offs(&truth, &found);
    let board = board(&truth, &nominal, &pose, rng);
    let (turn, place) = apart(&truth.mount, &found.model.mount);
    let px = f64::from(cell.camera.size().0) / Features::WIDTH;
    let json = json!({
        "focal": cell.camera.focal_px(),
        "principal": cell.camera.principal_point(),
        "k1": errors.distortion.k1,
        "mount": truth.mount.to_homogeneous().transpose(),
        "ours": {
            "turn": turn.to_degrees(),
            "place": 1000.0 * place,
            "focal": 100.0 * (found.model.focal * px / cell.camera.focal_px() - 1.0).abs(),
            "k1": (found.distortion - errors.distortion.k1).abs(),
        },
        "board": board,
    });
    Ok(Some((offs, json)))
}

/// Returns the truth as it shows to an arm that believes the zeros of its first and last joint.
fn truth(cell: Cell, errors: Errors, nominal: &CameraModel) -> Truth {
    // The link lies at the near side of the play when the joint comes from below.
    let zero = |joint: Joint| errors.joint_zero[joint.index()] - 0.5 * errors.backlash;
    let here = Joints::default();
    let last = here + JointDelta::of(Joint::J6, zero(Joint::J6));
    let turned = nominal.arm.wrist(&here).inverse() * nominal.arm.wrist(&last);
    let base = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -zero(Joint::J1));
    Truth {
        cell,
        errors,
        mount: turned * cell.mount,
        ball: base * cell.ball.centre,
    }
}

/// Returns the angle and the distance between two mounts.
fn apart(truth: &Isometry3<f64>, found: &Isometry3<f64>) -> (f64, f64) {
    let off = found.inverse() * truth;
    (off.rotation.angle(), off.translation.vector.norm())
}

/// Returns the errors of a calibration in the order and the units of its estimates.
fn offs(truth: &Truth, found: &Calibration) -> Offs {
    let Truth { cell, errors, .. } = truth;
    let (width, model) = (cell.camera.size().0, &found.model);
    let axis = cell.camera.principal_point();
    let circle = Circle {
        x: axis.x,
        y: axis.y,
        radius: cell.camera.focal_px(),
    };
    let axis = Features::from_circle(&circle, width);
    let turn = (model.mount.rotation.inverse() * truth.mount.rotation).scaled_axis();
    let shift = truth.mount.translation.vector - model.mount.translation.vector;
    let ball = truth.ball - found.ball;
    let mut offs: Vec<f64> = turn.iter().map(|turn| turn.to_degrees()).collect();
    offs.extend(shift.iter().map(|shift| 1000.0 * shift));
    offs.extend([
        axis.r - model.focal,
        axis.x - model.centre[0],
        axis.y - model.centre[1],
    ]);
    offs.push(errors.distortion.k1 - found.distortion);
    offs.push(1000.0 * (cell.ball.radius - model.ball_radius));
    offs.extend(ball.iter().map(|ball| 1000.0 * ball));
    let names = found.estimates.iter().map(|estimate| &estimate.name);
    let zeros = Joint::ALL.into_iter().filter(|joint| {
        let name = format!("zero of {} ", model.arm.names()[joint.index()]);
        names.clone().any(|known| known.starts_with(&name))
    });
    for joint in zeros {
        let zero = errors.joint_zero[joint.index()] - 0.5 * errors.backlash;
        offs.push((zero - found.zeros[joint]).to_degrees());
    }
    let of = |(estimate, off): (&grasp_agent::Estimate, f64)| {
        (estimate.name.clone(), off, estimate.error)
    };
    found.estimates.iter().zip(offs).map(of).collect()
}

/// Draws 30 poses that show a whole board of 8 by 6 corners, 15 mm apart, in the place of the ball
/// and turned toward the camera of the first look: the hand by the joints that the arm reports,
/// and the camera in truth.
fn board(
    truth: &Truth,
    nominal: &CameraModel,
    from: &Joints,
    rng: &mut Xoshiro256PlusPlus,
) -> Value {
    let Truth { cell, errors, .. } = truth;
    let shared = SharedCell::new(*cell);
    let set = shared.set_errors(errors);
    debug_assert!(set.is_ok(), "the cell has these errors already");
    let camera = |joints: &Joints| cell.camera_pose(&shared.links(joints));
    let facing = camera(from).rotation;
    let middle = Translation3::from(cell.ball.centre.coords) * facing;
    let board = middle * Translation3::new(-0.0525, -0.0375, 0.0);
    let corners: Vec<Point3<f64>> = (0..48)
        .map(|i| board * Point3::new(0.015 * f64::from(i % 8), 0.015 * f64::from(i / 8), 0.0))
        .collect();
    let (width, height) = cell.camera.size();
    let mut poses = Vec::new();
    for _ in 0..2_000_000 {
        let spread = [0.5, 0.5, 0.5, 1.0, 1.0, 1.0];
        let joints = Joints(std::array::from_fn(|i| {
            from.0[i] + spread[i] * rng.random_range(-1.0..1.0)
        }));
        let at = camera(&joints);
        let seen = |corner: &Point3<f64>| {
            let pixel = cell.camera.project(&at.inverse_transform_point(corner));
            pixel.is_some_and(|p| {
                (0.0..f64::from(width)).contains(&p.x) && (0.0..f64::from(height)).contains(&p.y)
            })
        };
        let tilt = (at.rotation * Vector3::z()).angle(&(facing * Vector3::z()));
        let near = (at.translation.vector - cell.ball.centre.coords).norm() < 0.6;
        if tilt < 0.9 && near && corners.iter().all(seen) {
            let hand = nominal.arm.wrist(&joints);
            poses.push(json!([
                hand.to_homogeneous().transpose(),
                at.to_homogeneous().transpose()
            ]));
            if poses.len() == 30 {
                break;
            }
        }
    }
    json!({ "board": board.to_homogeneous().transpose(), "poses": poses })
}
