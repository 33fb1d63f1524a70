//! All learners of the crate on one problem with several seeds: what each has learned beside the
//! optimum, and a picture of how they got there.
//!
//! `cargo run --release -p qtable --features parallel --example compare_learners -- --problem cliff --seeds 10`
#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::{Parser, ValueEnum};
use indicatif::ProgressBar;
use plotters::prelude::*;
use qtable::{
    DoubleQLearning, DynaQ, EpsilonGreedy, Estimate, ExpectedSarsa, Learner, ModelEnvironment,
    NStepQ, PrioritizedSweeping, QLambda, QLearning, QTable, Record, Sarsa, SarsaLambda, Schedule,
    Ties, Training, Until, over_seeds, toys,
};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

/// All learners on one problem.
#[derive(Parser)]
struct Arguments {
    /// The problem.
    #[arg(long, value_enum, default_value = "cliff")]
    problem: Problem,
    /// Number of seeds.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u64).range(2..))]
    seeds: u64,
    /// Actions for each seed, instead of the problem's own number.
    #[arg(long, value_parser = clap::value_parser!(u64).range(100..))]
    actions: Option<u64>,
    /// The picture; none is drawn if it is empty.
    #[arg(long, default_value = "out/compare_learners.svg")]
    svg: PathBuf,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Problem {
    Chain,
    Cliff,
    Lake,
    SlipperyLake,
    Taxi,
}

/// What a problem asks for: the world, actions to learn from, time limit, whether it is left to
/// chance.
struct Task {
    world: ModelEnvironment,
    actions: u64,
    limit: u64,
    alpha: Schedule,
}

const GAMMA: f64 = 0.99;

fn task(problem: Problem) -> Result<Task, Box<dyn Error>> {
    let steady = Schedule::constant(0.2)?;
    let (world, actions, limit, alpha) = match problem {
        Problem::Chain => (toys::chain(12)?, 40_000, 500, steady),
        Problem::Cliff => (toys::cliff_walking()?, 60_000, 500, steady),
        Problem::Lake => (
            toys::frozen_lake(&toys::FROZEN_LAKE_4X4, false)?,
            20_000,
            100,
            steady,
        ),
        Problem::SlipperyLake => {
            let alpha = Schedule::exponential(0.2, 0.002, 500_000)?;
            (
                toys::frozen_lake(&toys::FROZEN_LAKE_4X4, true)?,
                500_000,
                100,
                alpha,
            )
        }
        Problem::Taxi => (toys::taxi()?, 400_000, 200, steady),
    };
    Ok(Task {
        world,
        actions,
        limit,
        alpha,
    })
}

const NAMES: [&str; 9] = [
    "Q-learning",
    "SARSA",
    "Expected SARSA",
    "Double Q",
    "Q(λ)",
    "SARSA(λ)",
    "4-step Q",
    "Dyna-Q",
    "Prioritized sweeping",
];

fn learner(index: usize, alpha: Schedule) -> Result<Box<dyn Learner>, qtable::Error> {
    Ok(match index {
        0 => Box::new(QLearning::new(alpha, GAMMA)?),
        1 => Box::new(Sarsa::new(alpha, GAMMA)?),
        2 => Box::new(ExpectedSarsa::new(alpha, GAMMA)?),
        3 => Box::new(DoubleQLearning::<f64>::new(alpha, GAMMA)?),
        4 => Box::new(QLambda::new(alpha, GAMMA)?),
        5 => Box::new(SarsaLambda::new(alpha, GAMMA)?),
        6 => Box::new(NStepQ::new(alpha, GAMMA)?),
        7 => Box::new(DynaQ::new(alpha, GAMMA)?),
        _ => Box::new(PrioritizedSweeping::new(GAMMA)?),
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let mut task = task(arguments.problem)?;
    task.actions = arguments.actions.unwrap_or(task.actions);
    let bar = ProgressBar::new(arguments.seeds * NAMES.len() as u64);
    let mut curves = Vec::new();
    let mut rows = Vec::new();
    let mut optimal = None;
    for (index, name) in NAMES.iter().enumerate() {
        let runs = over_seeds(0..arguments.seeds, |seed| {
            let run = learn(&task, index, seed)?;
            bar.inc(1);
            Ok::<_, qtable::Error>((task.world.compare(&run.0, GAMMA, task.limit)?, run.1))
        })?;
        optimal = runs.first().map(|(both, _)| both.optimal);
        let of = |what: fn(&qtable::Assessment) -> f64| {
            Estimate::of(
                &runs
                    .iter()
                    .map(|(both, _)| what(&both.learned))
                    .collect::<Vec<_>>(),
            )
        };
        let at_optimum = runs
            .iter()
            .filter(|(both, _)| both.learned.value > both.optimal.value - 1e-6)
            .count();
        rows.push(format!(
            "| {name} | {:.3} | {:.1} | {:.4} | {at_optimum} |",
            of(|a| a.success),
            of(|a| a.steps),
            of(|a| a.value)
        ));
        curves.push(runs.into_iter().map(|(_, curve)| curve).collect::<Vec<_>>());
    }
    bar.finish_and_clear();
    println!(
        "{} actions, {} seeds; ± is the 95 % interval of the mean.\n",
        task.actions, arguments.seeds
    );
    println!(
        "| learner | success | steps | discounted value | seeds at the optimum |\n|---|---:|---:|---:|---:|"
    );
    println!("{}", rows.join("\n"));
    if let Some(best) = optimal {
        println!(
            "| *optimum* | {:.3} | {:.1} | {:.4} | |",
            best.success, best.steps, best.value
        );
    }
    if !arguments.svg.as_os_str().is_empty() {
        if let Some(folder) = arguments.svg.parent() {
            std::fs::create_dir_all(folder)?;
        }
        draw(&arguments.svg, &curves)?;
        println!("\ndrawn to {}", arguments.svg.display());
    }
    Ok(())
}

/// Table and learning curve of one learner with one seed. Exploration fades away. What a learner of
/// the policy that acts has learned of it while it explored, the safe way past the cliff for
/// example, it may keep after that.
fn learn(task: &Task, index: usize, seed: u64) -> Result<(QTable, Vec<Record>), qtable::Error> {
    let n = task.actions;
    let epsilon = Schedule::piecewise(&[(0, 1.0), (n / 4, 0.3), (n / 2, 0.1), (n * 3 / 4, 0.0)])?;
    let table = QTable::new(task.world.model().states(), task.world.model().actions())?;
    let mut training = Training::new(
        &task.world,
        table,
        learner(index, task.alpha.clone())?,
        EpsilonGreedy::new(epsilon)?.with_ties(Ties::Random),
    )?
    .with_episode_limit(task.limit)?
    .with_record_every((n / 50).max(1))?;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    training.run(&mut task.world.clone(), Until::Actions(n), &mut rng)?;
    let curve = training.curve().to_vec();
    Ok((training.into_table(), curve))
}

/// Mean return of an episode over the actions, one panel for each learner, Q-learning in gray
/// behind the others.
fn draw(path: &Path, curves: &[Vec<Vec<Record>>]) -> Result<(), Box<dyn Error>> {
    let estimates: Vec<Vec<Estimate>> = curves
        .iter()
        .map(|runs| Estimate::of_curves(runs, |record| record.mean_return))
        .collect();
    let at: Vec<f64> = curves[0][0]
        .iter()
        .map(|record| record.actions as f64)
        .collect();
    // Without the lowest fifth, so that the first wild records do not press all else together.
    let mut means: Vec<f64> = estimates
        .iter()
        .flatten()
        .map(|e| e.mean)
        .filter(|m| m.is_finite())
        .collect();
    means.sort_by(f64::total_cmp);
    let (low, high) = (means[means.len() / 5], means[means.len() - 1]);
    let room = ((high - low) * 0.1).max(1e-3);
    let (low, high) = (low - room, high + room);

    let root = SVGBackend::new(path, (1050, 800)).into_drawing_area();
    root.fill(&WHITE)?;
    let root = root.titled(
        "mean return of an episode, with the 95 % interval, over the actions; in gray Q-learning; cut off below",
        ("sans-serif", 18),
    )?;
    for (index, area) in root.split_evenly((3, 3)).iter().enumerate() {
        let mut chart = ChartBuilder::on(area)
            .caption(NAMES[index], ("sans-serif", 15))
            .margin(8)
            .margin_right(25)
            .x_label_area_size(28)
            .y_label_area_size(50)
            .build_cartesian_2d(0.0..at.last().copied().unwrap_or(1.0), low..high)?;
        chart
            .configure_mesh()
            .x_labels(4)
            .x_label_formatter(&|x| format!("{x:.0}"))
            .y_labels(6)
            .light_line_style(WHITE)
            .draw()?;
        let point =
            |(&x, e): (&f64, &Estimate)| e.mean.is_finite().then(|| (x, e.mean.clamp(low, high)));
        let gray = at.iter().zip(&estimates[0]).filter_map(point);
        chart.draw_series(LineSeries::new(gray, BLACK.mix(0.35).stroke_width(1)))?;
        let known = || {
            at.iter()
                .zip(&estimates[index])
                .filter(|(_, e)| e.half_width.is_finite())
        };
        let below = known().map(|(&x, e)| (x, (e.mean - e.half_width).clamp(low, high)));
        let above = known()
            .map(|(&x, e)| (x, (e.mean + e.half_width).clamp(low, high)))
            .rev();
        let band: Vec<(f64, f64)> = below.chain(above).collect();
        chart.draw_series([Polygon::new(band, RED.mix(0.25))])?;
        let line = at.iter().zip(&estimates[index]).filter_map(point);
        chart.draw_series(LineSeries::new(line, RED.stroke_width(2)))?;
    }
    root.present()?;
    Ok(())
}
