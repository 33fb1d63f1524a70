//! The paper's experiments: learning (Fig. 6), reaching from three distances (Fig. 7), tracking a
//! ball that is pushed away (Fig. 8), and from simulation to the arm.
//!
//! ```text
//! cargo run --release --example paper_figures -- --help
//! ```

use std::error::Error;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use grasp_agent::{
    Agent, BehaviourError, BehaviourPair, BehaviourSpec, EventKind, GoalInterval, Learned, Lesson,
    Percept,
};
use hough_heuristic::Features;
use pipeline_sim::{Ball, Cell, ErrorLevel, MoveForm};
use puma_grasp::Simulator;
use qtable::Record;
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

use example_support::cpu::cpu_time;
use example_support::files::{writable_folder, write_png, write_whole};
use example_support::learning::{ACTIONS, TRIALS};
use example_support::plane::{ExactPlane, PlaneStart, score, search_percepts, search_starts};
use example_support::plot::{Panel, drawn};
use example_support::program::{at_least_one, ended};
use example_support::say;
use example_support::trial::TrialCell;

mod on_the_arm;
mod snapshots;

/// Reproduces the paper's figures 6 to 9 as SVG, PNG and CSV: 6 to 8 with features straight from
/// the geometry, 9 through rendered frames and VAL II. Also measures the behaviours on arms with
/// errors, before and after learning on there.
#[derive(Parser, Debug)]
struct Options {
    /// Folder for the figures
    #[arg(long, value_name = "DIR", default_value = "out/figures")]
    out: PathBuf,

    /// Number of seeds to learn with
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = at_least_one::<u64>)]
    seeds: u64,

    /// First seed
    #[arg(long, value_name = "N", default_value_t = 0)]
    first_seed: u64,

    /// Balls, placed where the search finds them, to test the learned tables with
    #[arg(long, value_name = "N", default_value_t = 400, value_parser = at_least_one::<u16>)]
    starts: u16,

    /// Make figure 6 and its table only
    #[arg(long)]
    learning_only: bool,

    /// Training actions of the fine preset of 540 states
    #[arg(long, value_name = "N", default_value_t = 4_000_000)]
    fine: u64,

    /// Number of arms, each with errors of its own
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = at_least_one::<u64>)]
    arms: u64,
}

fn main() -> ExitCode {
    ended(run(&Options::parse()))
}

fn run(options: &Options) -> Result<(), Box<dyn Error>> {
    writable_folder(&options.out)?;
    let taught = figure_6(options)?;
    if options.learning_only {
        say!("figures: {}", options.out.display());
        return Ok(());
    }
    figures_7_and_8(options, &taught)?;
    write_png(
        &options.out.join("figure9.png"),
        &snapshots::snapshots(&taught, 2000)?,
    )?;
    let report = on_the_arm::from_simulation_to_the_arm(options.arms)?;
    write_whole(&options.out.join("on_the_arm.svg"), report.svg.as_bytes())?;
    write_whole(&options.out.join("on_the_arm.csv"), report.csv.as_bytes())?;
    say!("figures: {}", options.out.display());
    Ok(())
}

/// Learns with many seeds: curves of both behaviours, and the results of the learned tables from
/// the search poses.
fn figure_6(options: &Options) -> Result<Learned, Box<dyn Error>> {
    let starts = search_starts(
        usize::from(options.starts),
        options.first_seed.wrapping_add(1),
    );
    let optimum =
        starts.iter().map(|start| start.optimum).sum::<usize>() as f64 / starts.len() as f64;
    say!(
        "Figure 6: approaching, learned with each simulator and reward, then tried in the exact \
         plane from {} starts of the search (breadth-first optimum {optimum:.2} steps, loop \
         breaker {}); without search and recovery, so that a ball once lost stays lost",
        starts.len(),
        Learned::APPROACHING_KAPPA
    );
    say!("seed  learned in / reward              success %   steps   x optimum  s of CPU");
    let mut curves: Vec<(&str, Vec<Vec<Record>>)> =
        vec![("centering", Vec::new()), ("approaching", Vec::new())];
    let mut taught = None;
    for seed in options.first_seed..options.first_seed.saturating_add(options.seeds) {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let plane = ExactPlane::new(20_000, &mut rng);
        let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
        let (centering, reaching) = cell.sample_moves(2_500, 0.5, &mut rng)?;
        let rigid = Simulator::fit(&centering, &reaching, MoveForm::Rigid22)?;
        let linear = Simulator::fit(&centering, &reaching, MoveForm::Linear)?;
        let literal = BehaviourPair::paper_literal().approaching;
        let (mended, fine) = (
            BehaviourPair::paper_mended(),
            BehaviourPair::fine().approaching,
        );
        let wide = mended
            .clone()
            .with_y_goal(GoalInterval::Y_SECTION_4)?
            .approaching;
        let mut floored = literal.clone();
        floored.reward.floor = 1.0;
        let quiet = &mut |_: &Record| ();
        let anywhere: Vec<Percept> = (0..TRIALS).map(|_| rigid.start(&mut rng)).collect();
        let centering = rigid.learn(mended.centering, &anywhere, ACTIONS.0, &mut rng, quiet)?;
        let found = search_percepts(1_000, seed.wrapping_add(1_000_000));
        // A table of more states has more corners in which a ball can be lost.
        let more_found = search_percepts(10_000, seed.wrapping_add(1_000_000));
        let rng = &mut rng;
        let mended = mended.approaching;
        let (found, none) = (&found[..], &[][..]);
        type Cases<'a> = [(
            &'a str,
            Option<&'a Simulator>,
            &'a BehaviourSpec,
            &'a [Percept],
        ); 8];
        let cases: Cases<'_> = [
            ("exact plane, mended", None, &mended, found),
            ("exact plane, mended, last table", None, &mended, none),
            ("exact plane, y goal 74..92", None, &wide, found),
            ("exact plane, literal", None, &literal, none),
            ("exact plane, floored only", None, &floored, none),
            ("exact plane, fine", None, &fine, &more_found),
            ("rigid regression, mended", Some(&rigid), &mended, found),
            ("linear regression, mended", Some(&linear), &mended, found),
        ];
        let lessons = cases.map(|(name, simulator, spec, trials)| {
            let actions = if *spec == fine {
                options.fine
            } else {
                ACTIONS.1
            };
            let (spec, begin) = (spec.clone(), cpu_time());
            let lesson = match simulator {
                None => plane.learn(spec, trials, actions, rng, quiet),
                Some(simulator) => simulator.learn(spec, trials, actions, rng, quiet),
            };
            (name, (lesson, cpu_time().saturating_sub(begin)))
        });
        for (name, (lesson, spent)) in &lessons {
            say!(
                "{seed:4}  {name:32} {}  {:8.2}",
                scored(lesson, &starts),
                spent.as_secs_f64()
            );
        }
        let [(_, (approaching, _)), ..] = lessons;
        let approaching = approaching?;
        curves[0].1.push(centering.curve);
        curves[1].1.push(approaching.curve);
        taught.get_or_insert(Learned::new(centering.behaviour, approaching.behaviour));
    }
    let mut csv = String::from("behaviour,seed,actions,success_share,mean_td_error\n");
    for (name, seeds) in &curves {
        for (seed, curve) in (options.first_seed..).zip(seeds) {
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
        let title = format!("{name}: goal reached, % of episodes");
        let success = Panel::of_seeds(&title, seeds, |r| r.success_share.map(|s| 100.0 * s));
        let title = format!("{name}: mean error of Q");
        let error = Panel::of_seeds(&title, seeds, |r| r.mean_td_error);
        panels.extend([success.up_to(105.0), error]);
    }
    write_svg(options, "figure6", &panels, 2)?;
    taught.ok_or_else(|| "at least one seed is needed".into())
}

fn scored(lesson: &Result<Lesson, BehaviourError>, starts: &[PlaneStart]) -> String {
    match lesson {
        Ok(lesson) => {
            let s = score(&lesson.behaviour, Learned::APPROACHING_KAPPA, starts);
            let share = 100.0 * s.reached as f64 / s.starts as f64;
            format!("{share:9.2} {:7.2} {:11.3}", s.steps, s.over_optimum)
        }
        Err(error) => format!("learns nothing: {error}"),
    }
}

/// Draws features per step while reaching, by distance and elbow, and while the ball is pushed away
/// repeatedly.
fn figures_7_and_8(options: &Options, taught: &Learned) -> Result<(), Box<dyn Error>> {
    let cell = TrialCell::draw(ErrorLevel::None, 0)?;
    let mut config = cell.agent_config();
    config.max_cycles = 120;
    let mut csv = String::from("figure,run,step,x,y,r,theta3\n");
    let (mut reach, mut track) = (Vec::new(), Vec::new());
    for (figure, pushes, runs) in [(7, 0, 60), (8, 3, 3)] {
        for run in 0..runs {
            let mut agent = Agent::with_controller(config.clone(), taught.clone())?;
            // The last sighting before each move.
            let (mut done, mut path, mut looked_at, mut gripped) = (0, Vec::new(), None, false);
            let mut world = |cell: &mut Cell, joints: &puma_val2::Joints| {
                let at_goal = |f: &Features| {
                    let inside = |(_, (low, high), of): &Feature| (*low..=*high).contains(&of(f));
                    FEATURES.iter().all(inside)
                };
                let there = cell.features(joints).is_ok_and(|f| at_goal(&f));
                if there && done < pushes {
                    done += usize::from(cell.push_to_radius(joints, 60.0));
                }
            };
            cell.run(&mut agent, 500 + run, &mut world, &mut |event| {
                gripped |= event.kind == EventKind::Gripped;
                if let EventKind::Seen(sighting) = event.kind
                    && !gripped
                {
                    if looked_at.replace(event.cycle) == Some(event.cycle) {
                        path.pop();
                    }
                    let f = sighting.features;
                    path.push((f, Percept::new(f, &event.joints).theta3));
                }
            })?;
            for (step, (f, theta3)) in path.iter().enumerate() {
                let _ = writeln!(
                    csv,
                    "{figure},{run},{step},{:.2},{:.2},{:.2},{theta3:.2}",
                    f.x, f.y, f.r
                );
            }
            if figure == 7 {
                reach.push(path);
            } else {
                track.push(path);
            }
        }
    }
    write_whole(&options.out.join("figures7and8.csv"), csv.as_bytes())?;
    // One figure for each interval of theta 3 that the goal is reached in, three distances in each,
    // as in the paper.
    let mut panels = Vec::new();
    for (low, high) in [(-50.0, 6.0), (6.0, 27.0), (27.0, 60.0)] {
        let ends_here = |path: &&Vec<(Features, f64)>| {
            path.len() > 3
                && path
                    .last()
                    .is_some_and(|(_, theta3)| (low..high).contains(theta3))
        };
        let mut paths: Vec<_> = reach.iter().filter(ends_here).collect();
        paths.sort_by(|a, b| a[0].0.r.total_cmp(&b[0].0.r));
        // "The starting position is chosen in such a way as to have the maximum off centering", at
        // each of three distances.
        let third = paths.len().div_ceil(3).max(1);
        let mut thirds = paths.chunks(third);
        let three = ["far", "middle", "near"].map(|start| {
            let most = thirds.next().into_iter().flatten();
            (
                start,
                most.max_by(|a, b| off_centre(&a[0].0).total_cmp(&off_centre(&b[0].0))),
            )
        });
        for (name, (low_end, high_end), feature) in FEATURES {
            let lines = three.iter().filter_map(|(start, path)| {
                let along = path.as_ref()?.iter().enumerate();
                let line = along.map(|(i, (f, _))| (i as f64, feature(f))).collect();
                Some((start.to_string(), line))
            });
            let title = format!("{name}, theta 3 ends in {low}..{high}");
            panels.push(Panel::new(&title, "step", lines.collect()).with_goal(low_end, high_end));
        }
    }
    write_svg(options, "figure7", &panels, 3)?;
    let panels: Vec<Panel> = track
        .iter()
        .zip(1..)
        .map(|(path, number)| {
            let line = path.iter().enumerate().map(|(i, (f, _))| (i as f64, f.r));
            let title = format!("r, ball {number}, pushed to r = 60 three times");
            let (low, high) = FEATURES[2].1;
            Panel::new(&title, "step", vec![(String::new(), line.collect())])
                .with_goal(low, high)
                .up_to(70.0)
        })
        .collect();
    write_svg(options, "figure8", &panels, 3)
}

fn write_svg(
    options: &Options,
    figure: &str,
    panels: &[Panel],
    columns: usize,
) -> Result<(), Box<dyn Error>> {
    let svg = drawn(panels, columns, (400, 290))?;
    write_whole(&options.out.join(format!("{figure}.svg")), svg.as_bytes())
}

/// Returns the distance of a ball from the goal in the image, in halves of its sides.
fn off_centre(f: &Features) -> f64 {
    ((f.x - 103.5) / 96.0).hypot((f.y - 78.0) / 72.0)
}

/// A feature: its name, its goal, and its reader.
type Feature = (&'static str, (f64, f64), fn(&Features) -> f64);
const FEATURES: [Feature; 3] = [
    ("x", (99.0, 108.0), |f| f.x),
    ("y", (74.0, 82.0), |f| f.y),
    ("r", (32.0, 34.0), |f| f.r),
];
