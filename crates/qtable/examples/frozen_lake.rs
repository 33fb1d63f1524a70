//! Learns FrozenLake with several seeds, prints what was learned beside the optimum, and draws the
//! learning curve and the policy as arrows on the ice.
//!
//! `cargo run --release -p qtable --example frozen_lake -- --map 8x8 --slippery`
#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::{Parser, ValueEnum};
use indicatif::ProgressBar;
use plotters::coord::Shift;
use plotters::prelude::*;
use qtable::{
    Action, EpsilonGreedy, Estimate, ModelEnvironment, QLearning, QTable, Record, Schedule, State,
    Training, Until, over_seeds, toys,
};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

/// Q-learning on FrozenLake.
#[derive(Parser)]
struct Arguments {
    /// The lake.
    #[arg(long, value_enum, default_value = "4x4")]
    map: Map,
    /// Slippery ice: a step goes astray two times in three.
    #[arg(long)]
    slippery: bool,
    /// Actions to learn from, for each seed.
    #[arg(long, default_value_t = 300_000, value_parser = clap::value_parser!(u64).range(1..))]
    actions: u64,
    /// Number of seeds.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u64).range(2..))]
    seeds: u64,
    /// The picture.
    #[arg(long, default_value = "out/frozen_lake.svg")]
    svg: PathBuf,
}

#[derive(Clone, Copy, ValueEnum)]
enum Map {
    #[value(name = "4x4")]
    Small,
    #[value(name = "8x8")]
    Large,
}

const GAMMA: f64 = 0.99;
const ARROWS: [char; 4] = ['←', '↓', '→', '↑'];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let (map, limit): (&[&str], u64) = match arguments.map {
        Map::Small => (&toys::FROZEN_LAKE_4X4, 100),
        Map::Large => (&toys::FROZEN_LAKE_8X8, 200),
    };
    let lake = toys::frozen_lake(map, arguments.slippery)?;
    let bar = ProgressBar::new(arguments.seeds);
    let runs = over_seeds(0..arguments.seeds, |seed| {
        let run = learn(&lake, limit, arguments.actions, seed);
        bar.inc(1);
        run
    })?;
    bar.finish_and_clear();

    let learned = |of: fn(&qtable::Assessment) -> f64| -> Result<Estimate, qtable::Error> {
        let each: Result<Vec<f64>, _> = runs
            .iter()
            .map(|(table, _)| lake.assess(&table.greedy(), GAMMA, limit).map(|a| of(&a)))
            .collect();
        Ok(Estimate::of(&each?))
    };
    let optimal = lake.compare(&runs[0].0, GAMMA, limit)?.optimal;
    println!(
        "of {} seeds, ± is the 95 % interval of the mean",
        arguments.seeds
    );
    println!(
        "success within {limit} steps: {}  (optimal {:.3})",
        learned(|a| a.success)?,
        optimal.success
    );
    println!(
        "discounted value:          {}  (optimal {:.3})",
        learned(|a| a.value)?,
        optimal.value
    );
    println!("the policy of seed 0:");
    for (row, cells) in map.iter().enumerate() {
        let line = cells
            .bytes()
            .enumerate()
            .map(|(column, cell)| sign(cell, &runs[0].0, row * cells.len() + column));
        println!("  {}", line.map(String::from).collect::<Vec<_>>().join(" "));
    }

    if let Some(folder) = arguments.svg.parent() {
        std::fs::create_dir_all(folder)?;
    }
    draw(&arguments.svg, map, &runs, optimal.success)?;
    println!("drawn to {}", arguments.svg.display());
    Ok(())
}

/// The table and the learning curve of one seed.
fn learn(
    lake: &ModelEnvironment,
    limit: u64,
    actions: u64,
    seed: u64,
) -> Result<(QTable, Vec<Record>), qtable::Error> {
    let learner = QLearning::new(Schedule::inverse_visits(1.0, 50.0)?, GAMMA)?;
    let epsilon =
        Schedule::piecewise(&[(0, 1.0), ((actions / 2).max(1), 0.2), (actions.max(2), 0.0)])?;
    // The values start above all that can be earned, so that what was not tried looks good.
    let table = QTable::filled(lake.model().states(), lake.model().actions(), 1.0)?;
    let mut training = Training::new(lake, table, learner, EpsilonGreedy::new(epsilon)?)?
        .with_episode_limit(limit)?
        .with_record_every((actions / 60).max(1))?;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    training.run(&mut lake.clone(), Until::Actions(actions), &mut rng)?;
    let curve = training.curve().to_vec();
    Ok((training.into_table(), curve))
}

fn sign(cell: u8, table: &QTable, state: usize) -> char {
    match cell {
        b'H' => '○',
        b'G' => '★',
        _ => ARROWS[table.best(State(state)).0],
    }
}

fn draw(
    path: &Path,
    map: &[&str],
    runs: &[(QTable, Vec<Record>)],
    optimum: f64,
) -> Result<(), Box<dyn Error>> {
    let root = SVGBackend::new(path, (1000, 460)).into_drawing_area();
    root.fill(&WHITE)?;
    let (left, right) = root.split_horizontally(560);
    draw_curve(&left, runs, optimum)?;
    draw_policy(&right, map, &runs[0].0)?;
    root.present()?;
    Ok(())
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

fn draw_curve(
    area: &Area,
    runs: &[(QTable, Vec<Record>)],
    optimum: f64,
) -> Result<(), Box<dyn Error>> {
    let curves: Vec<Vec<Record>> = runs.iter().map(|(_, curve)| curve.clone()).collect();
    let success = Estimate::of_curves(&curves, |record| record.success_share);
    let at: Vec<f64> = curves[0]
        .iter()
        .map(|record| record.actions as f64)
        .collect();
    let end = at.last().copied().unwrap_or(1.0);
    let mut chart = ChartBuilder::on(area)
        .caption(
            "success while learning, mean of the seeds and 95 % interval",
            ("sans-serif", 15),
        )
        .margin(15)
        .margin_right(30)
        .x_label_area_size(40)
        .y_label_area_size(50)
        .build_cartesian_2d(0.0..end, 0.0..1.0)?;
    let whole = |x: &f64| format!("{x:.0}");
    let mut mesh = chart.configure_mesh();
    mesh.x_desc("actions").x_labels(6).x_label_formatter(&whole);
    mesh.y_desc("share of episodes")
        .light_line_style(WHITE)
        .draw()?;
    let low = |e: &Estimate| (e.mean - e.half_width).clamp(0.0, 1.0);
    let high = |e: &Estimate| (e.mean + e.half_width).clamp(0.0, 1.0);
    let band = at.iter().copied().zip(success.iter().map(low));
    let back = at.iter().copied().zip(success.iter().map(high)).rev();
    chart.draw_series([Polygon::new(
        band.chain(back).collect::<Vec<_>>(),
        BLUE.mix(0.2),
    )])?;
    let means = at.iter().copied().zip(success.iter().map(|e| e.mean));
    chart.draw_series(LineSeries::new(means, BLUE.stroke_width(2)))?;
    chart.draw_series(LineSeries::new(
        [(0.0, optimum), (end, optimum)],
        BLACK.stroke_width(1),
    ))?;
    chart.draw_series([Text::new(
        format!("optimal policy {optimum:.3}"),
        (end * 0.02, (optimum - 0.02).min(0.97)),
        ("sans-serif", 13),
    )])?;
    Ok(())
}

fn draw_policy(area: &Area, map: &[&str], table: &QTable) -> Result<(), Box<dyn Error>> {
    let columns = map[0].len();
    let size = 400 / columns as i32;
    area.draw(&Text::new(
        "the policy of seed 0, darker where more can be won",
        (15, 12),
        ("sans-serif", 15),
    ))?;
    for (state, cell) in map.iter().flat_map(|row| row.bytes()).enumerate() {
        let (x, y) = (
            (state % columns) as i32 * size + 15,
            (state / columns) as i32 * size + 40,
        );
        let ice = BLUE.mix(0.05 + 0.45 * table.max(State(state)).clamp(0.0, 1.0));
        let fill = match cell {
            b'H' => BLACK.mix(0.75),
            b'G' => GREEN.mix(0.6),
            _ => ice,
        };
        area.draw(&Rectangle::new(
            [(x, y), (x + size - 2, y + size - 2)],
            fill.filled(),
        ))?;
        if cell == b'F' || cell == b'S' {
            let arrow = arrow(
                table.best(State(state)),
                (x + size / 2 - 1, y + size / 2 - 1),
                size / 3,
            );
            area.draw(&PathElement::new(
                arrow[..2].to_vec(),
                BLACK.stroke_width(2),
            ))?;
            area.draw(&Polygon::new(arrow[2..].to_vec(), BLACK))?;
        }
    }
    Ok(())
}

/// Tail and tip of the shaft, then the three corners of the head.
fn arrow(action: Action, (x, y): (i32, i32), half: i32) -> [(i32, i32); 5] {
    let (dx, dy) = [(-1, 0), (0, 1), (1, 0), (0, -1)][action.0];
    let at = |along: i32, aside: i32| (x + dx * along - dy * aside, y + dy * along + dx * aside);
    [
        at(-half, 0),
        at(half / 3, 0),
        at(half, 0),
        at(half / 4, half / 2),
        at(half / 4, -half / 2),
    ]
}
