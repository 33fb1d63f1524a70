//! From simulation to the arm: success of the behaviours at once, and after learning on the arm.

use std::path::Path;

use grasp_agent::{Agent, AgentConfig, BehaviourPair, GoalInterval, Learned, OnlineLearning};
use indicatif::ProgressBar;
use pipeline_sim::{ErrorLevel, MoveForm};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

use example_support::learning::{learn_both, paper_cell, simulators};
use example_support::plot::{Panel, write_svg};
use example_support::prelude::*;
use example_support::program::on_threads;
use example_support::tally::wilson;
use example_support::trial::TrialCell;

use crate::SIZE;

/// Moves on the arm after which the behaviours are measured.
const MOVES: [usize; 4] = [0, 500, 2_000, 10_000];
/// Balls in a row without a move after which learning gives up.
const IDLE: usize = 100;
/// Balls by which the frozen behaviours are measured.
const BALLS: u64 = 40;

/// Success in percent, and moves of a success.
type Score = (f64, f64);

/// Learns in both regression simulators, takes the behaviours to `arms` arms with errors drawn
/// anew, and lets them go on learning there. Writes figure and table to the folder `out`.
pub(crate) fn from_simulation_to_the_arm(arms: usize, out: &Path) -> Outcome {
    say!(
        "\nFrom simulation to the arm: the behaviours at once, and after learning on there from so \
         many moves"
    );
    say!(
        "learned in          errors of the arm  goal   moves learned from  success %  \
         95 % interval  moves of a success"
    );
    let columns = "learned_in,errors,goal,moves_learned_from,success_percent,interval_low,\
                   interval_high,moves";
    let mut csv = Table::create(out.join("on_the_arm.csv"), columns)?;
    let bar = progress_bar(6 * arms as u64, "arms", false);
    let mut panels = Vec::new();
    let done = measure(arms, &bar, &mut csv, &mut panels);
    bar.finish_and_clear();
    // The arms until a fault are drawn.
    done.and(write_svg(&out.join("on_the_arm.svg"), &panels, 2, SIZE))
}

/// Writes the rows of all simulators and levels, and adds a diagram for each simulator.
fn measure(arms: usize, bar: &ProgressBar, csv: &mut Table, panels: &mut Vec<Panel>) -> Outcome {
    for (name, form) in [
        ("rigid regression", MoveForm::Rigid22),
        ("linear regression", MoveForm::Linear),
    ] {
        panels.push(Panel {
            title: format!("first learned in the {name}"),
            across: "moves learned from on the arm".into(),
            up: "goal reached, %".into(),
            top: Some(105.0),
            ..Panel::default()
        });
        for level in [ErrorLevel::None, ErrorLevel::Moderate, ErrorLevel::Heavy] {
            // Of each arm: centering at once, then the whole task after each number of moves.
            let mut scores = Vec::new();
            on_threads(None, arms, &mut scores, |seed| {
                let scores = one_arm(form, level, seed as u64)?;
                bar.inc(1);
                Ok(scores)
            })?;
            let mut line = Vec::new();
            let measured = std::iter::once(("x", 0)).chain(MOVES.map(|made| ("all", made)));
            for (column, (goal, made)) in measured.enumerate() {
                let column = || scores.iter().map(|score| score[column]);
                let mean = column().map(|score| score.0).sum::<f64>() / arms as f64;
                // Each arm counts as one trial: its balls share its errors.
                let [low, high] = wilson(0.01 * mean, arms as f64);
                // NaN without a success.
                let moves = column()
                    .map(|score| score.1)
                    .filter(|moves| moves.is_finite());
                let moves = moves.clone().sum::<f64>() / moves.count() as f64;
                let moves = if moves.is_finite() {
                    format!("{moves:.1}")
                } else {
                    String::new()
                };
                let (interval, errors) = (format!("{low:.1}..{high:.1}"), level.to_string());
                let row = format!(
                    "{name:19} {errors:18} {goal:5} {made:19}  {mean:9.1} {interval:>14} \
                     {moves:>18}"
                );
                bar.suspend(|| say!("{row}"));
                csv.row(format_args!(
                    "{name},{level},{goal},{made},{mean:.2},{low:.2},{high:.2},{moves}"
                ))?;
                if goal == "all" {
                    line.push((made as f64, mean));
                }
            }
            if let Some(panel) = panels.last_mut() {
                panel.lines.push((format!("errors: {level}"), line));
            }
        }
    }
    Ok(())
}

/// Returns the scores on one arm: centering at once, then the whole task after each of [`MOVES`].
fn one_arm(form: MoveForm, level: ErrorLevel, seed: u64) -> Outcome<Vec<Score>> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let [simulator] = simulators(&paper_cell(), [form], &mut rng)?;
    let pair = BehaviourPair::paper_mended();
    let only_x = pair.centering.goal.clone();
    let learned = learn_both(&simulator, pair, 1_000 + seed, &mut rng)?;

    let cell = TrialCell::draw(level, 50 + seed)?.without_bodies();
    let mut scores = vec![score(&cell, &learned, Some(only_x))?];
    let learning = learned.learning(OnlineLearning::careful(seed))?;
    let mut agent = Agent::with_controller(cell.agent_config(), learning)?;
    let (mut made, mut ball, mut idle) = (0, 0, 0);
    for moves in MOVES {
        while made < moves {
            go_on()?;
            let result = cell.run(&mut agent, 1_000_000 + ball, &mut |_, _| (), &mut |_| ())?;
            let cycles = result.map_or(0, |result| result.outcome.cycles);
            made += cycles;
            ball += 1;
            idle = if cycles == 0 { idle + 1 } else { 0 };
            if idle > IDLE {
                let arm = format!("the arm of seed {seed} with {level} errors");
                return Err(format!("{arm} came to no move in {idle} balls").into());
            }
        }
        scores.push(score(&cell, &agent.controller().clone().frozen(), None)?);
    }
    Ok(scores)
}

fn score(
    cell: &TrialCell,
    controller: &Learned,
    goal: Option<Vec<GoalInterval>>,
) -> Outcome<Score> {
    let config = cell.agent_config();
    let config = AgentConfig {
        goal: goal.unwrap_or(config.goal),
        ..config
    };
    let mut agent = Agent::with_controller(config, controller.clone())?;
    let (mut runs, mut reached, mut moves) = (0, 0, 0);
    for ball in 0..BALLS {
        let Some(result) = cell.run(&mut agent, ball, &mut |_, _| (), &mut |_| ())? else {
            continue;
        };
        runs += 1;
        if result.at_goal.is_some() {
            reached += 1;
            moves += result.outcome.cycles;
        }
    }
    let share = 100.0 * f64::from(reached) / f64::from(runs);
    Ok((share, moves as f64 / f64::from(reached)))
}
