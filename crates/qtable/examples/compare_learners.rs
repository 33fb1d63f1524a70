//! All learners on one problem with ten seeds: the value of what each has learned beside the
//! optimum.
//!
//! `cargo run --release -p qtable --features parallel --example compare_learners -- taxi`, or
//! `chain`, `cliff`, `lake`, `slippery-lake`.
#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use qtable::rand::{SeedableRng, rngs::Xoshiro256PlusPlus};
use qtable::{
    DoubleQLearning, DynaQ, EpsilonGreedy, Error, Estimate, ExpectedSarsa, Learner, NStepQ,
    PrioritizedSweeping, QLambda, QLearning, QTable, Sarsa, SarsaLambda, Schedule, Ties, Training,
    Until, over_seeds, toys,
};

const GAMMA: f64 = 0.99;

type Make = fn(&QTable, Schedule) -> Result<Box<dyn Learner>, Error>;

const LEARNERS: [(&str, Make); 9] = [
    ("Q-learning", |_, alpha| {
        Ok(Box::new(QLearning::new(alpha, GAMMA)?))
    }),
    ("SARSA", |_, alpha| Ok(Box::new(Sarsa::new(alpha, GAMMA)?))),
    ("Expected SARSA", |_, alpha| {
        Ok(Box::new(ExpectedSarsa::new(alpha, GAMMA)?))
    }),
    ("Double Q", |table, alpha| {
        Ok(Box::new(DoubleQLearning::new(table, alpha, GAMMA)?))
    }),
    ("Q(λ)", |_, alpha| {
        Ok(Box::new(QLambda::new(alpha, GAMMA)?))
    }),
    ("SARSA(λ)", |_, alpha| {
        Ok(Box::new(SarsaLambda::new(alpha, GAMMA)?))
    }),
    ("4-step Q", |_, alpha| {
        Ok(Box::new(NStepQ::new(alpha, GAMMA)?))
    }),
    ("Dyna-Q", |table, alpha| {
        Ok(Box::new(DynaQ::new(table, alpha, GAMMA)?))
    }),
    ("Prioritized sweeping", |table, _| {
        Ok(Box::new(PrioritizedSweeping::new(table, GAMMA)?))
    }),
];

fn main() -> Result<(), Error> {
    let small = &toys::FROZEN_LAKE_4X4;
    let (world, actions, limit) = match std::env::args().nth(1).as_deref() {
        Some("chain") => (toys::chain(12)?, 40_000, 500),
        Some("lake") => (toys::frozen_lake(small, false)?, 20_000, 100),
        Some("slippery-lake") => (toys::frozen_lake(small, true)?, 500_000, 100),
        Some("taxi") => (toys::taxi()?, 400_000, 200),
        _ => (toys::cliff_walking()?, 60_000, 500),
    };
    let n = actions;
    // A smaller α at the end averages out the chance of the slippery lake.
    let alpha = Schedule::exponential(0.2, if n == 500_000 { 0.002 } else { 0.2 }, n)?;
    let epsilon = Schedule::piecewise(&[(0, 1.0), (n / 4, 0.3), (n / 2, 0.1), (n * 3 / 4, 0.0)])?;
    let mut optimum = 0.0;
    for (name, make) in LEARNERS {
        let runs = over_seeds(0..10, |seed| {
            let table = QTable::new(world.model().states(), world.model().actions())?;
            let learner = make(&table, alpha.clone())?;
            let policy = EpsilonGreedy::new(epsilon.clone())?.with_ties(Ties::Random);
            let mut training =
                Training::new(&world, table, learner, policy)?.with_episode_limit(limit)?;
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            training.run(&mut world.clone(), Until::Actions(n), &mut rng)?;
            world.compare(training.table(), GAMMA, limit)
        })?;
        optimum = runs[0].optimal.value;
        let values: Vec<f64> = runs.iter().map(|both| both.learned.value).collect();
        let best = values
            .iter()
            .filter(|value| **value > optimum - 1e-6)
            .count();
        println!(
            "{name:22} {:>18.4}  optimal in {best} of 10 seeds",
            Estimate::of(&values)
        );
    }
    println!("{:22} {optimum:>8.4}", "optimum");
    Ok(())
}
