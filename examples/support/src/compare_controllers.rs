//! The program `compare_controllers`, for the example of this name and the Python package.

mod rivals;
mod sweep;

use std::error::Error;
use std::path::PathBuf;
use std::time::Instant;

use clap::Parser;
use grasp_agent::{
    Agent, AgentConfig, Controller, GoalInterval, Hybrid, RunEvent, SavedRun, TaughtGoal,
};
use hough_heuristic::CircleDetector;
use pipeline_sim::{ErrorLevel, Errors, Scene, Workspace};
use puma_grasp::{BallDetector, Rig};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

use crate::comparison::Row;
use crate::files::writable_folder;
use crate::learning::ArmName;
use crate::prelude::*;
use crate::program::on_threads;
use crate::stages::Stages;
use crate::tally::Counted;
use crate::trial::{Trial, TrialCell, ball_in_view, rig_with_errors, run_on_rig, sensors_forbid};

use crate::compare_controllers::rivals::{Rival, new_hybrid, rivals};
use crate::compare_controllers::sweep::{CellRuns, Settings, Shard, Sweep, Tables};

/// Compares controllers on randomly drawn errors of arm and camera and randomly drawn balls, the
/// same for all.
///
/// Features come straight from the geometry. With --full-chain they come from rendered frames and
/// circle detection, and the arm is driven through VAL II; fewer --draws and --starts are enough
/// then.
///
/// A run succeeds if the ball's features reach the goal within 60 moves, or the jaws hold the ball
/// at the end; with --grip, only if they hold it. In some cells with errors the hand itself stands
/// where the ball would show at the goal; these are named after each level, by their geometry.
///
/// All controllers have the same search, recovery and limits, and none turns a joint farther in one
/// move than the paper's behaviours do. The hybrid first learns each cell by up to --moves moves
/// toward other balls; `hybrid, untaught` does not.
///
/// Every finished cell is kept in cells/ in the folder. Several processes share a sweep by --shard
/// and a folder each; --resume goes on after a process was killed; --merge makes one result of all.
#[derive(Parser, Debug)]
pub struct Options {
    /// Folder for comparison.csv and comparison.svg, runs.csv, times.csv and the finished cells
    #[arg(long, value_name = "DIR", default_value = "out/compare")]
    out: PathBuf,
    /// Seed of all random draws
    #[arg(long, value_name = "N", default_value_t = 2000)]
    seed: u64,
    /// Cells per level of errors
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = at_least_one)]
    draws: usize,
    /// Balls per cell
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = at_least_one)]
    starts: usize,
    /// Moves by which the hybrid learns each cell
    #[arg(long, value_name = "N", default_value_t = 1000)]
    moves: usize,
    /// Levels of errors, separated by commas: none, moderate, heavy, extreme
    #[arg(long, value_name = "LEVEL", value_delimiter = ',', default_values_t = ErrorLevel::ALL)]
    levels: Vec<ErrorLevel>,
    /// Odd errors beside the level's, separated by commas: zeros, gears, sag, drag, back-drag,
    /// links, stiction, dead-zone, play, lag, slip (at the fifth ball), mirrored, roll, lens,
    /// noise, missed, outliers; NAME=AMOUNT for another than the usual amount
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    odd: Vec<String>,
    /// Arm of the cells: puma, ur5 or so101. The learned tables and the fuzzy rules are a PUMA's,
    /// and are left out for another arm
    #[arg(long, value_enum, value_name = "ARM", default_value_t = ArmName::Puma)]
    arm: ArmName,
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
    /// Do only part I of N equal parts of the cells; the parts are put together with --merge
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Number of threads (default: one for each core)
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    threads: Option<usize>,
    /// Keep the finished cells that are in the folder, and do the others
    #[arg(long)]
    resume: bool,
    /// Merge the results in these folders, and take all settings from them
    #[arg(long, value_name = "DIR", num_args = 1.., conflicts_with_all = ["shard", "resume"])]
    merge: Vec<PathBuf>,
}

/// Ball of each controller, from 0, before which a camera slips.
const SLIP_AT: u64 = 4;

/// Runs the program.
///
/// # Errors
/// Wrong options, results of another sweep, and files that cannot be read or written.
pub fn run(options: &Options) -> Outcome {
    // Refuses unknown names before anything is learned.
    with_odd(Errors::none(), options)?;
    let _lock = lock_folder(&options.out)?;
    if !options.merge.is_empty() {
        return merge(options);
    }
    if options.full_chain && options.arm != ArmName::Puma {
        return Err("--full-chain drives a PUMA: leave --arm away".into());
    }
    let rivals = rivals(options)?;
    let sweep = Sweep::begin(&options.out, settings(options, &rivals), options.resume)?;
    let mut tables = Tables::create(&sweep)?;
    if !options.odd.is_empty() {
        say!("odd errors: {}", options.odd.join(", "));
    }
    let in_shard = |level: usize, draw: usize| {
        let cell = level * options.draws + draw;
        options.shard.is_none_or(|shard| shard.has(cell))
    };
    let levels = options.levels.iter().enumerate();
    let levels = levels.map(|(number, level)| {
        let draws = (0..options.draws).filter(|draw| in_shard(number, *draw));
        (*level, draws.collect::<Vec<_>>())
    });
    let levels: Vec<_> = levels.collect();
    let count = levels.iter().map(|(_, draws)| draws.len()).sum::<usize>();
    if options.shard.is_some() {
        say!("{count} of {} cells", options.levels.len() * options.draws);
    }
    say!("{}", Row::HEADER);
    let bar = progress_bar(count as u64, "cells", false);
    let mut done = Ok(());
    for (level, draws) in &levels {
        let mut cells = Vec::new();
        done = on_threads(options.threads, draws.len(), &mut cells, |index| {
            let draw = draws[index];
            let cell = match sweep.finished(*level, draw)? {
                Some(cell) => cell,
                None => {
                    let cell = cell_runs(options, *level, draw, &rivals)?;
                    sweep.keep(*level, draw, &cell)?;
                    cell
                }
            };
            bar.inc(1);
            Ok((draw, cell))
        });
        bar.suspend(|| tables.level(*level, &cells))?;
        let unshown = cells.iter().filter(|(_, cell)| cell.unshown).count();
        if unshown > 0 {
            bar.suspend(|| {
                say!(
                    "{level}: in {unshown} of {} cells the ball between the jaws is out of the \
                     camera's view; the goal there is the untaught one",
                    draws.len()
                );
            });
        }
        // The rows of a level that was broken off are of the cells until then.
        if done.is_err() {
            break;
        }
    }
    bar.finish_and_clear();
    let plotted = tables.plot();
    say!("results: {}", options.out.display());
    done.and(plotted)
}

/// Makes one result of those in several folders.
fn merge(options: &Options) -> Outcome {
    let merged = Sweep::merge(&options.merge, &options.out)?;
    let mut tables = Tables::create(&merged)?;
    say!("{}", Row::HEADER);
    for level in merged.levels()? {
        let mut cells = Vec::new();
        for draw in 0..merged.settings.draws {
            cells.extend(merged.finished(level, draw)?.map(|cell| (draw, cell)));
        }
        tables.level(level, &cells)?;
    }
    tables.plot()?;
    say!("results: {}", options.out.display());
    Ok(())
}

/// Returns the settings on which the results depend.
fn settings(options: &Options, rivals: &[(&'static str, Rival)]) -> Settings {
    Settings {
        version: env!("CARGO_PKG_VERSION").into(),
        seed: options.seed,
        draws: options.draws,
        starts: options.starts,
        moves: options.moves,
        levels: options.levels.iter().map(ToString::to_string).collect(),
        odd: options.odd.clone(),
        arm: format!("{:?}", options.arm).to_lowercase(),
        grip: options.grip,
        taught_goal: options.taught_goal,
        full_chain: options.full_chain,
        detector: options.detector.to_string(),
        controllers: rivals.iter().map(|(name, _)| (*name).into()).collect(),
    }
}

/// Lets all controllers go for the balls of a cell.
fn cell_runs(
    options: &Options,
    level: ErrorLevel,
    draw: usize,
    rivals: &[(&'static str, Rival)],
) -> Outcome<CellRuns> {
    let begun = Instant::now();
    let cell = DrawnCell::new(options, level, draw as u64)?;
    let mut world = cell.world()?;
    let forbidden = world.forbids(&cell.config.goal);
    let runs = rivals
        .iter()
        .map(|(name, rival)| cell.runs(name, rival, &mut world));
    let runs = runs.collect::<Outcome<Vec<_>>>()?;
    let unshown = options.taught_goal && cell.goal.is_none();
    Ok(CellRuns::new(&runs, [unshown, forbidden], begun))
}

/// A cell with drawn errors, in which all controllers are tried.
struct DrawnCell<'a> {
    options: &'a Options,
    level: ErrorLevel,
    draw: u64,
    /// The goal shown in the cell. A cell in which it cannot be shown keeps the paper's.
    goal: Option<TaughtGoal>,
    config: AgentConfig,
    nominal: TrialCell,
}

impl<'a> DrawnCell<'a> {
    fn new(options: &'a Options, level: ErrorLevel, draw: u64) -> Outcome<Self> {
        let mut cell = Self {
            options,
            level,
            draw,
            goal: None,
            config: AgentConfig::paper(Workspace::paper().search_poses()),
            nominal: TrialCell::with_errors(Errors::none(), options.arm)?,
        };
        cell.config = cell.nominal.agent_config();
        cell.config.lift = cell.config.lift.filter(|_| options.grip);
        if options.taught_goal
            && let World::Shortcut(world) = cell.world()?
        {
            cell.goal = world.teach_goal(seed_of(options.seed, &[5, draw]))?;
        }
        if let Some(goal) = &cell.goal {
            cell.config = cell.config.with_taught_goal(goal);
        }
        Ok(cell)
    }

    /// Returns the cell as it was drawn.
    fn world(&self) -> Outcome<World> {
        World::draw(
            self.options,
            self.level,
            seed_of(self.options.seed, &[1, self.draw]),
        )
    }

    /// Lets a controller go for all balls. A run that a fault of arm or camera ends has failed.
    fn runs(&self, name: &str, rival: &Rival, world: &mut World) -> Outcome<Vec<Counted>> {
        let (options, draw) = (self.options, self.draw);
        let slips = options.odd.iter().any(|odd| odd.starts_with("slip"));
        if slips {
            *world = self.world()?;
        }
        let controller = match rival {
            Rival::Hybrid => Box::new(self.taught_hybrid(name, world)?),
            _ => rival.controller(&self.nominal, self.goal.as_ref()),
        };
        let mut agent = Agent::with_controller(self.config.clone(), controller)?;
        let mut runs = Vec::new();
        for start in 0..options.starts as u64 {
            go_on()?;
            if slips && start == SLIP_AT {
                world.slip();
            }
            let mut saved = SavedRun::before(&agent);
            let seed = seed_of(options.seed, &[3, draw, start]);
            let run = world.run(&mut agent, seed, &mut |event| saved.note(event));
            let counted = match run {
                Ok(None) => continue,
                Ok(Some(trial)) => Counted {
                    success: if options.grip {
                        trial.held
                    } else {
                        trial.at_goal.is_some() || trial.held
                    },
                    // Moves after reaching the goal are not counted.
                    moves: match trial.at_goal {
                        Some(moves) if !options.grip => moves,
                        _ => trial.outcome.cycles,
                    },
                    losses: trial.outcome.losses,
                    collisions: trial.collisions,
                    ..Counted::default()
                },
                Err(error) => {
                    self.report(name, &format!("ball {start}"), &*error);
                    *world = self.world()?;
                    if slips && start >= SLIP_AT {
                        world.slip();
                    }
                    Counted::default()
                }
            };
            if !counted.success {
                self.keep(name, &format!("ball {start}"), &saved)?;
            }
            runs.push(counted);
        }
        Ok(runs)
    }

    /// Returns the hybrid after at most `--moves` moves in `world`, frozen. If a fault ends its
    /// teaching, it works with what it has learned by then.
    fn taught_hybrid(&self, name: &str, world: &mut World) -> Outcome<Hybrid> {
        let hybrid = new_hybrid(&self.nominal, self.goal.as_ref());
        let mut agent = Agent::with_controller(self.config.clone(), hybrid)?;
        let (longest, moves) = (self.config.max_cycles, self.options.moves);
        let seed = seed_of(self.options.seed, &[2, self.draw]);
        let (mut made, mut run) = (0, 0);
        // One more run could take the longest; a ball that is not found takes no move.
        while made + longest <= moves && run <= moves as u64 {
            go_on()?;
            let mut saved = SavedRun::before(&agent);
            let seed = seed_of(seed, &[run]);
            match world.run(&mut agent, seed, &mut |event| saved.note(event)) {
                Ok(trial) => made += trial.map_or(0, |trial| trial.outcome.cycles),
                Err(error) => {
                    let run = format!("teaching {run}");
                    self.report(name, &run, &*error);
                    self.keep(name, &run, &saved)?;
                    *world = self.world()?;
                    break;
                }
            }
            run += 1;
        }
        Ok(agent.into_controller().frozen())
    }

    #[allow(clippy::print_stderr, reason = "a program for a terminal")]
    fn report(&self, name: &str, run: &str, error: &dyn Error) {
        eprintln!("{}: broken off: {error}", self.run_name(name, run));
    }

    /// Writes a failed run if asked for.
    fn keep(&self, name: &str, run: &str, saved: &SavedRun) -> Outcome {
        if !self.options.logs {
            return Ok(());
        }
        let folder = self.options.out.join("failures");
        writable_folder(&folder)?;
        let file = folder.join(format!("{}.json", self.run_name(name, run)));
        write_whole(&file, saved.to_json().as_bytes())
    }

    fn run_name(&self, name: &str, run: &str) -> String {
        format!("{} {name} cell {} {run}", self.level, self.draw)
    }
}

/// Adds the odd errors asked for.
fn with_odd(errors: Errors, options: &Options) -> Outcome<Errors> {
    let mut odd = options.odd.iter();
    Ok(odd.try_fold(errors, |errors, odd| errors.with_odd(odd))?)
}

/// The devices in a cell with drawn errors.
enum World {
    /// Features straight from the geometry, an arm that moves at once.
    Shortcut(Box<TrialCell>),
    /// Rendered frames, circle detection, VAL II on a line.
    Chain(Box<Rig>, Box<dyn CircleDetector + Send>, Box<Errors>),
}

impl World {
    fn draw(options: &Options, level: ErrorLevel, seed: u64) -> Outcome<Self> {
        let drawn = level.draw(&mut Xoshiro256PlusPlus::seed_from_u64(seed));
        let errors = with_odd(drawn, options)?;
        if options.full_chain {
            let rig = rig_with_errors(&errors, &Scene::bright_ball(), seed)?;
            let detector = options.detector.build(seed)?;
            return Ok(Self::Chain(Box::new(rig), detector, Box::new(errors)));
        }
        let cell = TrialCell::with_errors(errors, options.arm)?;
        let cell = if options.grip {
            cell
        } else {
            cell.without_bodies()
        };
        Ok(Self::Shortcut(Box::new(cell)))
    }

    /// Lets the camera slip in its mount.
    fn slip(&mut self) {
        match self {
            Self::Shortcut(cell) => cell.slip(),
            Self::Chain(rig, _, errors) => rig.cell().with(|cell| errors.slip_camera(cell)),
        }
    }

    /// Returns `true` if the hand itself keeps the ball from the goal.
    fn forbids(&self, goal: &[GoalInterval]) -> bool {
        match self {
            Self::Shortcut(cell) => cell.forbids(goal),
            Self::Chain(rig, ..) => sensors_forbid(&rig.cell().get(), goal),
        }
    }

    /// Lets `agent` go for the ball that `seed` places; `None` if no ball can be seen.
    fn run<C: Controller>(
        &mut self,
        agent: &mut Agent<C>,
        seed: u64,
        observe: &mut dyn FnMut(&RunEvent<'_>),
    ) -> Outcome<Option<Trial>> {
        let (rig, detector) = match self {
            Self::Shortcut(cell) => return Ok(cell.run(agent, seed, &mut |_, _| (), observe)?),
            Self::Chain(rig, detector, _) => (rig, detector),
        };
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let Ok(ball) = ball_in_view(rig.cell(), &mut rng) else {
            return Ok(None);
        };
        rig.clear_for(Workspace::paper().search_poses()[3])?;
        rig.place(&ball)?;
        let trial = run_on_rig(rig, &mut **detector, agent, &Stages::default(), observe)?;
        Ok(Some(trial))
    }
}

/// Derives a seed for each use.
fn seed_of(seed: u64, uses: &[u64]) -> u64 {
    uses.iter().fold(seed, |seed, part| {
        (seed ^ part.wrapping_mul(0x9e37_79b9_7f4a_7c15))
            .wrapping_mul(0xd134_2543_de82_ef95)
            .rotate_left(29)
    })
}
