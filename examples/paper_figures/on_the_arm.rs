//! From simulation to the arm: success of the behaviours at once, and after learning on the arm.

use std::error::Error;
use std::fmt::Write as _;

use grasp_agent::{Agent, AgentConfig, BehaviourPair, GoalInterval, Learned, OnlineLearning};
use pipeline_sim::{Ball, Cell, ErrorLevel, MoveForm};
use puma_grasp::Simulator;
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

use example_support::learning::learn_both;
use example_support::plot::{Panel, drawn};
use example_support::say;
use example_support::trial::TrialCell;
use example_support::wilson::wilson;

/// Moves on the arm after which the behaviours are measured.
const MOVES: [usize; 4] = [0, 500, 2_000, 10_000];
/// Balls in a row without a move after which learning gives up.
const IDLE: usize = 100;
/// Balls by which the frozen behaviours are measured.
const BALLS: u64 = 40;

/// Figure and table.
pub(crate) struct Report {
    pub(crate) svg: String,
    pub(crate) csv: String,
}

/// Learns in both regression simulators, takes the behaviours to `seeds` arms with errors drawn
/// anew, and lets them go on learning there.
pub(crate) fn from_simulation_to_the_arm(seeds: u64) -> Result<Report, Box<dyn Error>> {
    say!(
        "\nFrom simulation to the arm: the behaviours at once, and after learning on there from so \
         many moves"
    );
    say!(
        "learned in          errors of the arm  goal   moves learned from  success %  \
         95 % interval  moves of a success"
    );
    let mut csv = String::from(
        "learned_in,errors,goal,moves_learned_from,success_percent,interval_low,interval_high,\
         moves\n",
    );
    let mut panels = Vec::new();
    for (name, form) in [
        ("rigid regression", MoveForm::Rigid22),
        ("linear regression", MoveForm::Linear),
    ] {
        let mut lines = Vec::new();
        for level in [ErrorLevel::None, ErrorLevel::Moderate, ErrorLevel::Heavy] {
            // Per seed: centering at once, then the whole task after each number of moves.
            let mut scores: Vec<Vec<(f64, f64)>> = Vec::new();
            for seed in 0..seeds {
                scores.push(one_arm(form, level, seed)?);
            }
            let mut line = Vec::new();
            for (column, (goal, made)) in std::iter::once(("x", 0))
                .chain(MOVES.map(|made| ("all", made)))
                .enumerate()
            {
                let success: Vec<f64> = scores.iter().map(|score| score[column].0).collect();
                let arms = success.len() as f64;
                let mean = success.iter().sum::<f64>() / arms;
                // Each arm counts as one trial: its balls share its errors.
                let [low, high] = wilson(0.01 * mean, arms);
                let moves: Vec<f64> = scores
                    .iter()
                    .map(|score| score[column].1)
                    .filter(|moves| moves.is_finite())
                    .collect();
                let moves = moves.iter().sum::<f64>() / moves.len() as f64;
                let interval = format!("{low:.1}..{high:.1}");
                // NaN without a success.
                let moves = if moves.is_finite() {
                    format!("{moves:.1}")
                } else {
                    String::new()
                };
                let errors = level.to_string();
                say!(
                    "{name:19} {errors:18} {goal:5} {made:19}  {mean:9.1} {interval:>14} \
                     {moves:>18}"
                );
                let _ = writeln!(
                    csv,
                    "{name},{level},{goal},{made},{mean:.2},{low:.2},{high:.2},{moves}"
                );
                if goal == "all" {
                    line.push((made as f64, mean));
                }
            }
            lines.push((format!("errors: {level}"), line));
        }
        let title = format!("goal reached, %, first learned in the {name}");
        panels.push(Panel::new(&title, "moves learned from on the arm", lines).up_to(105.0));
    }
    Ok(Report {
        svg: drawn(&panels, 2, (400, 290))?,
        csv,
    })
}

/// Returns success in percent and moves per success on one arm: centering at once, then the whole
/// task after each of [`MOVES`].
fn one_arm(
    form: MoveForm,
    level: ErrorLevel,
    seed: u64,
) -> Result<Vec<(f64, f64)>, Box<dyn Error>> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let (centering, reaching) =
        Cell::paper(Ball::at(0.6, 0.0, -0.1)).sample_moves(2_500, 0.5, &mut rng)?;
    let simulator = Simulator::fit(&centering, &reaching, form)?;
    let pair = BehaviourPair::paper_mended();
    let only_x = pair.centering.goal.clone();
    let learned = learn_both(&simulator, pair, 1_000 + seed, &mut rng)?;

    let cell = TrialCell::draw(level, 50 + seed)?.without_bodies();
    let mut scores = vec![score(&cell, &learned, Some(only_x))?];
    let config = cell.agent_config();
    let learning = learned.learning(OnlineLearning::careful(seed))?;
    let mut agent = Agent::with_controller(config, learning)?;
    let (mut made, mut ball, mut idle) = (0, 0, 0);
    for moves in MOVES {
        while made < moves {
            let result = cell.run(&mut agent, 1_000_000 + ball, &mut |_, _| (), &mut |_| ())?;
            let cycles = result.map_or(0, |result| result.outcome.cycles);
            made += cycles;
            ball += 1;
            idle = if cycles == 0 { idle + 1 } else { 0 };
            if idle > IDLE {
                return Err(format!(
                    "the arm of seed {seed} with {level} errors came to no move in {idle} balls"
                )
                .into());
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
) -> Result<(f64, f64), Box<dyn Error>> {
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
    Ok((
        100.0 * f64::from(reached) / f64::from(runs),
        moves as f64 / f64::from(reached),
    ))
}
