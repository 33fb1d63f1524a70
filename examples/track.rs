//! A ball that does not stay where it is, through the full chain: rendered frames, circle detection, VAL II on a line.
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
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, ValueEnum};
use grasp_agent::{
    Agent, AgentConfig, Belief, CameraEye, EventKind, EventLog, Hybrid, HybridSettings, Outcome,
};
use hough_heuristic::{CircleDetector, Features};
use image::GrayImage;
use image::imageops::{FilterType, resize};
use pipeline_sim::{Cell, ErrorLevel, Workspace};
use puma_grasp::{BallDetector, Rig, RigParts, bright_ball_scene};
use puma_val2::Joints;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

use files::{writable_folder, write_whole};
use program::ended;
use stages::{Stages, Timed};

mod cpu;
#[allow(dead_code, reason = "shared with the examples that write single pictures")]
mod files;
mod program;
#[path = "track/shortcut.rs"]
mod shortcut;
mod stages;

/// Track, reach and grasp a ball that is moved, with the self-calibrating hybrid controller.
///
/// The controller makes --teach runs on balls at rest first, to learn the camera; then come the runs that count.
#[derive(Parser, Debug)]
struct Options {
    /// Folder for track.csv, track.png (the first run, animated), camera.belief and the event logs of failures
    #[arg(long, value_name = "DIR", default_value = "out/track")]
    out: PathBuf,

    /// Seed of everything random
    #[arg(long, value_name = "N", default_value_t = 2000)]
    seed: u64,

    /// Runs that count
    #[arg(long, value_name = "N", default_value_t = 10)]
    runs: usize,

    /// Runs to learn from before
    #[arg(long, value_name = "N", default_value_t = 40)]
    teach: usize,

    /// What happens to the ball
    #[arg(long, value_enum, default_value_t = Fate::Push)]
    ball: Fate,

    /// How the circle is found: trusted, heuristic, rht, sht
    #[arg(long, value_name = "NAME", default_value_t)]
    detector: BallDetector,

    /// No frames and no line: features straight from the geometry, in ten cells
    #[arg(long)]
    shortcut: bool,

    /// Noise of the camera in the dark, grey levels; that of the scene unless given
    #[arg(long, value_name = "LEVELS")]
    noise: Option<f64>,

    /// Begin with what an earlier run learned of the camera: its camera.belief
    #[arg(long, value_name = "FILE")]
    belief: Option<PathBuf>,

    /// Errors of the camera: none, moderate, heavy, extreme
    #[arg(long, value_name = "LEVEL", default_value_t = ErrorLevel::Moderate)]
    level: ErrorLevel,
}

/// From the gripper to the ball's centre: the jaws close on the ball up to this far, metres.
const GRASP_TOLERANCE: f64 = 0.010;

/// What happens to the ball.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Fate {
    /// It stays where it is
    Rest,
    /// Whenever it is reached it is pushed toward the camera, to a radius of 60 units, three times (Fig. 8 of the paper)
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
    writable_folder(&options.out)?;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(options.seed);
    let mut detector = options.detector.build(options.seed)?;
    let belief = options.belief.as_deref().map(Belief::load).transpose()?;
    let mut scene = bright_ball_scene();
    scene.sensor.read_noise = options.noise.unwrap_or(scene.sensor.read_noise);
    let mut rig = Rig::emulated(false, &scene, options.seed)?;
    let errors = options.level.draw(&mut rng);
    let wrong = errors.apply(&rig.cell().get())?;
    rig.cell().with(|cell| *cell = wrong);

    let workspace = Workspace::paper();
    let mut config = AgentConfig::paper(workspace.search_poses());
    config.max_cycles = 120;
    let settings = HybridSettings::paper();
    let hybrid = match belief {
        Some(belief) => Hybrid::with_belief(settings, belief),
        None => Hybrid::new(settings),
    };
    let stages = Stages::default();
    let timed = |inner| Timed {
        inner,
        stages: stages.clone(),
    };
    let mut agent = Agent::with_controller(config, timed(hybrid))?;
    let (mut csv, mut film) = (String::from("run,move,x,y,r,event\n"), Vec::new());
    let (mut grasped, mut moves, mut near) = (0, 0, 0);
    for number in 0..options.teach + options.runs {
        let teaching = number < options.teach;
        if number == options.teach {
            let controller = agent.controller().inner.clone().frozen();
            agent = Agent::with_controller(agent.config().clone(), timed(controller))?;
            println!("learned the camera from {number} runs");
        }
        let (ball, _) = workspace
            .sample_seen_ball(&rig.cell().get(), &mut rng)
            .ok_or("no place of the workspace is in view from a search pose")?;
        rig.place(&ball);
        let fate = if teaching { Fate::Rest } else { options.ball };
        let mut world = World::new(fate, rng.random());
        let (shared, mut log) = (rig.cell().clone(), EventLog::default());
        let mut miss = None;
        let RigParts {
            camera,
            arm,
            mut sensor,
        } = rig.parts();
        let (mut camera, mut detector, mut arm) = (
            Timed {
                inner: camera,
                stages: stages.clone(),
            },
            Timed {
                inner: &mut *detector as &mut dyn CircleDetector,
                stages: stages.clone(),
            },
            Timed {
                inner: arm,
                stages: stages.clone(),
            },
        );
        let mut eye = CameraEye::new(&mut camera, &mut detector);
        let end = agent.run_and_learn(&mut eye, &mut arm, &mut *sensor, &mut |event| {
            log.note(event);
            match &event.kind {
                EventKind::Moved(_) => shared.with(|cell| world.go_on(cell, &event.joints)),
                EventKind::TooNear if !teaching => near += 1,
                EventKind::Gripping(_) => miss = Some(shared.with(|cell| cell.grip_miss(&event.joints))),
                EventKind::Seen(sighting) if !teaching => {
                    let (f, row) = (sighting.features, number - options.teach + 1);
                    let _ = writeln!(
                        csv,
                        "{row},{},{:.2},{:.2},{:.2},{}",
                        event.cycle, f.x, f.y, f.r, world.events
                    );
                }
                _ => {}
            }
            if let (true, Some(frame)) = (number == options.teach, event.frame) {
                film.push(resize(
                    frame,
                    frame.width() / 2,
                    frame.height() / 2,
                    FilterType::Triangle,
                ));
            }
        });
        // Whatever it ended with: what was learned until then is kept.
        let learned = agent.controller().inner.belief();
        learned.save(&options.out.join("camera.belief"))?;
        let success = matches!(&end, Ok(Outcome { gave_up: None, .. }))
            && miss.is_some_and(|miss| miss < GRASP_TOLERANCE);
        if teaching {
            end?;
            continue;
        }
        grasped += usize::from(success);
        moves += end.as_ref().map_or(0, |outcome| outcome.cycles);
        if !success {
            let name = format!("failure-{:03}.json", number - options.teach + 1);
            write_whole(&options.out.join(name), &serde_json::to_vec_pretty(&log)?)?;
            println!(
                "run {}: not grasped: {end:?}, {miss:?} m from the ball",
                number - options.teach + 1
            );
        }
    }
    write_whole(&options.out.join("track.csv"), csv.as_bytes())?;
    if !film.is_empty() {
        write_whole(&options.out.join("track.png"), &animated(&film)?)?;
    }
    println!("{stages}");
    say_result(grasped, options.runs, moves, near);
    println!("results: {}", options.out.display());
    Ok(())
}

/// How it went.
fn say_result(grasped: usize, runs: usize, moves: usize, near: usize) {
    let runs = runs.max(1);
    let (low, high) = interval(grasped, runs);
    println!(
        "{grasped} of {runs} grasped ({:.1} %, 95 % interval {low:.1}..{high:.1}), {:.1} moves a run, {near} stops by the proximity sensors",
        100.0 * grasped as f64 / runs as f64,
        moves as f64 / runs as f64
    );
}

/// Wilson's interval of a share, percent.
fn interval(successes: usize, runs: usize) -> (f64, f64) {
    const Z: f64 = 1.96;
    let (n, share) = (runs as f64, successes as f64 / runs as f64);
    let middle = share + 0.5 * Z * Z / n;
    let half = Z * (share * (1.0 - share) / n + 0.25 * Z * Z / (n * n)).sqrt();
    let scale = 100.0 / (1.0 + Z * Z / n);
    (scale * (middle - half), scale * (middle + half))
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
                    let Some(place) = workspace.sample_jump(&cell.ball.centre, 0.150, &mut self.rng) else {
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
                    let ways = (0..100).map(|_| rng.random_range(0.0..std::f64::consts::TAU).sin_cos());
                    let stays = |(x, y): &(f64, f64)| {
                        let mut end = centre;
                        (end.x, end.y) = (end.x + 0.2 * x, end.y + 0.2 * y);
                        workspace.contains(&end)
                    };
                    ways.into_iter().find(stays).unwrap_or_default()
                });
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
