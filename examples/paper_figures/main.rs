//! The paper's experiments: learning (Fig. 6), reaching from three distances (Fig. 7), tracking a
//! ball that is pushed away (Fig. 8), and from simulation to the arm.
//!
//! ```text
//! cargo run --release --example paper_figures -- --help
//! ```

use std::path::PathBuf;

use clap::Parser;
use grasp_agent::{
    Agent, BehaviourError, BehaviourPair, BehaviourSpec, EventKind, GoalInterval, Learned, Lesson,
    Percept,
};
use hough_heuristic::Features;
use indicatif::ProgressBar;
use pipeline_sim::{Cell, ErrorLevel, MoveForm};
use puma_grasp::Simulator;
use puma_val2::Joints;
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

use example_support::learning::{
    ACTIONS, ACTIONS_FINE, TRIALS, anywhere, paper_cell, simulators, until_stopped,
};
use example_support::plane::{ExactPlane, PlaneStart, score, search_percepts, search_starts};
use example_support::plot::{CURVES, Panel, write_svg};
use example_support::prelude::*;
use example_support::stages::cpu_time;
use example_support::trial::{FEATURES, TrialCell, at_goal};

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
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = at_least_one)]
    seeds: usize,
    /// First seed
    #[arg(long, value_name = "N", default_value_t = 0)]
    first_seed: u64,
    /// Balls, placed where the search finds them, to test the learned tables with
    #[arg(long, value_name = "N", default_value_t = 400, value_parser = at_least_one)]
    starts: usize,
    /// Make figure 6 and its table only
    #[arg(long)]
    learning_only: bool,
    /// Training actions of the fine preset of 540 states
    #[arg(long, value_name = "N", default_value_t = ACTIONS_FINE)]
    fine: u64,
    /// Number of arms, each with errors of its own
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = at_least_one)]
    arms: usize,
}

fn main() -> ExitCode {
    start(run)
}

fn run(options: &Options) -> Outcome {
    let _lock = lock_folder(&options.out)?;
    let taught = figure_6(options)?;
    if !options.learning_only {
        figures_7_and_8(options, &taught)?;
        write_png(
            &options.out.join("figure9.png"),
            &snapshots::snapshots(&taught, 2000)?,
        )?;
        on_the_arm::from_simulation_to_the_arm(options.arms, &options.out)?;
    }
    say!("figures: {}", options.out.display());
    Ok(())
}

/// Learns with many seeds: curves of both behaviours, and the results of the learned tables from
/// the search poses.
fn figure_6(options: &Options) -> Outcome<Learned> {
    let starts = search_starts(options.starts, options.first_seed.wrapping_add(1));
    go_on()?;
    let optimum = starts.iter().map(|start| start.optimum).sum::<usize>();
    say!(
        "Figure 6: approaching, learned with each simulator and reward, then tried in the exact \
         plane from {} starts of the search (breadth-first optimum {:.2} moves, loop breaker {}); \
         without search and recovery, so that a ball once lost stays lost",
        starts.len(),
        optimum as f64 / starts.len() as f64,
        Learned::APPROACHING_KAPPA
    );
    say!("seed  learned in / reward              success %   moves   x optimum  s of CPU");
    let columns = "behaviour,seed,actions,success_share,mean_td_error";
    let mut csv = Table::create(options.out.join("figure6.csv"), columns)?;
    let mut curves = [("centering", Vec::new()), ("approaching", Vec::new())];
    let mut taught = None;
    let bar = progress_bar(8 * options.seeds as u64, "tables learned", false);
    // The seeds until a fault are drawn.
    let mut done = Ok(());
    for seed in (options.first_seed..).take(options.seeds) {
        let (centering, approaching) = match learned_with(options, seed, &starts, &bar) {
            Ok(lessons) => lessons,
            Err(error) => {
                done = Err(error);
                break;
            }
        };
        for (name, curve) in [
            ("centering", &centering.curve),
            ("approaching", &approaching.curve),
        ] {
            for record in curve {
                let cell = |value: Option<f64>| value.map_or(String::new(), |v| format!("{v:.5}"));
                let (share, error) = (cell(record.success_share), cell(record.mean_td_error));
                csv.row(format_args!(
                    "{name},{seed},{},{share},{error}",
                    record.actions
                ))?;
            }
        }
        curves[0].1.push(centering.curve);
        curves[1].1.push(approaching.curve);
        taught.get_or_insert(Learned::new(centering.behaviour, approaching.behaviour));
    }
    bar.finish_and_clear();
    let panels = curves
        .iter()
        .flat_map(|(name, seeds)| CURVES.map(|curve| Panel::of_learning(name, curve, seeds)));
    let panels: Vec<Panel> = panels.collect();
    write_svg(&options.out.join("figure6.svg"), &panels, 2, SIZE)?;
    done?;
    taught.ok_or_else(|| "at least one seed is needed".into())
}

/// Size of each panel, pixels.
const SIZE: (u32, u32) = (400, 290);

/// Learns with one seed in all simulators and with all rewards, and prints the results. Returns
/// centering, and approaching with the mended reward in the exact plane.
fn learned_with(
    options: &Options,
    seed: u64,
    starts: &[PlaneStart],
    bar: &ProgressBar,
) -> Outcome<(Lesson, Lesson)> {
    let rng = &mut Xoshiro256PlusPlus::seed_from_u64(seed);
    let plane = ExactPlane::new(20_000, rng);
    let forms = [MoveForm::Rigid22, MoveForm::Linear];
    let [rigid, linear] = simulators(&paper_cell(), forms, rng)?;
    let BehaviourPair {
        centering,
        approaching: mended,
    } = BehaviourPair::paper_mended();
    let literal = BehaviourPair::paper_literal().approaching;
    let fine = BehaviourPair::fine().approaching;
    let wide = BehaviourPair::paper_mended().with_y_goal(GoalInterval::Y_SECTION_4)?;
    let mut floored = literal.clone();
    floored.reward.floor = 1.0;
    let trials = anywhere(&rigid, TRIALS, rng);
    let centering = rigid.learn(centering, &trials, ACTIONS.0, rng, &mut until_stopped)?;
    let found = search_percepts(1_000, seed.wrapping_add(1_000_000));
    // A table of more states has more corners in which a ball can be lost.
    let more = options.fine.min(10_000) as usize;
    let more_found = search_percepts(more, seed.wrapping_add(1_000_000));
    let mut learn =
        |name, simulator: Option<&Simulator>, spec: &BehaviourSpec, trials: &[_]| -> Outcome<_> {
            let actions = if *spec == fine {
                options.fine
            } else {
                ACTIONS.1
            };
            let (spec, begin) = (spec.clone(), cpu_time());
            let lesson = match simulator {
                None => plane.learn(spec, trials, actions, rng, &mut until_stopped),
                Some(simulator) => simulator.learn(spec, trials, actions, rng, &mut until_stopped),
            };
            go_on()?;
            let seconds = cpu_time().saturating_sub(begin).as_secs_f64();
            let row = scored(&lesson, starts);
            bar.suspend(|| say!("{seed:4}  {name:32} {row}  {seconds:8.2}"));
            bar.inc(1);
            Ok(lesson)
        };
    let (found, none): (&[Percept], &[Percept]) = (&found, &[]);
    let approaching = learn("exact plane, mended", None, &mended, found)??;
    for (name, simulator, spec, trials) in [
        ("exact plane, mended, last table", None, &mended, none),
        ("exact plane, y goal 74..92", None, &wide.approaching, found),
        ("exact plane, literal", None, &literal, none),
        ("exact plane, floored only", None, &floored, none),
        ("exact plane, fine", None, &fine, &more_found),
        ("rigid regression, mended", Some(&rigid), &mended, found),
        ("linear regression, mended", Some(&linear), &mended, found),
    ] {
        let _ = learn(name, simulator, spec, trials)?;
    }
    Ok((centering, approaching))
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

/// Features and theta 3 at every step of a run, and `true` if the ball was lost by the move that
/// followed.
type Path = Vec<(Features, f64, bool)>;

/// Returns where the ball was lost on a path, for a reader of a feature.
fn lost(path: &Path, of: fn(&Features) -> f64) -> impl Iterator<Item = (f64, f64)> + '_ {
    let marked = path.iter().enumerate().filter(|(_, (.., lost))| *lost);
    marked.map(move |(i, (f, ..))| (i as f64, of(f)))
}

/// Draws features per step while reaching, by distance and elbow, and while the ball is pushed away
/// repeatedly.
fn figures_7_and_8(options: &Options, taught: &Learned) -> Outcome {
    let cell = TrialCell::draw(ErrorLevel::None, 0)?;
    let path = options.out.join("figures7and8.csv");
    let mut csv = Table::create(path, "figure,run,step,x,y,r,theta3,lost")?;
    let mut paths = |figure: u32, runs: u64, pushes: usize| -> Outcome<Vec<Path>> {
        let mut paths = Vec::new();
        for run in 0..runs {
            let path = path_of(&cell, taught, 500 + run, pushes)?;
            for (step, (Features { x, y, r }, theta3, lost)) in path.iter().enumerate() {
                let lost = u8::from(*lost);
                csv.row(format_args!(
                    "{figure},{run},{step},{x:.2},{y:.2},{r:.2},{theta3:.2},{lost}"
                ))?;
            }
            paths.push(path);
        }
        Ok(paths)
    };
    let (reach, track) = (paths(7, 60, 0)?, paths(8, 3, 3)?);
    // One figure for each interval of theta 3 that the goal is reached in, three distances in each,
    // as in the paper.
    let mut panels = Vec::new();
    for (low, high) in [(-50.0, 6.0), (6.0, 27.0), (27.0, 60.0)] {
        let ends_here = |path: &&Path| {
            let end = path.last().map(|(_, theta3, _)| *theta3);
            path.len() > 3 && end.is_some_and(|end| (low..high).contains(&end))
        };
        let mut paths: Vec<&Path> = reach.iter().filter(ends_here).collect();
        paths.sort_by(|a, b| a[0].0.r.total_cmp(&b[0].0.r));
        // "The starting position is chosen in such a way as to have the maximum off centering", at
        // each of three distances.
        let mut thirds = paths.chunks(paths.len().div_ceil(3).max(1));
        let three = ["far", "middle", "near"].map(|start| {
            let third = thirds.next().into_iter().flatten();
            let off = |path: &&&Path| off_centre(&path[0].0);
            (start, third.max_by(|a, b| off(a).total_cmp(&off(b))))
        });
        for (name, goal, _, of) in FEATURES {
            let lines = three.iter().filter_map(|(start, path)| {
                let along = path.as_ref()?.iter().enumerate();
                let line = along.map(|(i, (f, ..))| (i as f64, of(f)));
                Some((format!("{start} start"), line.collect()))
            });
            let drawn = three.iter().filter_map(|(_, path)| *path);
            panels.push(Panel {
                lost: drawn.flat_map(|path| lost(path, of)).collect(),
                title: format!("{name}, theta 3 ends in {low}..{high}"),
                across: "moves".into(),
                up: "feature units".into(),
                lines: lines.collect(),
                goal: Some(goal),
                ..Panel::default()
            });
        }
    }
    write_svg(&options.out.join("figure7.svg"), &panels, 3, SIZE)?;
    let panels = track.iter().zip(1..).map(|(path, number)| {
        let line = path.iter().enumerate().map(|(i, (f, ..))| (i as f64, f.r));
        Panel {
            title: format!("r, ball {number}, pushed to r = 60 three times"),
            across: "moves".into(),
            up: "feature units".into(),
            lines: vec![(String::new(), line.collect())],
            lost: lost(path, |f| f.r).collect(),
            goal: Some(FEATURES[2].1),
            top: Some(70.0),
            ..Panel::default()
        }
    });
    let panels: Vec<Panel> = panels.collect();
    write_svg(&options.out.join("figure8.svg"), &panels, 3, SIZE)
}

/// Returns the last sighting before each move of a run towards the ball that `seed` places. When it
/// is reached, it is pushed away, `pushes` times.
fn path_of(cell: &TrialCell, taught: &Learned, seed: u64, pushes: usize) -> Outcome<Path> {
    let mut config = cell.agent_config();
    config.max_cycles = 120;
    let mut agent = Agent::with_controller(config, taught.clone())?;
    let (mut done, mut path, mut looked_at, mut gripped) = (0, Vec::new(), None, false);
    let mut world = |cell: &mut Cell, joints: &Joints| {
        if done < pushes && cell.features(joints).is_ok_and(|f| at_goal(&f)) {
            done += usize::from(cell.push_to_radius(joints, 60.0));
        }
    };
    cell.run(&mut agent, seed, &mut world, &mut |event| {
        gripped |= event.kind == EventKind::Gripped;
        if let EventKind::Seen(sighting) = event.kind
            && !gripped
        {
            if looked_at.replace(event.cycle) == Some(event.cycle) {
                path.pop();
            }
            let f = sighting.features;
            path.push((f, Percept::new(f, &event.joints).theta3, false));
        }
        if event.kind == EventKind::Lost
            && let Some((.., lost)) = path.last_mut()
        {
            *lost = true;
        }
    })?;
    Ok(path)
}

/// Returns the distance of a ball from the goal in the image, in halves of its sides.
fn off_centre(f: &Features) -> f64 {
    ((f.x - 103.5) / 96.0).hypot((f.y - 78.0) / 72.0)
}
