//! The main job: learn in simulation, then see, reach and grasp balls through VAL II.
//!
//! ```text
//! cargo run --release --example grasp -- --help
//! ```

use std::path::{Path, PathBuf};
use std::time::Instant;

use grasp_agent::{Agent, AgentConfig, Learned, OnlineLearning, RunEvent, SavedRun};
use pipeline_sim::{Scene, Workspace};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

use example_support::files::writable_folder;
use example_support::live::Live;
use example_support::overlay::Overlay;
use example_support::prelude::*;
use example_support::stages::Stages;
use example_support::trial::{ball_in_view, run_on_rig};
use options::Options;
use record::{Picture, RunRecord};
use results::{ContactSheet, Summary, TrainingSummary};
use taught::{ControllerName, Mind, Taught, Training, behaviours, export, goal, hybrid, save};

mod options;
mod plots;
mod record;
mod results;
mod taught;

fn main() -> ExitCode {
    start(run)
}

fn run(options: &Options) -> Outcome {
    // Checks all input before the long work.
    options.check()?;
    let live = Live::at(options.live.as_deref())?;
    let _lock = lock_folder(&options.out)?;
    if let Some(folder) = options.export.as_deref().and_then(Path::parent) {
        writable_folder(&Path::new(".").join(folder))?;
    }
    let pair = behaviours(options)?;
    let policy = options.policy.as_deref();
    let loaded = policy.map(|path| Taught::load(path, &pair)).transpose()?;
    let (real, scene) = (&options.real, Scene::bright_ball());
    let opened = real.open(options.detector, options.realtime, &scene, options.seed);
    let (mut rig, mut detector) = opened?;
    options.say(format_args!(
        "connected to the VAL II controller on {}",
        rig.name()
    ));

    if let Some(url) = live.url() {
        options.say(format_args!("watch it at {url}"));
    }
    // Results of an earlier run are removed only now, after everything that can be refused.
    let out = |name: &str| options.out.join(name);
    let frames = emptied(out("frames"))?;
    let failures = emptied(out("failures"))?;
    let saved_runs = emptied(out("saved"))?;
    let columns = "run,step,x,y,r,jt1,jt2,jt3,jt4,jt5,jt6,d1,d2,d3,event";
    let mut events = Table::create(out("features.csv"), columns)?;

    let mut rng = Xoshiro256PlusPlus::seed_from_u64(options.seed);
    let begin = Instant::now();
    let seeing = &mut (&mut rig, &mut *detector as _);
    let goal = goal(options, seeing)?;
    let (goal_shown, mut training) = (goal.as_ref(), Training::default());
    let taught = match (options.controller, loaded) {
        (ControllerName::Hybrid, _) => Ok(None),
        (ControllerName::Learned, Some(taught)) => Ok(Some(taught)),
        (ControllerName::Learned, None) => {
            let training = &mut training;
            Taught::train(
                options, &live, &pair, goal_shown, seeing, training, &mut rng,
            )
            .map(Some)
        }
    };
    let Training { lessons, r2 } = training;
    let lasts = lessons.iter().filter_map(|lesson| lesson.curve.last());
    let training = TrainingSummary {
        trained: !lessons.is_empty(),
        actions: lasts.map(|record| record.actions).sum(),
        seconds: begin.elapsed().as_secs_f64(),
        r2,
    };
    if training.trained {
        plots::learning_curves(&out("learning.svg"), &lessons)?;
    }
    if taught.is_err() {
        // The figures of the training until the fault are kept.
        Summary::new(options.seed, &training, &[], &[]).write(&out("summary.json"))?;
    }
    let taught = taught?;

    let mut config = AgentConfig {
        goal: pair.goal(),
        ..AgentConfig::paper(Workspace::paper().search_poses())
    };
    let mind = match taught {
        None => Mind::Hybrid(Box::new(hybrid(options, goal.as_ref())?)),
        Some(Taught { learned, limits }) => {
            config.limits = limits;
            export(options, &learned, &config)?;
            let shown = goal.iter().fold(learned, Learned::shown);
            Mind::Learned(Box::new(shown))
        }
    };
    let config = real.fit(config, goal.as_ref());
    let stages = Stages::default();
    let mut agent = Agent::with_controller(config, stages.around(mind))?;
    let (mut records, mut sheet) = (Vec::new(), ContactSheet::default());
    // The results until a fault are kept.
    let mut broken_off = None;
    let bar = progress_bar(options.runs() as u64, "balls", options.quiet);
    for run in 1..=options.runs() {
        let next = go_on().and_then(|()| real.next_ball(&mut rig, run));
        let ball = match next.and_then(|()| ball_in_view(rig.cell(), &mut rng)) {
            Ok(ball) => ball,
            Err(error) => {
                broken_off = Some(error.to_string());
                break;
            }
        };
        if let Mind::Learned(learned) = &mut agent.controller_mut().inner
            && options.keep_learning
        {
            // Each run has a seed of its own, so that it can be replayed without those before it.
            let settings = OnlineLearning::careful(options.seed.wrapping_add(run as u64));
            **learned = learned.clone().learning(settings)?;
        }
        live.goal(&agent.config().goal);
        let simulated = rig.is_simulated();
        let ball_mm = simulated.then(|| (ball.centre.coords * 1000.0).into());
        let mut record = RunRecord::new(run, ball_mm, SavedRun::before(&agent));
        let cell = rig.cell().clone();
        // A file that cannot be written ends the writing of frames, not the run.
        let mut written: Outcome = Ok(());
        // Frames to be written if the run fails.
        let mut pictures = Vec::new();
        let mut observe = |event: &RunEvent<'_>| {
            let (row, picture) = record.note(event, &cell.get());
            live.event(run, event, picture.as_ref().map(|picture| &picture.image));
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
                record.summary.broken_off = record.summary.reason.is_none();
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
    let config = agent.config().clone();
    let shown = config.goal.clone();
    match agent.into_controller().inner {
        // Includes what was learned in a run that was broken off.
        Mind::Learned(learned) if options.keep_learning => {
            save(options, &learned)?;
            export(options, &learned, &config)?;
        }
        Mind::Learned(_) => {}
        Mind::Hybrid(hybrid) => hybrid.belief().save(&out("camera.belief"))?,
    }

    let summary = Summary::new(options.seed, &training, &records, &shown);
    // The first fault is the one that is reported; the smallest files come first.
    let mut keep = |written: Outcome| {
        if let Err(error) = written {
            broken_off.get_or_insert(error.to_string());
        }
    };
    keep(summary.write(&out("summary.json")));
    keep(plots::features_per_step(
        &out("features.svg"),
        &records,
        &shown,
    ));
    keep(write_png(&out("contact_sheet.png"), &sheet.drawn()));
    let end = broken_off
        .as_deref()
        .map_or_else(|| summary.in_words(), str::to_owned);
    live.end(&end);
    say!("{summary}");
    options.say(&stages);
    options.say(format_args!("results: {}", options.out.display()));
    broken_off.map_or(Ok(()), |reason| Err(reason.into()))
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
    let moves = summary.cycles;
    let result = if summary.grasped {
        "grasped"
    } else {
        "not grasped"
    };
    let ball = summary.ball_mm.map_or(String::new(), |[x, y, z]| {
        format!("ball at {x:5.0} {y:5.0} {z:5.0} mm, ")
    });
    format!("run {run:3}: {ball}{moves:2} moves, {result}")
}
