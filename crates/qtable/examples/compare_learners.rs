//! All learners on one problem with ten seeds: the value of what each has learned beside the
//! optimum.
//!
//! `cargo run --release -p qtable --features parallel --example compare_learners -- taxi`, or
//! `chain`, `cliff`, `lake`, `slippery-lake`.
#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use qtable::rand::{SeedableRng, rngs::Xoshiro256PlusPlus};
use qtable::{
    DoubleQLearning, DynaQ, EpsilonGreedy, Error, Estimate, Learner, ModelEnvironment, NStep,
    PrioritizedSweeping, QLearning, QTable, Schedule, Target, Traces, Training, Until, over_seeds,
};

const GAMMA: f64 = 0.99;
const NAMES: [&str; 11] = [
    "Q-learning",
    "SARSA",
    "Expected SARSA",
    "4-step Q",
    "4-step SARSA",
    "4-step tree backup",
    "Q(λ)",
    "SARSA(λ)",
    "Double Q",
    "Dyna-Q",
    "Prioritized sweeping",
];

fn learner(name: &str, table: &QTable, alpha: &Schedule) -> Result<Box<dyn Learner>, Error> {
    let n_step = |target, n| NStep::new(target, n, alpha.clone(), GAMMA);
    let traces = |target| Traces::new(target, 0.8, alpha.clone(), GAMMA);
    Ok(match name {
        "SARSA" => Box::new(n_step(Target::Sarsa, 1)?),
        "Expected SARSA" => Box::new(n_step(Target::ExpectedSarsa, 1)?),
        "4-step Q" => Box::new(n_step(Target::Q, 4)?),
        "4-step SARSA" => Box::new(n_step(Target::Sarsa, 4)?),
        "4-step tree backup" => Box::new(n_step(Target::TreeBackup, 4)?),
        "Q(λ)" => Box::new(traces(Target::Q)?),
        "SARSA(λ)" => Box::new(traces(Target::Sarsa)?),
        "Double Q" => Box::new(DoubleQLearning::new(table, alpha.clone(), GAMMA)?),
        "Dyna-Q" => Box::new(DynaQ::new(table, alpha.clone(), GAMMA)?),
        "Prioritized sweeping" => Box::new(PrioritizedSweeping::new(table, GAMMA)?),
        _ => Box::new(QLearning::new(alpha.clone(), GAMMA)?),
    })
}

fn main() -> Result<(), Error> {
    let (world, n, limit) = match std::env::args().nth(1).as_deref() {
        Some("chain") => (ModelEnvironment::chain(12)?, 40_000, 500),
        Some("lake") => (ModelEnvironment::frozen_lake("4x4", false)?, 20_000, 100),
        Some("slippery-lake") => (ModelEnvironment::frozen_lake("4x4", true)?, 500_000, 100),
        Some("taxi") => (ModelEnvironment::taxi()?, 400_000, 200),
        _ => (ModelEnvironment::cliff_walking()?, 60_000, 500),
    };
    // A smaller α at the end averages out the chance of the slippery lake.
    let alpha = Schedule::exponential(0.2, if n == 500_000 { 0.002 } else { 0.2 }, n)?;
    let epsilon = Schedule::piecewise(&[(0, 1.0), (n / 4, 0.3), (n / 2, 0.1), (n * 3 / 4, 0.0)])?;
    let mut optimum = 0.0;
    for name in NAMES {
        let runs = over_seeds(0..10, |seed| {
            let table = QTable::new(world.model().states(), world.model().actions())?;
            let learner = learner(name, &table, &alpha)?;
            let policy = EpsilonGreedy::new(epsilon.clone())?;
            let training = Training::new(&world, table, learner, policy)?;
            let mut training = training.with_episode_limit(limit)?;
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            training.run(&mut world.clone(), Until::Actions(n), &mut rng)?;
            world.compare(training.table(), GAMMA, limit)
        })?;
        optimum = runs[0][1].value;
        let values: Vec<f64> = runs.iter().map(|[learned, _]| learned.value).collect();
        let best = values.iter().filter(|value| **value > optimum - 1e-6);
        let (estimate, best) = (Estimate::of(&values), best.count());
        println!("{name:22} {estimate:>18.4}  optimal in {best} of 10 seeds");
    }
    println!("{:22} {optimum:>8.4}", "optimum");
    Ok(())
}
