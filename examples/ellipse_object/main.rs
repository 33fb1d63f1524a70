//! Another object: an egg, found as an ellipse, reached by behaviours learned for a ball, and
//! gripped across.
//!
//! "It is possible to extend the grasping behavior to objects of different shapes, characterizing
//! them uniquely, simply by considering a different set of features of the images" (section 2.1 of
//! the paper).
//!
//! ```text
//! cargo run --release --example ellipse_object -- --help
//! ```

use std::cell::Cell;
use std::path::PathBuf;
use std::rc::Rc;

use clap::Parser;
use grasp_agent::{
    Agent, AgentConfig, BehaviourPair, CameraEye, EggTarget, EventKind, SavedRun, Sighting, Target,
};
use hough_heuristic::image::GrayImage;
use hough_heuristic::{Canny, CannyConfig, CurveSearch, CurveSearchConfig, Ellipse, FrameError};
use nalgebra::Vector3;
use pipeline_sim::{MoveForm, Scene, Workspace};
use puma_grasp::{Rig, RigParts};
use puma_val2::{Joints, PumaParams};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

use detour::Detour;
use egg::{Egg, EggCamera};
use example_support::learning::{learn_both, simulators};
use example_support::overlay::Overlay;
use example_support::prelude::*;
use example_support::trial::ball_in_view;

mod detour;
mod egg;

/// Finds, reaches and grips eggs through rendered frames, ellipse detection and VAL II.
///
/// The behaviours are learned for a ball as thick as the egg; the controller is given the shorter
/// half-axis of the egg's outline for the radius. For the grip the hand turns so that the jaws
/// close across the egg.
///
/// The camera shows an egg, but the hand touches and holds the ball of 40 mm inside it. Success
/// therefore also requires that the jaws close across the egg. Failed runs are kept in the folder
/// for the example replay.
#[derive(Parser, Debug)]
struct Options {
    /// Folder for a picture of the last view of each egg
    #[arg(long, value_name = "DIR", default_value = "out/egg")]
    out: PathBuf,
    /// Seed of all random draws
    #[arg(long, value_name = "N", default_value_t = 2000)]
    seed: u64,
    /// Number of eggs
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = at_least_one)]
    runs: usize,
    /// Length of the egg, millimetres; its thickness is 40
    #[arg(long, value_name = "MM", default_value_t = 56.0, value_parser = length)]
    length: f64,
}

fn length(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(length) if (40.0..=80.0).contains(&length) => Ok(length),
        _ => Err("a length of 40 to 80 mm is needed".into()),
    }
}

/// Largest angle of the jaws from straight across the egg, degrees.
const ACROSS_TOLERANCE: f64 = 20.0;

fn main() -> ExitCode {
    start(run)
}

fn run(options: &Options) -> Outcome {
    let _lock = lock_folder(&options.out)?;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(options.seed);
    let scene = Scene::bright_ball();
    let mut rig = Rig::emulated(false, &scene, options.seed, &STOP)?;
    let mut features = Watched {
        features: egg_features(options.seed)?,
        outline: Rc::default(),
    };
    let config = AgentConfig {
        grip_across: true,
        ..AgentConfig::paper(Workspace::paper().search_poses())
    };
    let [simulator] = simulators(&rig.cell().get(), [MoveForm::Rigid22], &mut rng)?;
    let pair = BehaviourPair::paper_mended();
    let learned = learn_both(&simulator, pair, options.seed, &mut rng)?;
    let agent = Agent::with_controller(config, learned)?;

    let run_file = |run: usize| options.out.join(format!("egg{run:03}.json"));
    let (mut made, mut gripped, mut moves) = (0, 0, 0);
    // The results until a fault are kept.
    let mut done = Ok(());
    say!(" run  moves  lost  final x, y, shorter half-axis   miss (mm)  off across (deg)  result");
    let bar = progress_bar(options.runs as u64, "eggs", false);
    for run in 1..=options.runs {
        done = go_on();
        if done.is_err() {
            break;
        }
        let place = ball_in_view(rig.cell(), &mut rng)?;
        let egg = Egg {
            half_length: 0.5e-3 * options.length,
            heading: rng.random_range(0.0..std::f64::consts::PI),
        };
        rig.place(&place)?;
        let (cell, pose) = (rig.cell().clone(), rig.pose());
        let RigParts {
            camera,
            arm,
            mut sensor,
        } = rig.parts();
        let mut camera = EggCamera {
            frames: camera,
            cell: cell.clone(),
            pose: Box::new(pose),
            egg,
            scene: scene.clone(),
            noise: Xoshiro256PlusPlus::seed_from_u64(rng.random()),
        };
        // The last view of the egg; and, when the jaws closed, their distance from the ball's
        // centre, metres, and their angle from straight across, degrees.
        let (mut last, mut closed) = (None, None);
        let outline = Rc::clone(&features.outline);
        let mut eye = CameraEye::looking_for(&mut camera, &mut features);
        let params = PumaParams::unimation();
        let mut saved = SavedRun::before(&agent);
        let mut arm = Detour { arm, params };
        let end = agent.run(&mut eye, &mut arm, &mut *sensor, &mut |event| {
            saved.note(event);
            match (&event.kind, event.frame, outline.get()) {
                (EventKind::Seen(_), Some(frame), Some(ellipse)) if closed.is_none() => {
                    last = Some((frame.clone(), ellipse));
                }
                (EventKind::Gripping(_), ..) => {
                    let miss = cell.with(|cell| cell.grip_miss(&event.joints));
                    closed = Some((miss, off_across(&cell.get(), &event.joints, &egg)));
                }
                (EventKind::Missed, ..) => closed = None,
                _ => {}
            }
        });
        // The camera borrows the rig until here.
        drop(eye);
        drop(camera);
        let outcome = match end {
            Ok(outcome) => outcome,
            Err(error) => {
                let kept = keep_run(&run_file(run), &saved)?;
                done = Err(format!("run {run} was broken off: {error}; {kept}").into());
                break;
            }
        };
        made += 1;
        let round = options.length < 44.0;
        let across = closed.is_some_and(|(_, off)| round || off <= ACROSS_TOLERANCE);
        let held = outcome.gave_up.is_none() && rig.holds_ball() && across;
        gripped += usize::from(held);
        moves += if held { outcome.cycles } else { 0 };
        let seen = outcome.last_seen.map_or("-".into(), |sighting| {
            let f = sighting.features;
            format!("{:6.1} {:6.1} {:6.1}", f.x, f.y, f.r)
        });
        let result = match outcome.gave_up {
            Some(reason) => format!("not gripped: {reason}"),
            None if held => "gripped".into(),
            None => "not gripped: the jaws closed beside or along it".into(),
        };
        let [miss, off] = closed.map_or(["-".into(), "-".into()], |(miss, off)| {
            [1e3 * miss, off].map(|value| format!("{value:.1}"))
        });
        let (cycles, losses) = (outcome.cycles, outcome.losses);
        bar.suspend(|| {
            say!("{run:4}  {cycles:5}  {losses:4}  {seen:<32} {miss:>9}  {off:>16}  {result}");
        });
        bar.inc(1);
        if !held {
            let kept = keep_run(&run_file(run), &saved)?;
            bar.suspend(|| say!("      {kept}"));
        }
        if let Some((frame, ellipse)) = last {
            let mut overlay = Overlay::new(&frame);
            overlay.closed(|angle| {
                let (sin, cos) = ellipse.angle.sin_cos();
                let (u, v) = (ellipse.major * angle.cos(), ellipse.minor * angle.sin());
                (ellipse.x + cos * u - sin * v, ellipse.y + sin * u + cos * v)
            });
            let picture = options.out.join(format!("egg{run:03}.png"));
            let seen = seen.trim();
            let words = format!("egg {run} move {cycles}  x, y, shorter half-axis: {seen}");
            write_png(&picture, &overlay.captioned(&words))?;
        }
    }
    bar.finish_and_clear();
    say!(
        "\n{gripped} of {made} gripped ({:.1} %), {:.1} moves on average; pictures: {}",
        100.0 * gripped as f64 / made.max(1) as f64,
        moves as f64 / gripped.max(1) as f64,
        options.out.display()
    );
    done
}

/// Builds a detector of ellipses among the edges of the frame.
fn egg_features(seed: u64) -> Outcome<EggTarget> {
    let edges = Canny::new(CannyConfig {
        low: 20.0,
        high: 50.0,
        ..CannyConfig::default()
    })?;
    let search = CurveSearch::new(CurveSearchConfig {
        theta: 0.75,
        iterations: 200_000,
        tolerance: 1.0,
        max_curves: 1,
        reach: Some(150.0),
        seed,
    })?;
    Ok(EggTarget::new(edges, search, 20.0..=272.0, 2.2))
}

/// Features that share their ellipse.
struct Watched {
    features: EggTarget,
    outline: Rc<Cell<Option<Ellipse>>>,
}

impl Target for Watched {
    fn find(&mut self, frame: &GrayImage) -> Result<Option<Sighting>, FrameError> {
        let found = self.features.find(frame);
        self.outline.set(self.features.outline());
        found
    }
}

/// Returns the angle of the jaws from straight across the egg, degrees.
fn off_across(cell: &pipeline_sim::Cell, joints: &Joints, egg: &Egg) -> f64 {
    let along_the_jaws = cell.arm.wrist(joints).rotation * Vector3::y();
    let off = along_the_jaws.dot(&egg.axis()).abs().min(1.0).asin();
    off.to_degrees()
}
