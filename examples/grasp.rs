//! The main job: learn in simulation, then see, reach and grasp balls through VAL II.
//!
//! ```text
//! cargo run --release --example grasp -- --help
//! ```

#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a program for the terminal"
)]

use std::collections::BTreeMap;
use std::error::Error;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use grasp_agent::{Agent, AgentConfig, Behaviour, BehaviourSpec, Learned, Reward};
use hough_heuristic::{Canny, CannyConfig, CircleDetector, Heuristic, HeuristicConfig};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use pipeline_sim::{Ball, Cell, ReachForm, Scene, Shape, Workspace, sample_moves};
use puma_grasp::{Lesson, Rig, RigError, Simulator, learn};
use qtable::TrainReport;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{Rng, SeedableRng};

use files::{writable_folder, write_png, write_whole};
use options::{DetectorName, FormName, Options, RewardName};
use record::{Picture, RunRecord};
use results::{Summary, TrainingSummary};

mod files;
#[path = "grasp/options.rs"]
mod options;
mod overlay;
#[path = "grasp/plots.rs"]
mod plots;
#[path = "grasp/record.rs"]
mod record;
#[path = "grasp/results.rs"]
mod results;

/// Moves sampled in the cell for the regression.
const SAMPLES: usize = 2_500;
/// Standard deviation of the features in those samples, feature units.
const FEATURE_NOISE: f64 = 0.5;
/// Actions of training, centering and approaching.
const ACTIONS: (u64, u64) = (60_000, 500_000);
/// What choosing an action again in the same state costs at run time, in units of Q, centering and approaching. What was learned in
/// a regression simulator goes in circles on the arm more often than what was learned on the arm itself.
const KAPPA: (f64, f64) = (50.0, 20.0);
/// From the gripper to the ball's centre: the jaws close on the ball up to this far, metres.
const GRASP_TOLERANCE: f64 = 0.010;

fn main() -> ExitCode {
    match run(&Options::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options) -> Result<(), Box<dyn Error>> {
    // Whatever can be found wrong is found before the long work.
    writable_folder(&options.out)?;
    let mut detector = detector(options)?;
    let loaded = options
        .policy
        .as_ref()
        .map(|folder| Taught::load(folder, options.reward))
        .transpose()?;
    let mut rig = open_rig(options)?;
    say(
        options,
        &format!("connected to the VAL II controller on {}", rig.name()),
    );

    let mut rng = Xoshiro256PlusPlus::seed_from_u64(options.seed);
    let begin = Instant::now();
    let taught = match loaded {
        Some(taught) => taught,
        None => Taught::train(options, &rig.cell().get(), &mut rng)?,
    };
    let training = TrainingSummary {
        trained: taught.reports.is_some(),
        actions: taught
            .reports
            .iter()
            .map(|(centering, approaching)| centering.actions + approaching.actions)
            .sum(),
        seconds: begin.elapsed().as_secs_f64(),
        r2: taught.r2,
    };
    if let Some((centering, approaching)) = &taught.reports {
        let svg = plots::learning_curves(&[("centering", centering), ("approaching", approaching)])?;
        write_whole(&options.out.join("learning.svg"), svg.as_bytes())?;
    }

    let workspace = Workspace::paper();
    let config = AgentConfig::paper(workspace.search_poses());
    let learned = Learned::new(taught.centering, taught.approaching).with_kappa(KAPPA.0, KAPPA.1);
    let agent = Agent::with_controller(config, learned)?;
    let mut records = Vec::new();
    let mut pictures = Vec::new();
    // What has been done until a fault is worth keeping.
    let mut broken_off = None;
    let bar = progress_bar(options, options.runs as u64, "balls");
    for run in 1..=options.runs {
        let (ball, _) = workspace
            .sample_seen_ball(&rig.cell().get(), &mut rng)
            .ok_or("no place of the workspace is in view from a search pose")?;
        match reach_for(&agent, &mut rig, &mut *detector, &ball, run, &mut pictures) {
            Ok(record) => {
                bar.suspend(|| say(options, &one_line(run, &record)));
                records.push(record);
                bar.inc(1);
            }
            Err(error) => {
                broken_off = Some(format!("run {run} was broken off: {error}"));
                break;
            }
        }
    }
    bar.finish_and_clear();

    let summary = Summary::new(options.seed, training, &records);
    write_results(&options.out, &summary, &records, &pictures)?;
    print_out(&summary.table());
    say(options, &format!("results: {}", options.out.display()));
    broken_off.map_or(Ok(()), |reason| Err(reason.into()))
}

/// The arm: an emulated controller of our own, or one that is there already.
fn open_rig(options: &Options) -> Result<Rig, RigError> {
    let (scene, seed) = (scene(), options.seed);
    match (&options.port, &options.tcp) {
        (Some(path), _) => Rig::on_port(path, &scene, seed),
        (None, Some(address)) => Rig::on_socket(address, &scene, seed),
        (None, None) => Rig::emulated(options.realtime, &scene, seed),
    }
}

/// A bright ball over a dark wooden table with boxes and tape on it.
///
/// Nothing else in the scene is round: seen straight on, a disc on the table cannot be told from a ball by its outline.
fn scene() -> Scene {
    let mut scene = Scene::laboratory();
    scene.table.albedo = 0.20;
    scene.table.texture = 0.30;
    scene
        .things
        .retain(|thing| matches!(thing.shape, Shape::Box { .. } | Shape::Tape { .. }));
    for thing in &mut scene.things {
        thing.look.albedo *= 0.5;
    }
    scene
}

/// Two behaviours and how they came about.
struct Taught {
    centering: Behaviour,
    approaching: Behaviour,
    /// Learning curves, unless the behaviours were read from files.
    reports: Option<(TrainReport, TrainReport)>,
    r2: BTreeMap<String, f64>,
}

impl Taught {
    /// Samples the cell, fits the regression simulator, learns both behaviours in it, and saves them.
    fn train(options: &Options, cell: &Cell, rng: &mut dyn Rng) -> Result<Self, Box<dyn Error>> {
        say(options, &format!("sampling {SAMPLES} moves in the cell"));
        let (centring, reaching) = sample_moves(cell, SAMPLES, FEATURE_NOISE, rng);
        let form = match options.simulator {
            FormName::Linear => ReachForm::Linear,
            FormName::Rigid8 => ReachForm::Rigid8,
            FormName::Rigid22 => ReachForm::Rigid22,
        };
        let simulator = Simulator::fit(&centring, &reaching, form)?;
        let mut r2 = BTreeMap::new();
        for quality in simulator.quality() {
            say(
                options,
                &format!(
                    "  {:<16} R² {:.4}   rmse {:.2} units",
                    quality.output, quality.r2, quality.rmse
                ),
            );
            r2.insert(quality.output, quality.r2);
        }
        let [centering, approaching] = specs(options.reward);
        let Lesson {
            behaviour: centering,
            report: first,
        } = teach(options, centering, &simulator, ACTIONS.0, rng)?;
        let Lesson {
            behaviour: approaching,
            report: second,
        } = teach(options, approaching, &simulator, ACTIONS.1, rng)?;

        // What goes to work is what lies on the disk.
        for behaviour in [&centering, &approaching] {
            behaviour.save(&policy_path(&options.out, behaviour.spec()))?;
        }
        let saved = Self::load(&options.out, options.reward)?;
        say(options, &format!("policies saved to {}", options.out.display()));
        Ok(Self {
            reports: Some((first, second)),
            r2,
            ..saved
        })
    }

    /// Reads behaviours that were saved before.
    fn load(folder: &Path, reward: RewardName) -> Result<Self, Box<dyn Error>> {
        let [centering, approaching] =
            specs(reward).map(|spec| Behaviour::load(&policy_path(folder, &spec), &spec));
        Ok(Self {
            centering: centering?,
            approaching: approaching?,
            reports: None,
            r2: BTreeMap::new(),
        })
    }
}

fn policy_path(folder: &Path, spec: &BehaviourSpec) -> PathBuf {
    folder.join(format!("{}.policy", spec.name))
}

fn specs(reward: RewardName) -> [BehaviourSpec; 2] {
    let (centering, approaching) = (BehaviourSpec::centering(), BehaviourSpec::approaching());
    match reward {
        RewardName::Mended => [centering, approaching],
        RewardName::Literal => [
            centering.with_reward(Reward::centering_literal()),
            approaching.with_reward(Reward::approaching_literal()),
        ],
    }
}

fn teach(
    options: &Options,
    spec: BehaviourSpec,
    simulator: &Simulator,
    actions: u64,
    rng: &mut dyn Rng,
) -> Result<Lesson, Box<dyn Error>> {
    let bar = progress_bar(options, actions, &format!("{} actions", spec.name));
    let size = format!(
        "{}: {} states x {} actions",
        spec.name,
        spec.states(),
        spec.actions()
    );
    let lesson = learn(spec, simulator, actions, rng, &mut |progress| {
        bar.set_position(progress.actions);
    })?;
    bar.finish_and_clear();
    let success = lesson.report.curve.last().and_then(|record| record.success_share);
    let success = success.map_or("-".into(), |share| format!("{:.1} %", 100.0 * share));
    say(
        options,
        &format!("learned {size}, {actions} actions; goal reached in the last episodes: {success}"),
    );
    Ok(lesson)
}

fn detector(options: &Options) -> Result<Box<dyn CircleDetector>, Box<dyn Error>> {
    // The ball's outline measures 5 to 68 feature units: 20 to 272 pixels of the camera's frame.
    let radii = (20.0, 272.0);
    // The shaded side of the ball is hardly brighter than the table: edges must be taken that are weaker than usual.
    let edges = CannyConfig {
        low: 20.0,
        high: 50.0,
        ..CannyConfig::default()
    };
    Ok(match options.detector {
        DetectorName::Heuristic => {
            let config = HeuristicConfig {
                theta: 0.6,
                min_radius: radii.0,
                max_radius: radii.1,
                seed: options.seed,
                ..HeuristicConfig::default()
            };
            Box::new(Heuristic::new(config, Canny::new(edges)?)?)
        }
    })
}

/// One run: places the ball, lets the agent go for it, and measures in the cell whether it has it.
fn reach_for(
    agent: &Agent,
    rig: &mut Rig,
    detector: &mut dyn CircleDetector,
    ball: &Ball,
    run: usize,
    pictures: &mut Vec<Picture>,
) -> Result<RunRecord, Box<dyn Error>> {
    rig.place(ball);
    let mut record = RunRecord::new((ball.centre.coords * 1000.0).into());
    let outcome = rig.run(agent, detector, &mut |event| {
        pictures.extend(record.note(run, event));
    })?;
    if outcome.gave_up.is_none() {
        let miss = rig.grip_miss();
        record.miss_mm = Some(miss * 1000.0);
        record.grasped = miss <= GRASP_TOLERANCE;
    }
    record.outcome = Some(outcome);
    Ok(record)
}

fn write_results(
    out: &Path,
    summary: &Summary,
    records: &[RunRecord],
    pictures: &[Picture],
) -> Result<(), Box<dyn Error>> {
    let frames = out.join("frames");
    // Frames of an earlier run must not mix with these.
    if frames.exists() {
        std::fs::remove_dir_all(&frames)
            .map_err(|error| format!("{}: cannot be replaced: {error}", frames.display()))?;
    }
    writable_folder(&frames)?;
    for picture in pictures {
        let name = format!("run{:03}-frame{:03}.png", picture.run, picture.number);
        write_png(&frames.join(name), &picture.image)?;
    }
    write_png(
        &out.join("contact_sheet.png"),
        &results::contact_sheet(pictures, 12),
    )?;
    write_whole(
        &out.join("features.svg"),
        plots::features_per_step(records)?.as_bytes(),
    )?;
    write_whole(
        &out.join("features.csv"),
        results::features_csv(records).as_bytes(),
    )?;
    write_whole(&out.join("summary.json"), &serde_json::to_vec_pretty(summary)?)
}

fn one_line(run: usize, record: &RunRecord) -> String {
    let [x, y, z] = record.ball_mm;
    let cycles = record.outcome.map_or(0, |outcome| outcome.cycles);
    let result = if record.grasped { "grasped" } else { "not grasped" };
    format!("run {run:3}: ball at {x:5.0} {y:5.0} {z:5.0} mm, {cycles:2} moves, {result}")
}

fn say(options: &Options, words: &str) {
    if !options.quiet {
        print_out(words);
    }
}

/// Prints; a reader who has gone away is no reason to stop.
fn print_out(words: &str) {
    let _ = writeln!(std::io::stdout(), "{words}");
}

fn progress_bar(options: &Options, length: u64, unit: &str) -> ProgressBar {
    let target = if options.quiet {
        ProgressDrawTarget::hidden()
    } else {
        ProgressDrawTarget::stderr()
    };
    let style = ProgressStyle::with_template("  {bar:40} {pos}/{len} {msg}  {elapsed} (still {eta})")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::with_draw_target(Some(length), target)
        .with_style(style)
        .with_message(unit.to_owned())
}
