//! FrozenLake with ten seeds: the learned policy beside the optimum, and its arrows.
//!
//! `cargo run --release -p qtable --example frozen_lake -- 8x8 slippery`
#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use qtable::rand::{SeedableRng, rngs::Xoshiro256PlusPlus};
use qtable::{
    EpsilonGreedy, Error, Estimate, ModelEnvironment, QLearning, QTable, Schedule, State, Training,
    Until, over_seeds, toys,
};

const GAMMA: f64 = 0.99;
const ACTIONS: u64 = 300_000;

fn main() -> Result<(), Error> {
    let arguments: Vec<String> = std::env::args().collect();
    let given = |word: &str| arguments.iter().any(|argument| argument == word);
    let (map, limit): (&[&str], u64) = if given("8x8") {
        (&toys::FROZEN_LAKE_8X8, 200)
    } else {
        (&toys::FROZEN_LAKE_4X4, 100)
    };
    let lake = toys::frozen_lake(map, given("slippery"))?;
    let tables = over_seeds(0..10, |seed| learn(&lake, limit, seed))?;

    let mut shares = Vec::new();
    for table in &tables {
        shares.push(lake.assess(&table.greedy(), GAMMA, limit)?.success);
    }
    let optimal = lake.compare(&tables[0], GAMMA, limit)?.optimal.success;
    let learned = Estimate::of(&shares);
    println!("success within {limit} steps: {learned} (mean of 10 seeds, 95 % interval)");
    println!("the best there can be:        {optimal:.3}\nthe policy of seed 0:");
    for (row, cells) in map.iter().enumerate() {
        let signs = cells.bytes().enumerate().map(|(column, cell)| match cell {
            b'H' => " ○",
            b'G' => " ★",
            _ => {
                let state = State(row * cells.len() + column);
                [" ←", " ↓", " →", " ↑"][tables[0].best(state).0]
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
