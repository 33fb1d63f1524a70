//! The same on the feature shortcut: no frames, no line, many runs in little time.

use std::error::Error;

use grasp_agent::{Agent, Hybrid, HybridSettings, SavedController, SavedRun};
use pipeline_sim::Cell;
use puma_grasp::TrialCell;
use puma_val2::Joints;

use crate::{Counted, Fate, Options, Tally, World, keep_run, writable_folder};

pub(crate) fn run(options: &Options) -> Result<(), Box<dyn Error>> {
    writable_folder(&options.out)?;
    let mut tally = Tally::default();
    let done = go_for_balls(options, &mut tally);
    println!("{tally}");
    done
}

fn go_for_balls(options: &Options, tally: &mut Tally) -> Result<(), Box<dyn Error>> {
    for number in 0..options.cells {
        tally.begin_cell();
        let seed = options.seed.wrapping_add(number as u64);
        let cell = TrialCell::draw(options.level, seed)?;
        let mut config = cell.agent_config();
        config.max_cycles = 120;
        let mut agent = Agent::with_controller(config, Hybrid::new(HybridSettings::paper()))?;
        for ball in 0..options.teach + options.runs_in(number) {
            let teaching = ball < options.teach;
            if ball == options.teach {
                let learned = agent.controller().clone().frozen();
                agent = Agent::with_controller(agent.config().clone(), learned)?;
            }
            let fate = if teaching { Fate::Rest } else { options.ball };
            let mut world = World::new(fate, ball as u64);
            // Nothing happens to the ball before it is seen, nor when it is looked at again without
            // a move, nor in the jaws.
            let (mut seen, mut looked_from) = (false, None);
            let mut go_on = |cell: &mut Cell, joints: &Joints| {
                let moved = looked_from.replace(*joints) != Some(*joints);
                if seen && moved && cell.held.is_none() {
                    world.go_on(cell, joints);
                }
                seen |= cell.features(joints).is_some();
            };
            let mut saved =
                SavedRun::before(&agent, SavedController::of_hybrid(agent.controller()));
            let ball_seed = seed.wrapping_mul(1_000).wrapping_add(ball as u64);
            let end = cell.run(&mut agent, ball_seed, &mut go_on, &mut |event| {
                saved.note(event)
            });
            if teaching {
                if let Err(error) = end {
                    let kept = keep_run(&options.out, "teaching", &saved)?;
                    return Err(format!("teaching was broken off: {error}; {kept}").into());
                }
                continue;
            }
            let result = match &end {
                Ok(Some(result)) => Some(result),
                Ok(None) => continue,
                Err(_) => None,
            };
            let success =
                result.is_some_and(|result| result.outcome.gave_up.is_none() && result.held);
            tally.add(Counted {
                happened: world.has_happened(),
                success,
                moves: result.map_or(0, |result| result.outcome.cycles),
                near: result.map_or(0, |result| result.near),
                collisions: None,
            });
            if !success {
                let run = tally.runs();
                let kept = keep_run(&options.out, &format!("run-{run:03}"), &saved)?;
                let why = match (&end, result.and_then(|result| result.outcome.gave_up)) {
                    (Err(error), _) => error.to_string(),
                    (_, Some(reason)) => reason.to_string(),
                    _ => "the jaws hold no ball, though none is seen either".into(),
                };
                println!("run {run}: not grasped: {why}; {kept}");
            }
        }
    }
    Ok(())
}
