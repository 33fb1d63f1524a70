//! The same on the feature shortcut: no frames, no line, many runs in little time.

use std::error::Error;

use grasp_agent::{Agent, AgentConfig, Hybrid, HybridSettings};
use pipeline_sim::Cell;
use puma_grasp::TrialCell;
use puma_val2::Joints;

use crate::{Fate, GRASP_TOLERANCE, Options, World, say_result};

/// Cells that the runs are spread over, each with errors drawn anew, in each of which the controller learns first.
const CELLS: usize = 10;

pub(crate) fn run(options: &Options) -> Result<(), Box<dyn Error>> {
    let (mut grasped, mut moves, mut near, mut runs) = (0, 0, 0, 0);
    for number in 0..CELLS {
        let seed = options.seed.wrapping_add(number as u64);
        let cell = TrialCell::draw(options.level, seed)?;
        let mut config = cell.agent_config();
        config.max_cycles = 120;
        let mut agent = Agent::with_controller(config, Hybrid::new(HybridSettings::paper()))?;
        let balls = (options.runs + CELLS - 1 - number) / CELLS;
        for ball in 0..options.teach + balls {
            let teaching = ball < options.teach;
            if ball == options.teach {
                let learned = agent.controller().clone().frozen();
                agent = Agent::with_controller(agent.config().clone(), learned)?;
            }
            let fate = if teaching { Fate::Rest } else { options.ball };
            let mut world = World::new(fate, ball as u64);
            // Nothing happens to the ball before it is seen.
            let mut seen = false;
            let mut go_on = |cell: &mut Cell, joints: &Joints| {
                if seen {
                    world.go_on(cell, joints);
                }
                seen |= cell.features(joints).is_some();
            };
            let result = cell.run(&mut agent, 1_000 * seed + ball as u64, &mut go_on, &mut |_| ())?;
            let Some(result) = result.filter(|_| !teaching) else {
                continue;
            };
            runs += 1;
            let gripped = result.outcome.gave_up.is_none();
            grasped += usize::from(gripped && result.miss.is_some_and(|miss| miss < GRASP_TOLERANCE));
            moves += result.outcome.cycles;
            near += result.near;
        }
    }
    say_result(grasped, runs, moves, near);
    Ok(())
}
