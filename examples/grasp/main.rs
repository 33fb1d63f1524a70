//! The main job: learn in simulation, then see, reach and grasp balls through VAL II.
//!
//! ```text
//! cargo run --release --example grasp -- --help
//! ```

use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use grasp_agent::{
    Agent, AgentConfig, Behaviour, BehaviourPair, BehaviourSpec, EventKind, JointLimits, Learned,
    Lesson, OnlineLearning, Percept, RunEvent, SavedRun,
};
use hough_heuristic::CircleDetector;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use pipeline_sim::{Ball, Cell, Workspace};
use puma_grasp::{Rig, RigError, Simulator, bright_ball_scene};
use qtable::Record;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{Rng, SeedableRng};

use example_support::files::{writable_folder, write_png, write_whole};
use example_support::learning::{ACTIONS, ACTIONS_FINE, TRIALS};
use example_support::plane::search_percepts;
use example_support::program::ended;
use example_support::say;
use example_support::stages::{Stages, Timed};
use example_support::trial::{Trial, run_on_rig};
use options::{Options, RewardName};
use record::{Picture, RunRecord};
use results::{ContactSheet, Summary, TrainingSummary};

mod options;
mod plots;
mod record;
mod results;

/// Moves sampled in the cell for the regression.
const SAMPLES: usize = 2_500;
/// Standard deviation of the features in those samples, feature units.
const FEATURE_NOISE: f64 = 0.5;

fn main() -> ExitCode {
    ended(run(&Options::parse()))
}

fn run(options: &Options) -> Result<(), Box<dyn Error>> {
    // Checks all input before the long work.
    options.check()?;
    writable_folder(&options.out)?;
    if let Some(path) = &options.export {
        writable_folder(match path.parent() {
            Some(folder) if folder != Path::new("") => folder,
            _ => Path::new("."),
        })?;
    }
    let mut detector = options.detector.build(options.seed)?;
    let pair = behaviours(options)?;
    let loaded = options
        .policy
        .as_ref()
        .map(|path| Taught::load(path, &pair))
        .transpose()?;
    let mut rig = open_rig(options)?;
    options.say(format_args!(
        "connected to the VAL II controller on {}",
        rig.name()
    ));

    // Results of an earlier run are removed only now, after everything that can be refused.
    let frames = Frames(emptied(&options.out.join("frames"))?);
    let failures = emptied(&options.out.join("failures"))?;
    let saved_runs = emptied(&options.out.join("saved"))?;

    let mut rng = Xoshiro256PlusPlus::seed_from_u64(options.seed);
    let begin = Instant::now();
    let taught = match loaded {
        Some(taught) => taught,
        None => Taught::train(options, &pair, &rig.cell().get(), &mut rng)?,
    };
    let training = TrainingSummary {
        trained: taught.curves.is_some(),
        actions: taught
            .curves
            .iter()
            .flat_map(|(centering, approaching)| [centering.last(), approaching.last()])
            .flatten()
            .map(|record| record.actions)
            .sum(),
        seconds: begin.elapsed().as_secs_f64(),
        r2: taught.r2,
    };
    if let Some((centering, approaching)) = &taught.curves {
        let svg =
            plots::learning_curves(&[("centering", centering), ("approaching", approaching)])?;
        write_whole(&options.out.join("learning.svg"), svg.as_bytes())?;
    }
    export(options, &taught.learned, &taught.limits)?;

    let workspace = Workspace::paper();
    let config = AgentConfig {
        goal: pair.goal(),
        limits: taught.limits,
        ..AgentConfig::paper(workspace.search_poses())
    };
    let stages = Stages::default();
    let mut agent = Agent::with_controller(config, stages.around(taught.learned))?;
    let mut records = Vec::new();
    let mut sheet = ContactSheet::default();
    // The results until a fault are kept.
    let mut broken_off = None;
    let bar = progress_bar(options, options.runs as u64, "balls");
    for run in 1..=options.runs {
        let Some((ball, _)) = workspace.sample_seen_ball(&rig.cell().get(), &mut rng) else {
            broken_off = Some("no place of the workspace is in view from a search pose".into());
            break;
        };
        // Each run has a seed of its own, so that it can be replayed without those before it.
        let learning = options
            .keep_learning
            .then(|| OnlineLearning::careful(options.seed.wrapping_add(run as u64)));
        let learned = &mut agent.controller_mut().inner;
        if let Some(settings) = learning {
            *learned = learned.clone().learning(settings)?;
        }
        let saved = SavedRun::before(&agent);
        let mut record = RunRecord::new((ball.centre.coords * 1000.0).into(), saved);
        let cell = rig.cell().clone();
        let done = reach_for(&mut agent, &mut rig, &mut *detector, &ball, &mut |event| {
            if let EventKind::Gripping(_) = event.kind {
                record.gripped_at(cell.with(|cell| cell.grip_miss(&event.joints)));
            }
            match record.note(run, event) {
                Some(picture) => {
                    sheet.add(&picture);
                    frames.write(&picture)
                }
                None => Ok(()),
            }
        });
        match done {
            Ok(trial) => {
                record.ended(&trial, rig.contacts().collisions);
                bar.suspend(|| options.say(one_line(run, &record)));
                bar.inc(1);
            }
            Err(error) => {
                broken_off = Some(format!("run {run} was broken off: {error}"));
                record.fault = Some(error.to_string());
            }
        }
        for (folder, keep) in [
            (&failures, !record.grasped),
            (&saved_runs, options.save_runs),
        ] {
            let path = folder.join(format!("run{run:03}.json"));
            if keep && let Err(error) = write_whole(&path, record.saved.to_json().as_bytes()) {
                // A file that cannot be written does not lose what was learned.
                broken_off.get_or_insert(format!("run {run} was not kept: {error}"));
            }
        }
        records.push(record);
        if broken_off.is_some() {
            break;
        }
    }
    bar.finish_and_clear();
    if options.keep_learning {
        // Includes what was learned in a run that was broken off.
        let limits = agent.config().limits;
        let learned = agent.into_controller().inner;
        let (centering, approaching) = learned.clone().into_behaviours();
        for behaviour in [&centering, &approaching] {
            behaviour.save(&policy_path(&options.out, behaviour.spec()))?;
        }
        export(options, &learned, &limits)?;
    }

    let summary = Summary::new(options.seed, training, &records);
    write_results(&options.out, &summary, &records, &sheet)?;
    say!("{}", summary.table());
    options.say(&stages);
    options.say(format_args!("results: {}", options.out.display()));
    broken_off.map_or(Ok(()), |reason| Err(reason.into()))
}

/// Opens the arm: an emulated controller, or one on a line.
fn open_rig(options: &Options) -> Result<Rig, RigError> {
    let (scene, seed) = (bright_ball_scene(), options.seed);
    match (&options.port, &options.tcp) {
        (Some(path), _) => Rig::on_port(path, &scene, seed),
        (None, Some(address)) => Rig::on_socket(address, &scene, seed),
        (None, None) => Rig::emulated(options.realtime, &scene, seed),
    }
}

/// Learned behaviours and their origin.
struct Taught {
    learned: Learned,
    limits: JointLimits,
    /// Learning curves, unless the behaviours were read from files.
    curves: Option<(Vec<Record>, Vec<Record>)>,
    r2: BTreeMap<String, f64>,
}

impl Taught {
    /// Samples the cell, fits the regression simulator, learns both behaviours in it, and saves
    /// them.
    fn train(
        options: &Options,
        pair: &BehaviourPair,
        cell: &Cell,
        rng: &mut dyn Rng,
    ) -> Result<Self, Box<dyn Error>> {
        options.say(format_args!("sampling {SAMPLES} moves in the cell"));
        let (centering, reaching) = cell.sample_moves(SAMPLES, FEATURE_NOISE, rng)?;
        let simulator = Simulator::fit(&centering, &reaching, options.form())?;
        let mut r2 = BTreeMap::new();
        for quality in simulator.quality() {
            options.say(format_args!(
                "  {:<16} R² {:.4}   rmse {:.2} units",
                quality.output, quality.r2, quality.rmse
            ));
            r2.insert(quality.output, quality.r2);
        }
        // With the literal rewards the last table is kept.
        let trials = match options.reward() {
            RewardName::Literal => 0,
            RewardName::Mended => TRIALS,
        };
        let anywhere: Vec<Percept> = (0..trials).map(|_| simulator.start(rng)).collect();
        let spec = &pair.centering;
        let first = teach(options, spec, &simulator, &anywhere, ACTIONS.0, rng)?;
        let (spec, found) = (&pair.approaching, search_percepts(trials, options.seed));
        let actions = if options.fine {
            ACTIONS_FINE
        } else {
            ACTIONS.1
        };
        let second = teach(options, spec, &simulator, &found, actions, rng)?;

        // Uses the policies as saved.
        for behaviour in [&first.behaviour, &second.behaviour] {
            behaviour.save(&policy_path(&options.out, behaviour.spec()))?;
        }
        let saved = Self::load(&options.out, pair)?;
        options.say(format_args!("policies saved to {}", options.out.display()));
        Ok(Self {
            curves: Some((first.curve, second.curve)),
            r2,
            ..saved
        })
    }

    /// Reads saved policies: a folder with two of them, or an exported file.
    fn load(path: &Path, pair: &BehaviourPair) -> Result<Self, Box<dyn Error>> {
        let (learned, limits) = if path.is_file() {
            let text = std::fs::read_to_string(path)
                .map_err(|error| format!("{}: cannot be read: {error}", path.display()))?;
            let (learned, limits) = Learned::from_json(&text)
                .map_err(|error| format!("{}: {error}", path.display()))?;
            let found = [learned.centering(), learned.approaching()].map(Behaviour::spec);
            let asked = [&pair.centering, &pair.approaching];
            if found.map(|spec| &spec.goal) != asked.map(|spec| &spec.goal) {
                return Err(format!(
                    "{}: learned for another goal; give the --y-goal it was learned with",
                    path.display()
                )
                .into());
            }
            (learned, limits)
        } else {
            let [centering, approaching] = [&pair.centering, &pair.approaching]
                .map(|spec| Behaviour::load(&policy_path(path, spec), spec));
            (Learned::new(centering?, approaching?), JointLimits::paper())
        };
        Ok(Self {
            learned,
            limits,
            curves: None,
            r2: BTreeMap::new(),
        })
    }
}

/// Writes the policy as JSON if asked for.
fn export(
    options: &Options,
    learned: &Learned,
    limits: &JointLimits,
) -> Result<(), Box<dyn Error>> {
    let Some(path) = &options.export else {
        return Ok(());
    };
    write_whole(path, learned.to_json(limits).as_bytes())?;
    options.say(format_args!("policy exported to {}", path.display()));
    Ok(())
}

fn policy_path(folder: &Path, spec: &BehaviourSpec) -> PathBuf {
    folder.join(format!("{}.policy", spec.name))
}

fn behaviours(options: &Options) -> Result<BehaviourPair, Box<dyn Error>> {
    let mut pair = match options.reward() {
        RewardName::Mended => BehaviourPair::paper_mended(),
        RewardName::Literal => BehaviourPair::paper_literal(),
    };
    if options.fine {
        let (paper, fine) = (pair, BehaviourPair::fine());
        pair = fine;
        pair.centering.reward = paper.centering.reward;
        pair.approaching.reward = paper.approaching.reward;
    }
    Ok(pair.with_y_goal(options.y_goal.goal())?)
}

fn teach(
    options: &Options,
    spec: &BehaviourSpec,
    simulator: &Simulator,
    trials: &[Percept],
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
    let lesson = simulator.learn(spec.clone(), trials, actions, rng, &mut |progress| {
        bar.set_position(progress.actions);
    })?;
    bar.finish_and_clear();
    let success = lesson.curve.last().and_then(|record| record.success_share);
    let success = success.map_or("-".into(), |share| format!("{:.1} %", 100.0 * share));
    options.say(format_args!(
        "learned {size}, {actions} actions; goal reached in the last episodes: {success}"
    ));
    Ok(lesson)
}

/// Observer that records an event and may fail to.
type Observe<'a> = dyn FnMut(&RunEvent<'_>) -> Result<(), Box<dyn Error>> + 'a;

/// Places the ball and lets the agent go for it. A picture that cannot be written ends the writing
/// of pictures, not the run.
fn reach_for(
    agent: &mut Agent<Timed<Learned>>,
    rig: &mut Rig,
    detector: &mut dyn CircleDetector,
    ball: &Ball,
    observe: &mut Observe<'_>,
) -> Result<Trial, Box<dyn Error>> {
    rig.place(ball)?;
    let stages = agent.controller().stages.clone();
    let mut written = Ok(());
    let trial = run_on_rig(rig, detector, agent, &stages, &mut |event| {
        if written.is_ok() {
            written = observe(event);
        }
    })?;
    written.map(|()| trial)
}

/// Creates a folder, or removes from it the files that an earlier run of this program wrote.
fn emptied(folder: &Path) -> Result<PathBuf, Box<dyn Error>> {
    writable_folder(folder)?;
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path.file_name().and_then(|name| name.to_str());
        if name.is_some_and(is_ours) {
            std::fs::remove_file(&path)
                .map_err(|error| format!("{}: cannot be replaced: {error}", path.display()))?;
        }
    }
    Ok(folder.to_owned())
}

/// Returns whether a file has the name of a saved run or of a frame: `run001.json`,
/// `run001-frame002.png`.
fn is_ours(name: &str) -> bool {
    let number = |text: &str| text.len() >= 3 && text.bytes().all(|byte| byte.is_ascii_digit());
    let Some((stem, kind)) = name
        .strip_prefix("run")
        .and_then(|rest| rest.rsplit_once('.'))
    else {
        return false;
    };
    match kind {
        "json" => number(stem),
        "png" => stem
            .split_once("-frame")
            .is_some_and(|(run, frame)| number(run) && number(frame)),
        _ => false,
    }
}

/// Folder of the frames. Each picture is written when it is made.
struct Frames(PathBuf);

impl Frames {
    fn write(&self, picture: &Picture) -> Result<(), Box<dyn Error>> {
        let name = format!("run{:03}-frame{:03}.png", picture.run, picture.number);
        write_png(&self.0.join(name), &picture.captioned())
    }
}

fn write_results(
    out: &Path,
    summary: &Summary,
    records: &[RunRecord],
    sheet: &ContactSheet,
) -> Result<(), Box<dyn Error>> {
    write_png(&out.join("contact_sheet.png"), &sheet.drawn(12))?;
    write_whole(
        &out.join("features.svg"),
        plots::features_per_step(records)?.as_bytes(),
    )?;
    write_whole(
        &out.join("features.csv"),
        results::features_csv(records).as_bytes(),
    )?;
    write_whole(
        &out.join("summary.json"),
        &serde_json::to_vec_pretty(summary)?,
    )
}

fn one_line(run: usize, record: &RunRecord) -> String {
    let [x, y, z] = record.ball_mm;
    let cycles = record.outcome.map_or(0, |outcome| outcome.cycles);
    let result = if record.grasped {
        "grasped"
    } else {
        "not grasped"
    };
    format!("run {run:3}: ball at {x:5.0} {y:5.0} {z:5.0} mm, {cycles:2} moves, {result}")
}

fn progress_bar(options: &Options, length: u64, unit: &str) -> ProgressBar {
    let target = if options.quiet {
        ProgressDrawTarget::hidden()
    } else {
        ProgressDrawTarget::stderr()
    };
    let style =
        ProgressStyle::with_template("  {bar:40} {pos}/{len} {msg}  {elapsed} ({eta} left)")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::with_draw_target(Some(length), target)
        .with_style(style)
        .with_message(unit.to_owned())
}
