//! FrozenLake with ten seeds: the learned policy beside the optimum, and its arrows.
//!
//! `cargo run --release -p qtable --example frozen_lake -- 8x8 slippery`
#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use qtable::rand::{SeedableRng, rngs::Xoshiro256PlusPlus};
use qtable::{
    Action, EpsilonGreedy, Error, Estimate, ModelEnvironment, Outcome, QLearning, QTable, Schedule,
    State, Training, Until, over_seeds,
};

const GAMMA: f64 = 0.99;
const ACTIONS: u64 = 300_000;

fn main() -> Result<(), Error> {
    let arguments: Vec<String> = std::env::args().collect();
    let given = |word: &str| arguments.iter().any(|argument| argument == word);
    let (map, limit) = if given("8x8") {
        ("8x8", 200)
    } else {
        ("4x4", 100)
    };
    let lake = ModelEnvironment::frozen_lake(map, given("slippery"))?;
    let tables = over_seeds(0..10, |seed| learn(&lake, limit, seed))?;

    let mut shares = Vec::new();
    for table in &tables {
        shares.push(lake.assess(&table.greedy(), GAMMA, limit)?.success);
    }
    let [_, optimal] = lake.compare(&tables[0], GAMMA, limit)?;
    let learned = Estimate::of(&shares);
    println!("success within {limit} steps: {learned} (mean of 10 seeds, 95 % interval)");
    let best = optimal.success;
    println!("the best there can be:        {best:.3}\nthe policy of seed 0:");
    let columns = limit as usize / 25;
    for row in 0..columns {
        let cells = (0..columns).map(|column| State(row * columns + column));
        let signs = cells.map(|state| {
            let ends = Outcome::certain(state, 0.0, true);
            match lake.model().outcomes(state, Action(0)) == [ends] {
                true if state.0 + 1 == columns * columns => " ★",
                true => " ○",
                false => [" ←", " ↓", " →", " ↑"][tables[0].best(state).0],
            }
        });
        println!("  {}", signs.collect::<String>());
    }
    Ok(())
}

fn learn(lake: &ModelEnvironment, limit: u64, seed: u64) -> Result<QTable, Error> {
    let learner = QLearning::new(Schedule::inverse_visits(1.0, 50.0)?, GAMMA)?;
    let epsilon = Schedule::piecewise(&[(0, 1.0), (ACTIONS / 2, 0.2), (ACTIONS, 0.0)])?;
    // The values start above all that can be earned, so that what was not tried looks good.
    let table = QTable::filled(lake.model().states(), lake.model().actions(), 1.0)?;
    let mut training = Training::new(lake, table, learner, EpsilonGreedy::new(epsilon)?)?
        .with_episode_limit(limit)?;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    training.run(&mut lake.clone(), Until::Actions(ACTIONS), &mut rng)?;
    Ok(training.into_parts().0)
}
