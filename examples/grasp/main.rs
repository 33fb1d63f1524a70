//! The main job: learn in simulation, then see, reach and grasp balls through VAL II.
//!
//! ```text
//! cargo run --release --example grasp -- --help
//! ```

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use grasp_agent::{
    Agent, AgentConfig, Behaviour, BehaviourPair, BehaviourSpec, JointLimits, Learned, Lesson,
    OnlineLearning, Percept, RunEvent, SavedRun,
};
use pipeline_sim::{Cell, Workspace};
use puma_grasp::{Rig, RigError, Simulator, bright_ball_scene};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{Rng, SeedableRng};

use example_support::files::writable_folder;
use example_support::learning::{ACTIONS, ACTIONS_FINE, SAMPLES, TRIALS, anywhere, simulators};
use example_support::overlay::Overlay;
use example_support::plane::search_percepts;
use example_support::prelude::*;
use example_support::stages::Stages;
use example_support::trial::{ball_in_view, run_on_rig};
use options::{Options, RewardName};
use record::{Picture, RunRecord};
use results::{ContactSheet, Summary, TrainingSummary};

mod options;
mod plots;
mod record;
mod results;

fn main() -> ExitCode {
    start(run)
}

fn run(options: &Options) -> Outcome {
    // Checks all input before the long work.
    options.check()?;
    let _lock = lock_folder(&options.out)?;
    if let Some(folder) = options.export.as_deref().and_then(Path::parent) {
        writable_folder(&Path::new(".").join(folder))?;
    }
    let mut detector = options.detector.build(options.seed)?;
    let pair = behaviours(options)?;
    let policy = options.policy.as_deref();
    let loaded = policy.map(|path| Taught::load(path, &pair)).transpose()?;
    let mut rig = open_rig(options)?;
    rig.stopped_by(STOP.clone());
    options.say(format_args!(
        "connected to the VAL II controller on {}",
        rig.name()
    ));

    // Results of an earlier run are removed only now, after everything that can be refused.
    let out = |name: &str| options.out.join(name);
    let frames = emptied(out("frames"))?;
    let failures = emptied(out("failures"))?;
    let saved_runs = emptied(out("saved"))?;
    let columns = "run,step,x,y,r,jt1,jt2,jt3,jt4,jt5,jt6,d1,d2,d3,event";
    let mut events = Table::create(out("features.csv"), columns)?;

    let mut rng = Xoshiro256PlusPlus::seed_from_u64(options.seed);
    let begin = Instant::now();
    let taught = match loaded {
        Some(taught) => taught,
        None => Taught::train(options, &pair, &rig.cell().get(), &mut rng)?,
    };
    let lasts = taught
        .lessons
        .iter()
        .filter_map(|lesson| lesson.curve.last());
    let training = TrainingSummary {
        trained: !taught.lessons.is_empty(),
        actions: lasts.map(|record| record.actions).sum(),
        seconds: begin.elapsed().as_secs_f64(),
        r2: taught.r2,
    };
    if training.trained {
        plots::learning_curves(&out("learning.svg"), &taught.lessons)?;
    }
    export(options, &taught.learned, &taught.limits)?;

    let config = AgentConfig {
        goal: pair.goal(),
        limits: taught.limits,
        ..AgentConfig::paper(Workspace::paper().search_poses())
    };
    let stages = Stages::default();
    let mut agent = Agent::with_controller(config, stages.around(taught.learned))?;
    let (mut records, mut sheet) = (Vec::new(), ContactSheet::default());
    // The results until a fault are kept.
    let mut broken_off = None;
    let bar = progress_bar(options.runs as u64, "balls", options.quiet);
    for run in 1..=options.runs {
        let ball = match go_on().and_then(|()| ball_in_view(rig.cell(), &mut rng)) {
            Ok(ball) => ball,
            Err(error) => {
                broken_off = Some(error.to_string());
                break;
            }
        };
        if options.keep_learning {
            // Each run has a seed of its own, so that it can be replayed without those before it.
            let settings = OnlineLearning::careful(options.seed.wrapping_add(run as u64));
            let learned = &mut agent.controller_mut().inner;
            *learned = learned.clone().learning(settings)?;
        }
        let ball_mm = (ball.centre.coords * 1000.0).into();
        let mut record = RunRecord::new(run, ball_mm, SavedRun::before(&agent));
        let cell = rig.cell().clone();
        // A file that cannot be written ends the writing of frames, not the run.
        let mut written: Outcome = Ok(());
        // Frames to be written if the run fails.
        let mut pictures = Vec::new();
        let mut observe = |event: &RunEvent<'_>| {
            let (row, picture) = record.note(event, &cell.get());
            // Rows are small and find a place where frames do not.
            let row = events.row(row);
            if written.is_ok() {
                written = row;
            }
            if let Some(picture) = picture
                && written.is_ok()
            {
                sheet.add(&picture);
                if run <= options.frames_of {
                    written = write_frame(&frames, picture);
                } else {
                    pictures.push(picture);
                }
            }
        };
        let reached = rig.place(&ball).map_err(Into::into).and_then(|()| {
            let detector = &mut *detector;
            run_on_rig(&mut rig, detector, &mut agent, &stages, &mut observe).map_err(Into::into)
        });
        let mut done: Outcome = reached.and_then(|trial| {
            record.ended(&trial);
            written
        });
        if !record.summary.grasped {
            let mut pictures = pictures.into_iter();
            done = done.and(pictures.try_for_each(|picture| write_frame(&frames, picture)));
        }
        match done {
            Ok(()) => {
                bar.suspend(|| options.say(one_line(&record)));
                bar.inc(1);
            }
            Err(error) => {
                let error = go_on().err().unwrap_or(error);
                broken_off = Some(format!("run {run} was broken off: {error}"));
                record.summary.reason.get_or_insert(error.to_string());
            }
        }
        for (folder, keep) in [
            (&failures, !record.summary.grasped),
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
        save(options, &learned)?;
        export(options, &learned, &limits)?;
    }

    let summary = Summary::new(options.seed, &training, &records);
    // The first fault is the one that is reported; the smallest files come first.
    let mut keep = |written: Outcome| {
        if let Err(error) = written {
            broken_off.get_or_insert(error.to_string());
        }
    };
    keep(write_whole(
        &out("summary.json"),
        &serde_json::to_vec_pretty(&summary)?,
    ));
    keep(plots::features_per_step(&out("features.svg"), &records));
    keep(write_png(&out("contact_sheet.png"), &sheet.drawn()));
    say!("{summary}");
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
    /// Centering and approaching as they were learned; none if they were read from files.
    lessons: Vec<Lesson>,
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
    ) -> Outcome<Self> {
        options.say(format_args!("sampling {SAMPLES} moves in the cell"));
        let [simulator] = simulators(cell, [options.form()], rng)?;
        let mut r2 = BTreeMap::new();
        for quality in simulator.quality() {
            let (output, fit, rmse) = (quality.output, quality.r2, quality.rmse);
            options.say(format_args!(
                "  {output:<16} R² {fit:.4}   rmse {rmse:.2} units"
            ));
            r2.insert(output, fit);
        }
        // With the literal rewards the last table is kept.
        let trials = match options.reward() {
            RewardName::Literal => 0,
            RewardName::Mended => TRIALS,
        };
        let starts = anywhere(&simulator, trials, rng);
        let mut teach = |spec: &BehaviourSpec, trials: &[Percept], actions| {
            teach(options, spec, &simulator, trials, actions, rng)
        };
        let first = teach(&pair.centering, &starts, ACTIONS.0)?;
        let found = search_percepts(trials, options.seed);
        let actions = if options.fine {
            ACTIONS_FINE
        } else {
            ACTIONS.1
        };
        let second = teach(&pair.approaching, &found, actions)?;

        // Uses the policies as saved.
        save(
            options,
            &Learned::new(first.behaviour.clone(), second.behaviour.clone()),
        )?;
        let saved = Self::load(&options.out, pair)?;
        options.say(format_args!("policies saved to {}", options.out.display()));
        let lessons = vec![first, second];
        Ok(Self {
            lessons,
            r2,
            ..saved
        })
    }

    /// Reads saved policies: a folder with two of them, or an exported file.
    fn load(path: &Path, pair: &BehaviourPair) -> Outcome<Self> {
        let (learned, limits) = if path.is_file() {
            let name = path.display();
            let text = std::fs::read_to_string(path)
                .map_err(|error| format!("{name}: cannot be read: {error}"))?;
            let (learned, limits) =
                Learned::from_json(&text).map_err(|error| format!("{name}: {error}"))?;
            let found = [learned.centering(), learned.approaching()].map(Behaviour::spec);
            let asked = [&pair.centering, &pair.approaching];
            if found.map(|spec| &spec.goal) != asked.map(|spec| &spec.goal) {
                let advice = "learned for another goal; give the --y-goal it was learned with";
                return Err(format!("{name}: {advice}").into());
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
            lessons: Vec::new(),
            r2: BTreeMap::new(),
        })
    }
}

/// Saves both policies to the output folder.
fn save(options: &Options, learned: &Learned) -> Outcome {
    for behaviour in [learned.centering(), learned.approaching()] {
        behaviour.save(&policy_path(&options.out, behaviour.spec()))?;
    }
    Ok(())
}

/// Writes the policy as JSON if asked for.
fn export(options: &Options, learned: &Learned, limits: &JointLimits) -> Outcome {
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

fn behaviours(options: &Options) -> Outcome<BehaviourPair> {
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
) -> Outcome<Lesson> {
    let bar = progress_bar(actions, &format!("{} actions", spec.name), options.quiet);
    let lesson = simulator.learn(spec.clone(), trials, actions, rng, &mut |progress| {
        bar.set_position(progress.actions);
    })?;
    bar.finish_and_clear();
    let success = lesson.curve.last().and_then(|record| record.success_share);
    let success = success.map_or("-".into(), |share| format!("{:.1} %", 100.0 * share));
    options.say(format_args!(
        "learned {}: {} states x {} actions, {actions} actions; goal reached in the last \
         episodes: {success}",
        spec.name,
        spec.states(),
        spec.actions()
    ));
    Ok(lesson)
}

/// Creates a folder, or removes from it the files that an earlier run of this program wrote:
/// `run001.json`, `run001-frame002.png`.
fn emptied(folder: PathBuf) -> Outcome<PathBuf> {
    writable_folder(&folder)?;
    for entry in std::fs::read_dir(&folder)? {
        let path = entry?.path();
        let name = path.file_name().and_then(|name| name.to_str());
        if name.is_some_and(is_ours) {
            std::fs::remove_file(&path)
                .map_err(|error| format!("{}: cannot be replaced: {error}", path.display()))?;
        }
    }
    Ok(folder)
}

fn is_ours(name: &str) -> bool {
    let number = |text: &str| text.len() >= 3 && text.bytes().all(|byte| byte.is_ascii_digit());
    let Some((stem, kind)) = name
        .strip_prefix("run")
        .and_then(|rest| rest.rsplit_once('.'))
    else {
        return false;
    };
    match (kind, stem.split_once("-frame")) {
        ("json", None) => number(stem),
        ("png", Some((run, frame))) => number(run) && number(frame),
        _ => false,
    }
}

fn write_frame(folder: &Path, picture: Picture) -> Outcome {
    let name = format!("run{:03}-frame{:03}.png", picture.run, picture.number);
    let image = Overlay::from(picture.image).captioned(&picture.words);
    write_png(&folder.join(name), &image)
}

fn one_line(record: &RunRecord) -> String {
    let (run, summary) = (record.run, &record.summary);
    let ([x, y, z], moves) = (summary.ball_mm, summary.cycles);
    let result = if summary.grasped {
        "grasped"
    } else {
        "not grasped"
    };
    format!("run {run:3}: ball at {x:5.0} {y:5.0} {z:5.0} mm, {moves:2} moves, {result}")
}
