//! Follows and grasps a moving ball through the full chain: rendered frames, circle detection, VAL
//! II.
//!
//! ```text
//! cargo run --release --example track -- --help
//! ```

use std::path::PathBuf;

use clap::Parser;
use example_support::files::animated;
use example_support::overlay::Overlay;
use example_support::prelude::*;
use example_support::program::stopped;
use example_support::real::RealOptions;
use example_support::stages::{Stages, Timed};
use example_support::tally::{Counted, Tally};
use example_support::trial::{Trial, TrialCell, ball_in_view, make_errors, run_on_rig};
use grasp_agent::{
    Agent, AgentConfig, AgentError, Belief, EventKind, Hybrid, HybridSettings, RunEvent, SavedRun,
};
use hough_heuristic::CircleDetector;
use image::RgbImage;
use image::imageops::{FilterType, resize};
use indicatif::ProgressBar;
use pipeline_sim::{Cell, ErrorLevel, Scene, Workspace};
use puma_grasp::{BallDetector, Rig};
use puma_val2::Joints;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

use world::{Fate, World};

mod world;

/// Tracks, reaches and grasps a ball that is moved, with the self-calibrating hybrid controller.
///
/// In each cell the controller first makes --teach runs on resting balls to learn the camera; then
/// come the runs that count. A grasp counts if the jaws hold the ball and the controller reports
/// it. Grasps before anything happened to the ball are reported apart; a failure before that
/// counts. With --camera the ball is a real one, which rests where it is put.
#[derive(Parser, Debug)]
struct Options {
    /// Folder for track.csv, track.png (the first run, animated), camera.belief, and the runs that
    /// failed or collided, for the example replay
    #[arg(long, value_name = "DIR", default_value = "out/track")]
    out: PathBuf,
    /// Seed of all random draws
    #[arg(long, value_name = "N", default_value_t = 2000)]
    seed: u64,
    /// Runs that count
    #[arg(long, value_name = "N", default_value_t = 10)]
    runs: usize,
    /// Runs to learn from first, in each cell
    #[arg(long, value_name = "N", default_value_t = 40)]
    teach: usize,
    /// Number of cells that the runs are spread over, each with errors drawn anew
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = at_least_one)]
    cells: usize,
    /// Movement of the ball [default: push, with --camera rest]
    #[arg(long, value_enum)]
    ball: Option<Fate>,
    #[command(flatten)]
    real: RealOptions,
    /// Circle detector: a-contrario, heuristic, rht, sht
    #[arg(
        long,
        value_name = "NAME",
        default_value_t,
        conflicts_with = "shortcut"
    )]
    detector: BallDetector,
    /// Use features straight from the geometry, without frames and VAL II. Only failed runs are
    /// written, and collisions are not counted
    #[arg(long, conflicts_with_all = ["port", "tcp", "camera"])]
    shortcut: bool,
    /// Read noise of the camera, gray levels [default: that of the scene]
    #[arg(long, value_name = "LEVELS", conflicts_with = "shortcut")]
    noise: Option<f64>,
    /// Start from the camera.belief of an earlier run; the --teach runs go on learning from it
    #[arg(long, value_name = "FILE", conflicts_with = "shortcut")]
    belief: Option<PathBuf>,
    /// Errors of the camera: none, moderate, heavy, extreme
    #[arg(long, value_name = "LEVEL", default_value_t = ErrorLevel::Moderate)]
    level: ErrorLevel,
}

impl Options {
    /// Returns the movement of the ball.
    fn fate(&self) -> Fate {
        let usual = if self.real.camera.is_some() {
            Fate::Rest
        } else {
            Fate::Push
        };
        self.ball.unwrap_or(usual)
    }

    /// Refuses what a real arm or ball cannot do.
    fn check(&self) -> Result<(), String> {
        self.real.check()?;
        if self.real.camera.is_some() && self.fate() != Fate::Rest {
            return Err("a real ball rests where it is put: leave out --ball".into());
        }
        if (self.real.port.is_some() || self.real.tcp.is_some()) && self.cells > 1 {
            return Err("the arm on the line stands in one cell: leave out --cells".into());
        }
        Ok(())
    }

    /// Returns the number of runs in this cell, the first being 0.
    fn runs_in(&self, cell: usize) -> usize {
        (self.runs + self.cells - 1 - cell) / self.cells
    }
}

fn main() -> ExitCode {
    start(run)
}

fn run(options: &Options) -> Outcome {
    options.check()?;
    let belief = options.belief.as_deref().map(Belief::load).transpose()?;
    let _lock = lock_folder(&options.out)?;
    let path = options.out.join("track.csv");
    let csv = (!options.shortcut).then(|| Table::create(path, "run,move,x,y,r,event"));
    let balls = options.runs + options.cells * options.teach;
    let mut runs = Runs {
        options,
        belief,
        detector: None,
        stages: Stages::default(),
        csv: csv.transpose()?,
        film: Vec::new(),
        tally: Tally::default(),
        bar: progress_bar(balls as u64, "balls", false),
    };
    // The results until a fault are kept.
    let done = (0..options.cells).try_for_each(|cell| runs.in_cell(cell));
    runs.bar.finish_and_clear();
    if options.shortcut {
        say!("{}", runs.tally);
        return done;
    }
    let film = if runs.film.is_empty() {
        Ok(())
    } else {
        let film = animated(&runs.film, (1, 3), (1, 3))?;
        write_whole(&options.out.join("track.png"), &film)
    };
    say!("{}\n{}", runs.stages, runs.tally);
    say!("results: {}", options.out.display());
    done.and(film)
}

type Detector = Box<dyn CircleDetector + Send>;

/// A cell with drawn errors.
enum Place {
    /// Features straight from the geometry, an arm that moves at once.
    Shortcut(Box<TrialCell>),
    /// Frames, circle detection, VAL II on a line; and the generator of the balls.
    Chain(Box<Rig>, Xoshiro256PlusPlus),
}

impl Place {
    fn draw(options: &Options, seed: u64, detector: &mut Option<Detector>) -> Outcome<Self> {
        if options.shortcut {
            let cell = TrialCell::draw(options.level, seed)?;
            return Ok(Self::Shortcut(Box::new(cell)));
        }
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut scene = Scene::bright_ball();
        scene.sensor.read_noise = options.noise.unwrap_or(scene.sensor.read_noise);
        let errors = options.level.draw(&mut rng);
        let (rig, for_its_frames) = options.real.open(options.detector, false, &scene, seed)?;
        detector.get_or_insert(for_its_frames);
        if rig.is_simulated() {
            make_errors(&rig, &errors)?;
        }
        Ok(Self::Chain(Box::new(rig), rng))
    }
}

/// All runs, and the records of those that count.
struct Runs<'a> {
    options: &'a Options,
    /// Knowledge of the camera from an earlier run.
    belief: Option<Belief>,
    /// Detector of all cells, once there are frames.
    detector: Option<Detector>,
    stages: Stages,
    csv: Option<Table>,
    film: Vec<RgbImage>,
    tally: Tally,
    bar: ProgressBar,
}

impl Runs<'_> {
    /// Makes the runs in one cell: first on balls at rest to learn from, then those that count.
    fn in_cell(&mut self, number: usize) -> Outcome {
        let options = self.options;
        self.tally.cells.push(Vec::new());
        let seed = options.seed.wrapping_add(number as u64);
        let mut place = Place::draw(options, seed, &mut self.detector)?;
        let config = AgentConfig {
            max_cycles: 120,
            ..AgentConfig::paper(Workspace::paper().search_poses())
        };
        let goal = options.real.goal(&config)?;
        let config = options.real.fit(config, goal.as_ref());
        let mut settings = HybridSettings::paper();
        settings.nominal.ball_radius = options.real.ball_radius / 1000.0;
        settings.goal.r *= options.real.ball_size();
        let hybrid = match &self.belief {
            Some(belief) => Hybrid::with_belief(settings, belief.clone()),
            None => Hybrid::new(settings),
        };
        let stages = self.stages.clone();
        let mut agent = Agent::with_controller(config, stages.around(hybrid))?;
        for ball in 0..options.teach + options.runs_in(number) {
            go_on()?;
            let teaching = ball < options.teach;
            if ball == options.teach {
                let learned = agent.controller().inner.clone().frozen();
                agent = Agent::with_controller(agent.config().clone(), stages.around(learned))?;
            }
            let fate = if teaching { Fate::Rest } else { options.fate() };
            let run = self.tally.runs().count() + 1;
            let mut saved = SavedRun::before(&agent);
            let (end, happened, collisions) = match &mut place {
                Place::Shortcut(cell) => {
                    let seed = seed.wrapping_mul(1_000).wrapping_add(ball as u64);
                    let mut world = World::new(fate, ball as u64);
                    let end = on_shortcut(cell, &mut agent, seed, &mut world, &mut saved);
                    (end.transpose(), world.has_happened(), None)
                }
                Place::Chain(rig, rng) => {
                    options.real.next_ball(rig, ball + 1)?;
                    rig.place(&ball_in_view(rig.cell(), rng)?)?;
                    let mut world = World::new(fate, rng.random());
                    let counted = (!teaching).then_some(run);
                    let end = self.on_chain(rig, &mut agent, &mut world, counted, &mut saved);
                    // Keeps what was learned, however the run ended.
                    let learned = agent.controller().inner.belief();
                    learned.save(&options.out.join("camera.belief"))?;
                    (
                        Some(end?),
                        world.has_happened(),
                        rig.is_simulated().then(|| rig.contacts().collisions),
                    )
                }
            };
            self.bar.inc(1);
            let Some(end) = end else {
                continue;
            };
            if teaching {
                if let Err(error) = end {
                    let kept = keep_run(&options.out.join("teaching.json"), &saved)?;
                    return Err(format!("teaching was broken off: {error}; {kept}").into());
                }
                continue;
            }
            let run_file = options.out.join(format!("run-{run:03}.json"));
            if end.is_err() && stopped() {
                let kept = keep_run(&run_file, &saved)?;
                return Err(
                    format!("run {run} was broken off: stopped by a signal; {kept}").into(),
                );
            }
            let trial = end.as_ref().ok();
            let success = trial.is_some_and(|trial| trial.held && trial.outcome.gave_up.is_none());
            let counted = Counted {
                too_early: !happened,
                success,
                moves: trial.map_or(0, |trial| trial.outcome.cycles),
                near: trial.map_or(0, |trial| trial.near),
                collisions,
                ..Counted::default()
            };
            self.tally.cells[number].push(counted);
            let collisions = collisions.unwrap_or(0);
            if !success || collisions > 0 {
                let kept = keep_run(&run_file, &saved)?;
                let reason = match &end {
                    Err(error) => error.to_string(),
                    Ok(_) if success => "grasped".into(),
                    Ok(trial) => trial.outcome.gave_up.map_or_else(
                        || "not grasped: the jaws hold no ball, though none is seen".into(),
                        |reason| format!("not grasped: {reason}"),
                    ),
                };
                let words = format!("run {run}: {reason}, {collisions} collisions; {kept}");
                self.bar.suspend(|| say!("{words}"));
            }
        }
        Ok(())
    }

    /// Lets `agent` go for the ball that is placed in the rig; `counted` is the number of a run
    /// that counts. Fails if a row cannot be written.
    fn on_chain(
        &mut self,
        rig: &mut Rig,
        agent: &mut Agent<Timed<Hybrid>>,
        world: &mut World,
        counted: Option<usize>,
        saved: &mut SavedRun,
    ) -> Outcome<Result<Trial, AgentError>> {
        let detector = self.detector.as_mut().ok_or("no detector")?;
        let (shared, mut gripped) = (rig.cell().clone(), false);
        let (csv, film, mut written) = (&mut self.csv, &mut self.film, Ok(()));
        let mut observe = |event: &RunEvent<'_>| {
            saved.note(event);
            match &event.kind {
                EventKind::Moved(_) => shared.with(|cell| world.go_on(cell, &event.joints)),
                EventKind::Gripped => gripped = true,
                EventKind::Missed => gripped = false,
                EventKind::Seen(sighting) if !gripped && written.is_ok() => {
                    if let (Some(run), Some(csv)) = (counted, &mut *csv) {
                        let (f, step, events) = (sighting.features, event.cycle, world.events);
                        let (x, y, r) = (f.x, f.y, f.r);
                        written =
                            csv.row(format_args!("{run},{step},{x:.2},{y:.2},{r:.2},{events}"));
                    }
                }
                _ => {}
            }
            if let (Some(1), Some(frame)) = (counted, event.frame) {
                let mut overlay = Overlay::new(frame);
                if let EventKind::Seen(sighting) = event.kind {
                    overlay.circle(&sighting.features.to_circle(frame.width()));
                }
                let (width, height) = (frame.width() / 2, frame.height() / 2);
                let picture = overlay.into_image();
                film.push(resize(&picture, width, height, FilterType::Triangle));
            }
        };
        let end = run_on_rig(rig, &mut **detector, agent, &self.stages, &mut observe);
        written.map(|()| end)
    }
}

/// Lets `agent` go for the ball that `seed` places in a cell without frames or line; `None` if it
/// is out of view.
fn on_shortcut(
    cell: &TrialCell,
    agent: &mut Agent<Timed<Hybrid>>,
    seed: u64,
    world: &mut World,
    saved: &mut SavedRun,
) -> Result<Option<Trial>, AgentError> {
    // Nothing happens to the ball before it is seen, nor when it is looked at again without a move,
    // nor in the jaws.
    let (mut seen, mut looked_from) = (false, None);
    let mut go_on = |cell: &mut Cell, joints: &Joints| {
        let moved = looked_from.replace(*joints) != Some(*joints);
        if seen && moved && cell.held.is_none() {
            world.go_on(cell, joints);
        }
        seen |= cell.features(joints).is_ok();
    };
    cell.run(agent, seed, &mut go_on, &mut |event| saved.note(event))
}
