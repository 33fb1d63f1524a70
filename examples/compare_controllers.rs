//! Every controller on the same balls in the same wrong cells: the paper's learned behaviours, its rivals, and the hybrid.
//!
//! ```text
//! cargo run --release --example compare_controllers -- --help
//! ```

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use grasp_agent::{
    Agent, AgentConfig, BehaviourSpec, Controller, Fuzzy, Hybrid, HybridSettings, ImageBased, JacobianAt,
    Learned, LookAhead, PositionBased, ServoSettings,
};
use pipeline_sim::{Ball, Cell, ErrorLevel, ReachForm, sample_moves};
use puma_grasp::{ExactPlane, Simulator, TrialCell, learn};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

use files::{writable_folder, write_whole};
use table::{Row, Tally};

#[allow(dead_code, reason = "shared with the examples that write pictures")]
mod files;
#[path = "compare_controllers/table.rs"]
mod table;

/// Compare controllers on the feature shortcut: drawn errors of arm and camera, drawn balls, the same for all.
///
/// A run succeeds when the ball stands at the goal within 60 moves. All controllers have the same search, recovery and limits, and none
/// turns a joint farther in one move than the largest step of the paper's behaviours. The hybrid first makes up to --moves moves in each drawn
/// cell, on other balls than those it is compared on; `hybrid, untaught` makes none.
#[derive(Parser, Debug)]
struct Options {
    /// Folder for comparison.csv and comparison.svg
    #[arg(long, value_name = "DIR", default_value = "out/compare")]
    out: PathBuf,

    /// Seed of everything random
    #[arg(long, value_name = "N", default_value_t = 2000)]
    seed: u64,

    /// Cells to draw for each level of errors
    #[arg(long, value_name = "N", default_value_t = 16)]
    draws: u64,

    /// Balls to go for in each cell
    #[arg(long, value_name = "N", default_value_t = 30)]
    starts: u64,

    /// Moves that the hybrid may make in each cell to learn it
    #[arg(long, value_name = "N", default_value_t = 1000)]
    moves: usize,

    /// Levels of errors: none, moderate, heavy, extreme
    #[arg(long, value_name = "LEVEL", value_delimiter = ',', default_values_t = ErrorLevel::ALL)]
    levels: Vec<ErrorLevel>,

    /// Only controllers whose name contains this
    #[arg(long, value_name = "TEXT", default_value = "")]
    only: String,

    /// Let the hand have its bodies: it can run into the ball, and success is the ball in the jaws
    #[arg(long)]
    grip: bool,
}

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
    writable_folder(&options.out)?;
    let rivals: Vec<Rival> = rivals(options)?
        .into_iter()
        .filter(|rival| rival.name.contains(&options.only))
        .collect();
    let mut rows = Vec::new();
    println!("{}", Row::HEADER);
    for level in &options.levels {
        let mut tallies = vec![Tally::default(); rivals.len()];
        for draw in 0..options.draws {
            let cell = TrialCell::draw(*level, seed_of(options.seed, &[1, draw]))?;
            let cell = if options.grip { cell } else { cell.without_bodies() };
            for (rival, tally) in rivals.iter().zip(&mut tallies) {
                let made = (rival.make)(&cell, seed_of(options.seed, &[2, draw]), options.moves)?;
                tally.begin_draw();
                let mut agent = Agent::with_controller(AgentConfig::paper(cell.search_poses()), made)?;
                for start in 0..options.starts {
                    let seed = seed_of(options.seed, &[3, draw, start]);
                    if let Some(result) = cell.run(&mut agent, seed, &mut |_, _| (), &mut |_| ())? {
                        let success = if options.grip { result.held } else { result.reached };
                        tally.add(success, &result.outcome);
                    }
                }
            }
        }
        for (rival, tally) in rivals.iter().zip(&tallies) {
            let row = Row::new(*level, &rival.name, tally);
            println!("{row}");
            rows.push(row);
        }
    }
    write_whole(&options.out.join("comparison.csv"), table::csv(&rows).as_bytes())?;
    write_whole(
        &options.out.join("comparison.svg"),
        table::plot(&rows)?.as_bytes(),
    )?;
    println!("results: {}", options.out.display());
    Ok(())
}

/// A controller in the comparison, and how it is made for a cell: with that cell to learn in, a seed, and the moves it may make.
struct Rival {
    name: String,
    make: Make,
}

type Made = Result<Box<dyn Controller>, Box<dyn Error>>;
type Make = Box<dyn Fn(&TrialCell, u64, usize) -> Made>;

fn rivals(options: &Options) -> Result<Vec<Rival>, Box<dyn Error>> {
    let servo = ServoSettings::paper();
    let fixed = |name: &str, make: Box<dyn Fn() -> Box<dyn Controller>>| Rival {
        name: name.into(),
        make: Box::new(move |_, _, _| Ok(make())),
    };
    let mut rivals = Vec::new();
    for (gain, tag) in [(1.0, "gain 1"), (0.5, "gain 0.5")] {
        let servo = servo.with_gain(gain);
        rivals.push(fixed(
            &format!("position-based, {tag}"),
            Box::new(move || Box::new(PositionBased::new(servo))),
        ));
        for (at, which) in [(JacobianAt::Goal, "goal J"), (JacobianAt::Now, "current J")] {
            let name = format!("image-based {which}, {tag}");
            rivals.push(fixed(
                &name,
                Box::new(move || Box::new(ImageBased::new(servo, at))),
            ));
        }
    }
    for (gain, tag) in [(1.0, "gain 1"), (0.7, "gain 0.7"), (0.5, "gain 0.5")] {
        let servo = servo.with_gain(gain);
        rivals.push(fixed(
            &format!("fuzzy, {tag}"),
            Box::new(move || Box::new(Fuzzy::new(servo))),
        ));
    }
    rivals.push(fixed(
        "look-ahead",
        Box::new(move || Box::new(LookAhead::new(servo))),
    ));
    for (name, learned) in learned(options)? {
        rivals.push(fixed(name, Box::new(move || Box::new(learned.clone()))));
    }
    let untaught = Hybrid::new(HybridSettings::paper()).frozen();
    rivals.push(fixed(
        "hybrid, untaught",
        Box::new(move || Box::new(untaught.clone())),
    ));
    rivals.push(Rival {
        name: "hybrid".into(),
        make: Box::new(taught_hybrid),
    });
    Ok(rivals)
}

/// The paper's controller, learned in simulation without errors: in the regression simulator, and in the exact plane.
fn learned(options: &Options) -> Result<Vec<(&'static str, Learned)>, Box<dyn Error>> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed_of(options.seed, &[0]));
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    let (centring, reaching) = sample_moves(&cell, 2_500, 0.5, &mut rng);
    let rigid = Simulator::fit(&centring, &reaching, ReachForm::Rigid22)?;
    let linear = Simulator::fit(&centring, &reaching, ReachForm::Linear)?;
    let plane = ExactPlane::new(20_000, &mut rng);
    let centering = learn(BehaviourSpec::centering(), &rigid, 60_000, &mut rng, &mut |_| ())?.behaviour;
    let (paper, fine) = (BehaviourSpec::approaching, BehaviourSpec::approaching_fine);
    let approaching = [
        (
            "Q 90, linear regression",
            learn(paper(), &linear, 500_000, &mut rng, &mut |_| ())?,
        ),
        (
            "Q 90, rigid regression",
            learn(paper(), &rigid, 500_000, &mut rng, &mut |_| ())?,
        ),
        (
            "Q 540, rigid regression",
            learn(fine(), &rigid, 2_000_000, &mut rng, &mut |_| ())?,
        ),
        (
            "Q 90, exact plane",
            plane.learn(paper(), 500_000, &mut rng, &mut |_| ())?,
        ),
        (
            "Q 540, exact plane",
            plane.learn(fine(), 2_000_000, &mut rng, &mut |_| ())?,
        ),
    ];
    let both = |lesson: puma_grasp::Lesson| Learned::new(centering.clone(), lesson.behaviour);
    Ok(approaching
        .into_iter()
        .map(|(name, lesson)| (name, both(lesson)))
        .collect())
}

/// The hybrid after at most `moves` moves in `cell`, learning nothing more.
fn taught_hybrid(cell: &TrialCell, seed: u64, moves: usize) -> Made {
    let config = AgentConfig::paper(cell.search_poses());
    let longest = config.max_cycles;
    let mut agent = Agent::with_controller(config, Hybrid::new(HybridSettings::paper()))?;
    let mut made = 0;
    for run in 0.. {
        // A run more could take this many moves; a ball found nowhere takes none.
        if made + longest > moves || run > moves as u64 {
            break;
        }
        let result = cell.run(&mut agent, seed_of(seed, &[run]), &mut |_, _| (), &mut |_| ())?;
        made += result.map_or(0, |result| result.outcome.cycles);
    }
    Ok(Box::new(agent.into_controller().frozen()))
}

/// A seed of its own for each use.
fn seed_of(seed: u64, uses: &[u64]) -> u64 {
    uses.iter().fold(seed, |seed, part| {
        (seed ^ part.wrapping_mul(0x9e37_79b9_7f4a_7c15))
            .wrapping_mul(0xd134_2543_de82_ef95)
            .rotate_left(29)
    })
}
