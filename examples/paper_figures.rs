//! The paper's experiments: learning (Fig. 6), reaching from three distances (Fig. 7), tracking a ball that is pushed away (Fig. 8), and
//! from simulation to the arm.
//!
//! ```text
//! cargo run --release --example paper_figures -- --help
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

use clap::Parser;
use grasp_agent::{Agent, AgentConfig, BehaviourSpec, EventKind, Learned, Reward};
use pipeline_sim::{Ball, Cell, ErrorLevel, ReachForm, sample_moves};
use plotters::prelude::*;
use puma_grasp::{
    ExactPlane, LearnError, Lesson, Simulator, TrialCell, learn, schedule, score, search_starts,
};
use qtable::Record;
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

use files::{writable_folder, write_whole};

#[allow(dead_code, reason = "shared with the examples that write pictures")]
mod files;

/// Make the figures of the paper again, as SVG and CSV, on the feature shortcut; Fig. 9 is what the example `grasp` writes.
#[derive(Parser, Debug)]
struct Options {
    /// Folder for the figures
    #[arg(long, value_name = "DIR", default_value = "out/figures")]
    out: PathBuf,

    /// Seeds to learn from
    #[arg(long, value_name = "N", default_value_t = 10)]
    seeds: u64,

    /// Also learn with the fine preset of 540 states, this many actions
    #[arg(long, value_name = "N")]
    fine: Option<u64>,
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
    let taught = figure_6(options)?;
    figures_7_and_8(options, &taught)?;
    println!("figures: {}", options.out.display());
    Ok(())
}

/// Learning, many seeds: curves of both behaviours, and how the learned tables do from the search poses.
fn figure_6(options: &Options) -> Result<Learned, Box<dyn Error>> {
    let starts = search_starts(400, 1);
    let optimum = starts.iter().map(|start| start.optimum).sum::<usize>() as f64 / starts.len() as f64;
    println!(
        "approaching from 400 search starts, breadth-first optimum {optimum:.2} steps; kappa {}",
        Learned::APPROACHING_KAPPA
    );
    println!("seed  learned in / reward            success %   steps   x optimum");
    let mut curves: Vec<(&str, Vec<Vec<Record>>)> =
        vec![("centering", Vec::new()), ("approaching", Vec::new())];
    let mut taught = None;
    for seed in 0..options.seeds {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let plane = ExactPlane::new(20_000, &mut rng);
        let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
        let (centring, reaching) = sample_moves(&cell, 2_500, 0.5, &mut rng);
        let rigid = Simulator::fit(&centring, &reaching, ReachForm::Rigid22)?;
        let linear = Simulator::fit(&centring, &reaching, ReachForm::Linear)?;
        let paper = BehaviourSpec::approaching;
        let wide = || BehaviourSpec::approaching().with_y_goal(74.0, 92.0);
        let literal = || paper().with_reward(Reward::approaching_literal());
        let floored = || {
            paper().with_reward(Reward {
                floor: 1.0,
                ..Reward::approaching_literal()
            })
        };
        let centering = learn(BehaviourSpec::centering(), &rigid, 60_000, &mut rng, &mut |_| ())?;
        let mut lessons = vec![
            (
                "exact plane, mended",
                plane.learn(paper(), 500_000, &mut rng, &mut |_| ()),
            ),
            (
                "exact plane, y goal 74..92",
                plane.learn(wide()?, 500_000, &mut rng, &mut |_| ()),
            ),
            (
                "exact plane, literal",
                plane.learn(literal(), 500_000, &mut rng, &mut |_| ()),
            ),
            (
                "exact plane, floored only",
                plane.learn(floored(), 500_000, &mut rng, &mut |_| ()),
            ),
            (
                "rigid regression, mended",
                learn(paper(), &rigid, 500_000, &mut rng, &mut |_| ()),
            ),
            (
                "linear regression, mended",
                learn(paper(), &linear, 500_000, &mut rng, &mut |_| ()),
            ),
        ];
        if let Some(actions) = options.fine {
            let fine = plane.learn_with(
                BehaviourSpec::approaching_fine(),
                &schedule(actions)?,
                &mut rng,
                &mut |_| (),
            );
            lessons.push(("exact plane, fine", fine));
        }
        for (name, lesson) in &lessons {
            println!("{seed:4}  {name:30} {}", scored(lesson, &starts));
        }
        let Some((_, approaching)) = lessons.into_iter().next() else {
            continue;
        };
        let approaching = approaching?;
        curves[0].1.push(centering.report.curve);
        curves[1].1.push(approaching.report.curve);
        taught.get_or_insert(Learned::new(centering.behaviour, approaching.behaviour));
    }
    let mut csv = String::from("behaviour,seed,actions,success_share,mean_td_error\n");
    for (name, seeds) in &curves {
        for (seed, curve) in seeds.iter().enumerate() {
            for record in curve {
                let cell = |value: Option<f64>| value.map_or(String::new(), |v| format!("{v:.5}"));
                let (share, error) = (cell(record.success_share), cell(record.mean_td_error));
                let _ = writeln!(csv, "{name},{seed},{},{share},{error}", record.actions);
            }
        }
    }
    write_whole(&options.out.join("figure6.csv"), csv.as_bytes())?;
    let mut panels = Vec::new();
    for (name, seeds) in &curves {
        panels.push(Panel::of_seeds(
            &format!("{name}: goal reached, % of episodes"),
            seeds,
            |r| r.success_share.map(|s| 100.0 * s),
        ));
        panels.push(Panel::of_seeds(&format!("{name}: mean error of Q"), seeds, |r| {
            r.mean_td_error
        }));
    }
    write_whole(&options.out.join("figure6.svg"), drawn(&panels)?.as_bytes())?;
    taught.ok_or_else(|| "at least one seed is needed".into())
}

fn scored(lesson: &Result<Lesson, LearnError>, starts: &[puma_grasp::PlaneStart]) -> String {
    match lesson {
        Ok(lesson) => {
            let s = score(&lesson.behaviour, Learned::APPROACHING_KAPPA, starts);
            let share = 100.0 * s.reached as f64 / s.starts as f64;
            format!("{share:9.2} {:7.2} {:11.3}", s.steps, s.over_optimum)
        }
        Err(error) => format!("learns nothing: {error}"),
    }
}

/// Features per step while reaching, by distance and elbow, and while the ball is pushed away again and again.
fn figures_7_and_8(options: &Options, taught: &Learned) -> Result<(), Box<dyn Error>> {
    let cell = TrialCell::draw(ErrorLevel::None, 0)?;
    let mut config = AgentConfig::paper(cell.search_poses());
    config.max_cycles = 120;
    let mut csv = String::from("figure,run,step,x,y,r,theta3\n");
    let (mut reach, mut track) = (Vec::new(), Vec::new());
    for (figure, pushes, runs) in [(7, 0, 60), (8, 3, 3)] {
        for run in 0..runs {
            let mut agent = Agent::with_controller(config.clone(), taught.clone())?;
            let (mut done, mut path) = (0, Vec::new());
            let mut world = |cell: &mut Cell, joints: &puma_val2::Joints| {
                let there = cell.features(joints).is_some_and(|f| {
                    (99.0..=108.0).contains(&f.x)
                        && (74.0..=82.0).contains(&f.y)
                        && (32.0..=34.0).contains(&f.r)
                });
                if there && done < pushes {
                    done += usize::from(cell.push_to_radius(joints, 60.0));
                }
            };
            cell.run(&mut agent, 500 + run, &mut world, &mut |event| {
                if let EventKind::Seen(sighting) = event.kind {
                    let (f, theta3) = (sighting.features, grasp_agent::theta3(&event.joints));
                    let _ = writeln!(
                        csv,
                        "{figure},{run},{},{:.2},{:.2},{:.2},{theta3:.2}",
                        path.len(),
                        f.x,
                        f.y,
                        f.r
                    );
                    path.push((f, theta3));
                }
            })?;
            if figure == 7 {
                reach.push(path);
            } else {
                track.push(path);
            }
        }
    }
    write_whole(&options.out.join("figures7and8.csv"), csv.as_bytes())?;
    // One figure for each interval of theta 3 that the goal is reached in, three distances in each, as in the paper.
    let mut panels = Vec::new();
    for (low, high) in [(-50.0, 6.0), (6.0, 27.0), (27.0, 60.0)] {
        let ends_here = |path: &&Vec<(hough_heuristic::Features, f64)>| {
            path.len() > 3
                && path
                    .last()
                    .is_some_and(|(_, theta3)| (low..high).contains(theta3))
        };
        let mut paths: Vec<_> = reach.iter().filter(ends_here).collect();
        paths.sort_by(|a, b| a[0].0.r.total_cmp(&b[0].0.r));
        let three = [paths.first(), paths.get(paths.len() / 2), paths.last()];
        for (name, feature) in FEATURES {
            let lines = three.iter().flatten().map(|path| {
                path.iter()
                    .enumerate()
                    .map(|(i, (f, _))| (i as f64, feature(f)))
                    .collect()
            });
            panels.push(Panel::new(
                &format!("{name} per step, theta 3 ends in {low}..{high}"),
                lines.collect(),
            ));
        }
    }
    write_whole(&options.out.join("figure7.svg"), drawn(&panels)?.as_bytes())?;
    let lines = track.iter().map(|path| {
        path.iter()
            .enumerate()
            .map(|(i, (f, _))| (i as f64, f.r))
            .collect()
    });
    let panel = Panel::new(
        "r per step; the ball is pushed to r = 60 three times",
        lines.collect(),
    );
    write_whole(&options.out.join("figure8.svg"), drawn(&[panel])?.as_bytes())
}

type Feature = (&'static str, fn(&hough_heuristic::Features) -> f64);
const FEATURES: [Feature; 3] = [("x", |f| f.x), ("y", |f| f.y), ("r", |f| f.r)];

/// A diagram: some lines and a band.
struct Panel {
    title: String,
    lines: Vec<Vec<(f64, f64)>>,
    band: Vec<(f64, f64, f64)>,
}

impl Panel {
    fn new(title: &str, lines: Vec<Vec<(f64, f64)>>) -> Self {
        Self {
            title: title.into(),
            lines,
            band: Vec::new(),
        }
    }

    /// Mean over the seeds, with the 95 % interval as band.
    fn of_seeds(title: &str, seeds: &[Vec<Record>], value: impl Fn(&Record) -> Option<f64>) -> Self {
        let (mut mean_line, mut band) = (Vec::new(), Vec::new());
        for i in 0..seeds.iter().map(Vec::len).min().unwrap_or(0) {
            let values: Vec<f64> = seeds.iter().filter_map(|curve| value(&curve[i])).collect();
            if values.is_empty() {
                continue;
            }
            let n = values.len() as f64;
            let mean = values.iter().sum::<f64>() / n;
            let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
            let half = 2.26 * (variance / n).sqrt();
            let x = seeds[0][i].actions as f64;
            mean_line.push((x, mean));
            band.push((x, mean - half, mean + half));
        }
        Self {
            title: title.into(),
            lines: vec![mean_line],
            band,
        }
    }
}

fn drawn(panels: &[Panel]) -> Result<String, Box<dyn Error>> {
    const COLOURS: [RGBColor; 3] = [
        RGBColor(30, 90, 180),
        RGBColor(190, 70, 40),
        RGBColor(40, 140, 70),
    ];
    let columns = if panels.len().is_multiple_of(3) {
        3
    } else {
        panels.len().min(2)
    }
    .max(1);
    let rows = panels.len().div_ceil(columns).max(1);
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (1200, 300 * rows as u32)).into_drawing_area();
        root.fill(&WHITE)?;
        for (area, panel) in root.split_evenly((rows, columns)).iter().zip(panels) {
            let points = || panel.lines.iter().flatten();
            let right = points().map(|p| p.0).fold(1.0, f64::max);
            let top = points()
                .map(|p| p.1)
                .chain(panel.band.iter().map(|b| b.2))
                .fold(1.0, f64::max);
            let mut chart = ChartBuilder::on(area)
                .caption(&panel.title, ("sans-serif", 15))
                .margin(6)
                .x_label_area_size(24)
                .y_label_area_size(44)
                .build_cartesian_2d(0.0..right, 0.0..1.05 * top)?;
            chart.configure_mesh().draw()?;
            let edge = panel
                .band
                .iter()
                .map(|b| (b.0, b.1))
                .chain(panel.band.iter().rev().map(|b| (b.0, b.2)));
            chart.draw_series([Polygon::new(edge.collect::<Vec<_>>(), COLOURS[0].mix(0.2))])?;
            for (line, colour) in panel.lines.iter().zip(COLOURS.iter().cycle()) {
                chart.draw_series(LineSeries::new(line.iter().copied(), colour.stroke_width(2)))?;
            }
        }
        root.present()?;
    }
    Ok(svg)
}
