//! A ball that does not stay where it is, through the full chain: rendered frames, circle
//! detection, VAL II on a line.
//!
//! ```text
//! cargo run --release --example track -- --help
//! ```

#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a program for a terminal"
)]

use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, ValueEnum};
use grasp_agent::{
    Agent, AgentConfig, AgentError, Belief, CameraEye, EventKind, Hybrid, HybridSettings, Outcome,
    SavedController, SavedRun,
};
use hough_heuristic::{CircleDetector, Features};
use image::GrayImage;
use image::imageops::{FilterType, resize};
use pipeline_sim::{Cell, ErrorLevel, Workspace};
use puma_grasp::{BallDetector, Rig, RigParts, bright_ball_scene};
use puma_val2::Joints;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

use example_support::files::{writable_folder, write_whole};
use example_support::program::ended;
use example_support::stages::{Stages, Timed};
use tally::{Counted, Tally};

mod shortcut;
mod tally;

/// Track, reach and grasp a ball that is moved, with the self-calibrating hybrid controller.
///
/// In each cell the controller makes --teach runs on balls at rest first, to learn the camera; then
/// come the runs that count. A ball is grasped when the jaws hold it and the controller says so.
/// Grasps before what was to happen to the ball had happened are left out and told apart; a run
/// that failed before that counts as failed.
#[derive(Parser, Debug)]
struct Options {
    /// Folder for track.csv, track.png (the first run, animated), camera.belief, and the runs that
    /// failed or collided, for the example replay
    #[arg(long, value_name = "DIR", default_value = "out/track")]
    out: PathBuf,

    /// Seed of everything random
    #[arg(long, value_name = "N", default_value_t = 2000)]
    seed: u64,

    /// Runs that count
    #[arg(long, value_name = "N", default_value_t = 10)]
    runs: usize,

    /// Runs to learn from before, in each cell
    #[arg(long, value_name = "N", default_value_t = 40)]
    teach: usize,

    /// Cells that the runs are spread over, each with errors drawn anew
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = at_least_one)]
    cells: usize,

    /// What happens to the ball
    #[arg(long, value_enum, default_value_t = Fate::Push)]
    ball: Fate,

    /// How the circle is found: a-contrario, heuristic, rht, sht
    #[arg(
        long,
        value_name = "NAME",
        default_value_t,
        conflicts_with = "shortcut"
    )]
    detector: BallDetector,

    /// No frames and no line: features straight from the geometry. Only runs that failed are
    /// written, and collisions are not counted
    #[arg(long)]
    shortcut: bool,

    /// Noise of the camera in the dark, grey levels; that of the scene unless given
    #[arg(long, value_name = "LEVELS", conflicts_with = "shortcut")]
    noise: Option<f64>,

    /// Begin with what an earlier run learned of the camera: its camera.belief; learning goes on
    /// from there in the --teach runs
    #[arg(long, value_name = "FILE", conflicts_with = "shortcut")]
    belief: Option<PathBuf>,

    /// Errors of the camera: none, moderate, heavy, extreme
    #[arg(long, value_name = "LEVEL", default_value_t = ErrorLevel::Moderate)]
    level: ErrorLevel,
}

impl Options {
    /// How many of the runs fall to this cell, the first being 0.
    fn runs_in(&self, cell: usize) -> usize {
        (self.runs + self.cells - 1 - cell) / self.cells
    }
}

fn at_least_one(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(0) => Err("at least one is needed".into()),
        Ok(count) => Ok(count),
        Err(error) => Err(format!("{error}")),
    }
}

/// What happens to the ball.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Fate {
    /// It stays where it is
    Rest,
    /// Whenever it is reached it is pushed toward the camera, to a radius of 60 units, three times
    /// (Fig. 8 of the paper)
    Push,
    /// When it is first reached it jumps 150 mm away
    Jump,
    /// It drifts by 20 mm in every move, ten times
    Drift,
}

fn main() -> ExitCode {
    let options = Options::parse();
    let done = if options.shortcut {
        shortcut::run(&options)
    } else {
        run(&options)
    };
    ended(done)
}

fn run(options: &Options) -> Result<(), Box<dyn Error>> {
    let belief = options.belief.as_deref().map(Belief::load).transpose()?;
    writable_folder(&options.out)?;
    let mut chain = Chain {
        options,
        belief,
        detector: options.detector.build(options.seed)?,
        stages: Stages::default(),
        csv: String::from("run,move,x,y,r,event\n"),
        film: Vec::new(),
        tally: Tally::default(),
    };
    // What has been done until a fault is worth keeping.
    let mut done = Ok(());
    for cell in 0..options.cells {
        chain.tally.begin_cell();
        done = chain.go_for_balls(
            options.seed.wrapping_add(cell as u64),
            options.runs_in(cell),
        );
        if done.is_err() {
            break;
        }
    }
    write_whole(&options.out.join("track.csv"), chain.csv.as_bytes())?;
    if !chain.film.is_empty() {
        write_whole(&options.out.join("track.png"), &animated(&chain.film)?)?;
    }
    println!("{}\n{}", chain.stages, chain.tally);
    println!("results: {}", options.out.display());
    done
}

/// Writes what happened in a run that is worth looking into, for the example `replay`, and says
/// where.
fn keep_run(folder: &Path, name: &str, saved: &SavedRun) -> Result<String, Box<dyn Error>> {
    let file = folder.join(format!("{name}.json"));
    write_whole(&file, saved.to_json().as_bytes())?;
    Ok(format!("for `replay`: {}", file.display()))
}

/// Rendered frames, circle detection, VAL II on a line, and what is written down of all that.
struct Chain<'a> {
    options: &'a Options,
    /// What is known of the camera before.
    belief: Option<Belief>,
    detector: Box<dyn CircleDetector + Send>,
    stages: Stages,
    csv: String,
    film: Vec<GrayImage>,
    tally: Tally,
}

impl Chain<'_> {
    /// In a cell with errors drawn anew: first balls at rest to learn from, then `runs` that count.
    fn go_for_balls(&mut self, seed: u64, runs: usize) -> Result<(), Box<dyn Error>> {
        let options = self.options;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut scene = bright_ball_scene();
        scene.sensor.read_noise = options.noise.unwrap_or(scene.sensor.read_noise);
        let mut rig = Rig::emulated(false, &scene, seed)?;
        let errors = options.level.draw(&mut rng);
        let wrong = errors.apply(&rig.cell().get())?;
        rig.cell().with(|cell| *cell = wrong);

        let workspace = Workspace::paper();
        let mut config = AgentConfig::paper(workspace.search_poses());
        config.max_cycles = 120;
        let settings = HybridSettings::paper();
        let hybrid = match &self.belief {
            Some(belief) => Hybrid::with_belief(settings, belief.clone()),
            None => Hybrid::new(settings),
        };
        let stages = self.stages.clone();
        let mut agent = Agent::with_controller(config, stages.around(hybrid))?;
        for number in 0..options.teach + runs {
            let teaching = number < options.teach;
            if number == options.teach {
                let learned = agent.controller().inner.clone().frozen();
                agent = Agent::with_controller(agent.config().clone(), stages.around(learned))?;
            }
            let (ball, _) = workspace
                .sample_seen_ball(&rig.cell().get(), &mut rng)
                .ok_or("no place of the workspace is in view from a search pose")?;
            rig.place_making_room(&ball)?;
            let fate = if teaching { Fate::Rest } else { options.ball };
            let mut world = World::new(fate, rng.random());
            let counted = (!teaching).then(|| self.tally.runs() + 1);
            let (end, saved) = self.run(&mut agent, &mut rig, &mut world, counted);
            // Whatever it ended with: what was learned until then is kept.
            let learned = agent.controller().inner.belief();
            learned.save(&options.out.join("camera.belief"))?;
            let Some(number) = counted else {
                if let Err(error) = end {
                    let kept = keep_run(&options.out, "teaching", &saved)?;
                    return Err(format!("teaching was broken off: {error}; {kept}").into());
                }
                continue;
            };
            let (contacts, holds) = (rig.contacts(), rig.holds_ball());
            let success = holds && matches!(&end, Ok(Outcome { gave_up: None, .. }));
            self.tally.add(Counted {
                happened: world.has_happened(),
                success,
                moves: end.as_ref().map_or(0, |outcome| outcome.cycles),
                near: saved
                    .log()
                    .events
                    .iter()
                    .filter(|event| event.kind == EventKind::TooNear)
                    .count(),
                collisions: Some(contacts.collisions),
            });
            if !success || contacts.collisions > 0 {
                let kept = keep_run(&options.out, &format!("run-{number:03}"), &saved)?;
                let what = if success { "collision" } else { "not grasped" };
                println!("run {number}: {what}: {end:?}, {contacts:?}; {kept}");
            }
        }
        Ok(())
    }

    /// One ball; `counted` is the number of a run that counts.
    fn run(
        &mut self,
        agent: &mut Agent<Timed<Hybrid>>,
        rig: &mut Rig,
        world: &mut World,
        counted: Option<usize>,
    ) -> (Result<Outcome, AgentError>, SavedRun) {
        let mut saved =
            SavedRun::before(agent, SavedController::of_hybrid(&agent.controller().inner));
        let (shared, mut gripped) = (rig.cell().clone(), false);
        let (csv, film) = (&mut self.csv, &mut self.film);
        let RigParts {
            camera,
            arm,
            mut sensor,
        } = rig.parts();
        let stages = &self.stages;
        let (mut camera, mut detector, mut arm) = (
            stages.around(camera),
            stages.around(&mut *self.detector as &mut dyn CircleDetector),
            stages.around(arm),
        );
        let mut eye = CameraEye::new(&mut camera, &mut detector);
        let end = agent.run_and_learn(&mut eye, &mut arm, &mut *sensor, &mut |event| {
            saved.note(event);
            match &event.kind {
                EventKind::Moved(_) => shared.with(|cell| world.go_on(cell, &event.joints)),
                EventKind::Gripped => gripped = true,
                EventKind::Missed => gripped = false,
                EventKind::Seen(sighting) if !gripped => {
                    if let Some(row) = counted {
                        let f = sighting.features;
                        let _ = writeln!(
                            csv,
                            "{row},{},{:.2},{:.2},{:.2},{}",
                            event.cycle, f.x, f.y, f.r, world.events
                        );
                    }
                }
                _ => {}
            }
            if let (Some(1), Some(frame)) = (counted, event.frame) {
                let (width, height) = (frame.width() / 2, frame.height() / 2);
                film.push(resize(frame, width, height, FilterType::Triangle));
            }
        });
        (end, saved)
    }
}

/// What happens to one ball.
struct World {
    fate: Fate,
    events: usize,
    heading: Option<(f64, f64)>,
    rng: Xoshiro256PlusPlus,
}

impl World {
    fn new(fate: Fate, seed: u64) -> Self {
        Self {
            fate,
            events: 0,
            heading: None,
            rng: Xoshiro256PlusPlus::seed_from_u64(seed),
        }
    }

    /// Whether all that was to happen to the ball has; for a ball that drifts until it is gripped,
    /// whether it has moved at all.
    fn has_happened(&self) -> bool {
        self.events
            >= match self.fate {
                Fate::Rest => 0,
                Fate::Push => 3,
                Fate::Jump | Fate::Drift => 1,
            }
    }

    /// The arm has moved to `joints`.
    fn go_on(&mut self, cell: &mut Cell, joints: &Joints) {
        let workspace = Workspace::paper();
        let reached = cell.features(joints).is_some_and(|f| at_goal(&f));
        match self.fate {
            Fate::Push if reached && self.events < 3 => {
                self.events += usize::from(cell.push_to_radius(joints, 60.0));
            }
            Fate::Jump if reached && self.events < 1 => {
                // To a place where the search can find it again.
                for _ in 0..100 {
                    let Some(place) =
                        workspace.sample_jump(&cell.ball.centre, 0.150, &mut self.rng)
                    else {
                        return;
                    };
                    let mut there = *cell;
                    there.place_ball(place);
                    if workspace
                        .search_poses()
                        .iter()
                        .any(|pose| there.features(pose).is_some())
                    {
                        *cell = there;
                        self.events = 1;
                        return;
                    }
                }
            }
            Fate::Drift if self.events < 10 => {
                let (centre, rng) = (cell.ball.centre, &mut self.rng);
                let (x, y) = *self.heading.get_or_insert_with(|| {
                    // One of the directions in which it stays in the workspace.
                    let ways =
                        (0..100).map(|_| rng.random_range(0.0..std::f64::consts::TAU).sin_cos());
                    let stays = |(x, y): &(f64, f64)| {
                        let mut end = centre;
                        (end.x, end.y) = (end.x + 0.2 * x, end.y + 0.2 * y);
                        workspace.contains(&end)
                    };
                    ways.into_iter().find(stays).unwrap_or_default()
                });
                if x.hypot(y) < 0.5 {
                    return;
                }
                let mut next = centre;
                (next.x, next.y) = (next.x + 0.020 * x, next.y + 0.020 * y);
                cell.place_ball(next);
                self.events += 1;
            }
            _ => {}
        }
    }
}

fn at_goal(f: &Features) -> bool {
    (99.0..=108.0).contains(&f.x) && (74.0..=82.0).contains(&f.y) && (32.0..=34.0).contains(&f.r)
}

/// An animated PNG, three frames a second.
fn animated(frames: &[GrayImage]) -> Result<Vec<u8>, Box<dyn Error>> {
    let first = frames.first().ok_or("no frames")?;
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, first.width(), first.height());
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_animated(u32::try_from(frames.len())?, 0)?;
    encoder.set_frame_delay(1, 3)?;
    let mut writer = encoder.write_header()?;
    for frame in frames {
        writer.write_image_data(frame.as_raw())?;
    }
    writer.finish()?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_belief_that_is_none_leaves_the_results_of_an_earlier_run() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let out = folder.path().to_string_lossy().into_owned();
        let earlier = folder.path().join("track.csv");
        std::fs::write(&earlier, "an earlier run").expect("a file");
        let options = Options::parse_from(["track", "--belief", "no-such-belief", "--out", &out]);
        let error = run(&options)
            .expect_err("there is no such file")
            .to_string();
        assert!(error.contains("no-such-belief"), "{error}");
        let left = std::fs::read_to_string(&earlier).expect("still there");
        assert_eq!(left, "an earlier run");
    }
}
