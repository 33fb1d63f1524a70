//! An environment of your own, learned, saved, loaded and tried.
//!
//! `cargo run -p qtable --example own_environment`
#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use qtable::rand::rngs::Xoshiro256PlusPlus;
use qtable::rand::{Rng, RngExt, SeedableRng};
use qtable::{
    Action, Environment, EpsilonGreedy, Error, Greedy, QLearning, QTable, Schedule, State, Status,
    Step, Training, Until, evaluate, load, save,
};

/// A boat on a river five metres wide: the current pushes it down, the far bank at the jetty pays.
struct Crossing {
    across: usize,
    down: usize,
}

const WIDTH: usize = 5;
const LENGTH: usize = 12;
const JETTY: usize = 6;

impl Environment for Crossing {
    fn states(&self) -> usize {
        WIDTH * LENGTH
    }

    /// 0 rows up the river, 1 across it, 2 drifts.
    fn actions(&self) -> usize {
        3
    }

    fn reset(&mut self, _rng: &mut dyn Rng) -> Result<State, Error> {
        (self.across, self.down) = (0, JETTY);
        Ok(State(self.across * LENGTH + self.down))
    }

    fn step(&mut self, action: Action, rng: &mut dyn Rng) -> Result<Step, Error> {
        match action.0 {
            0 => self.down = self.down.saturating_sub(2),
            1 => self.across += 1,
            _ => {}
        }
        self.down = (self.down + rng.random_range(0..=1)).min(LENGTH - 1);
        let landed = self.across == WIDTH - 1;
        Ok(Step {
            observation: State(self.across * LENGTH + self.down),
            reward: if landed {
                10.0 - self.down.abs_diff(JETTY) as f64
            } else {
                -0.1
            },
            status: if landed {
                Status::Terminated
            } else {
                Status::Continuing
            },
        })
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut river = Crossing { across: 0, down: 0 };
    let learner = QLearning::new(Schedule::inverse_visits(1.0, 20.0)?, 0.99)?;
    let policy = EpsilonGreedy::new(Schedule::linear(1.0, 0.1, 40_000)?)?;
    let table = QTable::new(river.states(), river.actions())?;
    let mut training = Training::new(&river, table, learner, policy)?.with_episode_limit(100)?;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    training.run(&mut river, Until::Actions(50_000), &mut rng)?;

    let path = std::env::temp_dir().join("crossing.qt");
    save(&path, "crossing/1", training.table())?;
    let table: QTable = load(&path, "crossing/1")?;
    let found = evaluate(&mut river, &table, &mut Greedy, 1_000, 100, &mut rng)?;
    println!(
        "mean return {:.2} in {:.1} steps",
        found.mean_return, found.mean_steps
    );
    std::fs::remove_file(path)?;
    Ok(())
}
