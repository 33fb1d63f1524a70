//! Compares all controllers on the same balls in the same cells with errors: the paper's learned
//! behaviours, its alternatives, and the hybrid.
//!
//! ```text
//! cargo run --release --example compare_controllers -- --help
//! ```

#![allow(clippy::print_stderr, reason = "a program for a terminal")]

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use grasp_agent::{
    Agent, BehaviourSpec, Controller, Hybrid, HybridSettings, Learned, Percept, SavedRun, Servo,
    ServoLaw as Law, ServoSettings, TaughtGoal,
};
use pipeline_sim::{Ball, Cell, ErrorLevel, MoveForm};
use puma_grasp::{BallDetector, Simulator};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

use example_support::comparison::{self, Row, Tally};
use example_support::files::{writable_folder, write_whole};
use example_support::learning::{ACTIONS, ACTIONS_FINE, TRIALS};
use example_support::plane::{ExactPlane, search_percepts};
use example_support::program::{at_least_one, ended};
use example_support::say;
use world::World;

mod world;

/// Compares controllers on randomly drawn errors of arm and camera and randomly drawn balls, the
/// same for all.
///
/// Features come straight from the geometry. With --full-chain they come from rendered frames and
/// circle detection, and the arm is driven through VAL II; fewer --draws and --starts are enough
/// then.
///
/// A run succeeds if the ball's features reach the goal within 60 moves; with --grip, if the jaws
/// hold the ball at the end. All controllers have the same search, recovery and limits, and none
/// turns a joint farther in one move than the paper's behaviours do. The hybrid first learns each
/// cell by up to --moves moves toward other balls; `hybrid, untaught` does not.
#[derive(Parser, Debug)]
struct Options {
    /// Folder for comparison.csv and comparison.svg
    #[arg(long, value_name = "DIR", default_value = "out/compare")]
    out: PathBuf,

    /// Seed of all random draws
    #[arg(long, value_name = "N", default_value_t = 2000)]
    seed: u64,

    /// Cells per level of errors
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = at_least_one::<u64>)]
    draws: u64,

    /// Balls per cell
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = at_least_one::<u64>)]
    starts: u64,

    /// Moves by which the hybrid learns each cell
    #[arg(long, value_name = "N", default_value_t = 1000)]
    moves: usize,

    /// Levels of errors, separated by commas: none, moderate, heavy, extreme
    #[arg(long, value_name = "LEVEL", value_delimiter = ',', default_values_t = ErrorLevel::ALL)]
    levels: Vec<ErrorLevel>,

    /// Compare only controllers whose name contains this
    #[arg(long, value_name = "TEXT", default_value = "")]
    only: String,

    /// Count a run as success if the jaws hold the ball. Without --full-chain the hand can run into
    /// the ball only with this option
    #[arg(long)]
    grip: bool,

    /// Teach every controller the goal in each cell, with the ball between the jaws
    #[arg(long, conflicts_with = "full_chain")]
    taught_goal: bool,

    /// Render frames, detect the circle in them, and drive an emulated controller by VAL II
    #[arg(long)]
    full_chain: bool,

    /// Circle detector for rendered frames: a-contrario, heuristic, rht, sht
    #[arg(long, value_name = "NAME", default_value_t, requires = "full_chain")]
    detector: BallDetector,

    /// Write every failed or broken-off run to failures/ in the folder, for the example replay
    #[arg(long)]
    logs: bool,
}

fn main() -> ExitCode {
    ended(run(&Options::parse()))
}

fn run(options: &Options) -> Result<(), Box<dyn Error>> {
    writable_folder(&options.out)?;
    let mut rivals = rivals(options)?;
    rivals.retain(|(name, _)| name.contains(&options.only));
    if rivals.is_empty() {
        return Err(format!("no controller has {:?} in its name", options.only).into());
    }
    let failures = Failures {
        folder: options.logs.then(|| options.out.join("failures")),
    };
    let mut rows = Vec::new();
    say!("{}", Row::HEADER);
    for level in &options.levels {
        let (mut tallies, mut unshown) = (vec![Tally::default(); rivals.len()], 0);
        for draw in 0..options.draws {
            let errors = seed_of(options.seed, &[1, draw]);
            let new_world = || World::draw(options, *level, errors);
            let mut world = new_world()?;
            let goal = if options.taught_goal {
                world.teach_goal(seed_of(options.seed, &[5, draw]))?
            } else {
                None
            };
            // A cell in which the goal cannot be shown keeps the paper's.
            unshown += usize::from(options.taught_goal && goal.is_none());
            let untaught = world.agent_config(options);
            let config = goal.map_or_else(
                || untaught.clone(),
                |goal| untaught.clone().with_taught_goal(&goal),
            );
            for ((name, rival), tally) in rivals.iter().zip(&mut tallies) {
                let run_of = |run: String| format!("{level} {name} cell {draw} {run}");
                let controller = match rival {
                    Rival::Hybrid => {
                        let agent =
                            Agent::with_controller(config.clone(), new_hybrid(goal.as_ref()))?;
                        let seed = seed_of(options.seed, &[2, draw]);
                        let (hybrid, fault) = taught_hybrid(&mut world, agent, seed, options.moves);
                        // The hybrid works with what it had learned by then.
                        if let Some(Fault { run, saved, error }) = fault {
                            let run = run_of(format!("teaching {run}"));
                            failures.broken_off(&run, &saved, &*error)?;
                            world = new_world()?;
                        }
                        Box::new(hybrid)
                    }
                    _ => rival.controller(goal.as_ref()),
                };
                tally.begin_draw();
                let mut agent = Agent::with_controller(config.clone(), controller)?;
                for start in 0..options.starts {
                    let seed = seed_of(options.seed, &[3, draw, start]);
                    let run_of_ball = run_of(format!("ball {start}"));
                    let mut saved = SavedRun::before(&agent);
                    let run = world.run(&mut agent, seed, &mut |event| saved.note(event));
                    let (mut trial, collisions) = match run {
                        Ok(Some(run)) => run,
                        Ok(None) => continue,
                        // A run that a fault of arm or camera ends has failed.
                        Err(error) => {
                            failures.broken_off(&run_of_ball, &saved, &*error)?;
                            tally.add_broken_off();
                            world = new_world()?;
                            continue;
                        }
                    };
                    let success = if options.grip {
                        trial.held
                    } else {
                        trial.at_goal.is_some()
                    };
                    if let (Some(cycles), false) = (trial.at_goal, options.grip) {
                        // Moves after reaching the goal are not counted.
                        trial.outcome.cycles = cycles;
                    }
                    tally.add(success, &trial.outcome);
                    if let Some(collisions) = collisions {
                        *tally.collisions.get_or_insert(0) += collisions;
                    }
                    if !success {
                        failures.keep(&run_of_ball, &saved)?;
                    }
                }
            }
        }
        for ((name, _), tally) in rivals.iter().zip(&tallies) {
            let row = Row::new(*level, name, tally);
            say!("{row}");
            rows.push(row);
        }
        if unshown > 0 {
            say!(
                "{level}: in {unshown} of {} cells the ball between the jaws is out of the \
                 camera's \
                 view; the goal there is the untaught one",
                options.draws
            );
        }
    }
    let csv = comparison::csv(&rows);
    write_whole(&options.out.join("comparison.csv"), csv.as_bytes())?;
    let success = if options.grip {
        "grasped"
    } else {
        "at the goal"
    };
    let svg = comparison::plot(&rows, success)?;
    write_whole(&options.out.join("comparison.svg"), svg.as_bytes())?;
    say!("results: {}", options.out.display());
    Ok(())
}

/// Folder of the failed runs, if they are kept.
struct Failures {
    folder: Option<PathBuf>,
}

impl Failures {
    fn keep(&self, run: &str, saved: &SavedRun) -> Result<(), Box<dyn Error>> {
        let Some(folder) = &self.folder else {
            return Ok(());
        };
        writable_folder(folder)?;
        write_whole(
            &folder.join(format!("{run}.json")),
            saved.to_json().as_bytes(),
        )
    }

    /// Reports and keeps a run that was broken off.
    fn broken_off(
        &self,
        run: &str,
        saved: &SavedRun,
        error: &dyn Error,
    ) -> Result<(), Box<dyn Error>> {
        eprintln!("{run}: broken off: {error}");
        self.keep(run, saved)
    }
}

/// A controller in the comparison.
enum Rival {
    Servo(Law, f64),
    Learned(Box<Learned>),
    Untaught,
    /// The hybrid, which learns each cell first.
    Hybrid,
}

impl Rival {
    /// Makes the controller for the taught goal if there is one.
    fn controller(&self, goal: Option<&TaughtGoal>) -> Box<dyn Controller> {
        match (self, goal) {
            (Self::Servo(law, gain), _) => {
                let paper = ServoSettings::paper().with_gain(*gain);
                let goal = goal.map_or(paper.goal, TaughtGoal::features);
                Box::new(Servo::new(*law, ServoSettings { goal, ..paper }))
            }
            (Self::Learned(learned), None) => learned.clone(),
            (Self::Learned(learned), Some(goal)) => Box::new((**learned).clone().shown(goal)),
            (Self::Untaught | Self::Hybrid, _) => Box::new(new_hybrid(goal).frozen()),
        }
    }
}

/// Returns all controllers with their names.
fn rivals(options: &Options) -> Result<Vec<(&'static str, Rival)>, Box<dyn Error>> {
    let servos = [
        ("position-based, gain 1", Law::PositionBased, 1.0),
        ("image-based goal J, gain 1", Law::ImageBasedAtGoal, 1.0),
        ("image-based current J, gain 1", Law::ImageBased, 1.0),
        ("position-based, gain 0.5", Law::PositionBased, 0.5),
        ("image-based goal J, gain 0.5", Law::ImageBasedAtGoal, 0.5),
        ("image-based current J, gain 0.5", Law::ImageBased, 0.5),
        ("fuzzy, gain 1", Law::Fuzzy, 1.0),
        ("fuzzy, gain 0.7", Law::Fuzzy, 0.7),
        ("fuzzy, gain 0.5", Law::Fuzzy, 0.5),
        ("look-ahead", Law::LookAhead, 1.0),
    ];
    let servos = servos.map(|(name, law, gain)| (name, Rival::Servo(law, gain)));
    let learned = learned(options)?.into_iter();
    let learned = learned.map(|(name, learned)| (name, Rival::Learned(Box::new(learned))));
    let hybrids = [
        ("hybrid, untaught", Rival::Untaught),
        ("hybrid", Rival::Hybrid),
    ];
    Ok(servos.into_iter().chain(learned).chain(hybrids).collect())
}

/// Returns the hybrid before its first move.
fn new_hybrid(goal: Option<&TaughtGoal>) -> Hybrid {
    let hybrid = Hybrid::new(HybridSettings::paper());
    match goal {
        Some(goal) => hybrid.shown(goal),
        None => hybrid,
    }
}

/// Learns the paper's controller without errors, in the regression simulator and in the exact
/// plane. Learns nothing if none of them is compared.
fn learned(options: &Options) -> Result<Vec<(&'static str, Learned)>, Box<dyn Error>> {
    const NAMES: [&str; 5] = [
        "Q 90, linear regression",
        "Q 90, rigid regression",
        "Q 540, rigid regression",
        "Q 90, exact plane",
        "Q 540, exact plane",
    ];
    if !NAMES.iter().any(|name| name.contains(&options.only)) {
        return Ok(Vec::new());
    }
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed_of(options.seed, &[0]));
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    let (centering, reaching) = cell.sample_moves(2_500, 0.5, &mut rng)?;
    let rigid = Simulator::fit(&centering, &reaching, MoveForm::Rigid22)?;
    let linear = Simulator::fit(&centering, &reaching, MoveForm::Linear)?;
    let plane = ExactPlane::new(20_000, &mut rng);
    let anywhere: Vec<Percept> = (0..TRIALS).map(|_| rigid.start(&mut rng)).collect();
    let trials = search_percepts(TRIALS, seed_of(options.seed, &[4]));
    let (spec, quiet) = (BehaviourSpec::centering(), &mut |_: &qtable::Record| ());
    let centering = rigid
        .learn(spec, &anywhere, ACTIONS.0, &mut rng, quiet)?
        .behaviour;
    let (paper, fine) = (BehaviourSpec::approaching, BehaviourSpec::approaching_fine);
    let approaching = [
        linear.learn(paper(), &trials, ACTIONS.1, &mut rng, quiet)?,
        rigid.learn(paper(), &trials, ACTIONS.1, &mut rng, quiet)?,
        rigid.learn(fine(), &trials, ACTIONS_FINE, &mut rng, quiet)?,
        plane.learn(paper(), &trials, ACTIONS.1, &mut rng, quiet)?,
        plane.learn(fine(), &trials, ACTIONS_FINE, &mut rng, quiet)?,
    ];
    let both = approaching.map(|lesson| Learned::new(centering.clone(), lesson.behaviour));
    Ok(NAMES.into_iter().zip(both).collect())
}

/// A run of teaching that was broken off.
struct Fault {
    run: u64,
    saved: SavedRun,
    error: Box<dyn Error>,
}

/// Returns the hybrid after at most `moves` moves in `world`, frozen, and the fault that ended
/// teaching early, if any.
fn taught_hybrid(
    world: &mut World,
    mut agent: Agent<Hybrid>,
    seed: u64,
    moves: usize,
) -> (Hybrid, Option<Fault>) {
    let longest = agent.config().max_cycles;
    let (mut made, mut fault) = (0, None);
    for run in 0.. {
        // One more run could take this many moves; a ball that is not found takes none.
        if made + longest > moves || run > moves as u64 {
            break;
        }
        let mut saved = SavedRun::before(&agent);
        match world.run(&mut agent, seed_of(seed, &[run]), &mut |event| {
            saved.note(event);
        }) {
            Ok(trial) => made += trial.map_or(0, |(trial, _)| trial.outcome.cycles),
            Err(error) => {
                fault = Some(Fault { run, saved, error });
                break;
            }
        }
    }
    (agent.into_controller().frozen(), fault)
}

/// Derives a seed for each use.
fn seed_of(seed: u64, uses: &[u64]) -> u64 {
    uses.iter().fold(seed, |seed, part| {
        (seed ^ part.wrapping_mul(0x9e37_79b9_7f4a_7c15))
            .wrapping_mul(0xd134_2543_de82_ef95)
            .rotate_left(29)
    })
}
