//! The same on the feature shortcut: no frames, no line, many runs in little time.

use std::error::Error;

use grasp_agent::{Agent, Hybrid, HybridSettings};
use pipeline_sim::Cell;
use puma_grasp::TrialCell;
use puma_val2::Joints;

use crate::{Counted, Fate, Options, Tally, World};

pub(crate) fn run(options: &Options) -> Result<(), Box<dyn Error>> {
    let mut tally = Tally::default();
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
            // Nothing happens to the ball before it is seen, nor when it is looked at again without a move, nor in the jaws.
            let (mut seen, mut looked_from) = (false, None);
            let mut go_on = |cell: &mut Cell, joints: &Joints| {
                let moved = looked_from.replace(*joints) != Some(*joints);
                if seen && moved && cell.held.is_none() {
                    world.go_on(cell, joints);
                }
                seen |= cell.features(joints).is_some();
            };
            let result = cell.run(&mut agent, 1_000 * seed + ball as u64, &mut go_on, &mut |_| ())?;
            let Some(result) = result.filter(|_| !teaching) else {
                continue;
            };
            tally.add(Counted {
                happened: world.has_happened(),
                success: result.outcome.gave_up.is_none() && result.held,
                moves: result.outcome.cycles,
                near: result.near,
                collisions: 0,
            });
        }
    }
    println!("{tally}");
    Ok(())
}
