//! Tic-tac-toe learned by self play: two runs play each other, then a player who plays at random.
//!
//! `cargo run --release -p qtable --example tic_tac_toe`
#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use qtable::rand::{Rng, SeedableRng, rngs::Xoshiro256PlusPlus};
use qtable::{
    Action, Environment, EpsilonGreedy, Error, Keys, QLearning, QTable, Schedule, State, Status,
    Step, Training,
};

const LINES: [[usize; 3]; 8] = [
    [0, 1, 2],
    [3, 4, 5],
    [6, 7, 8],
    [0, 3, 6],
    [1, 4, 7],
    [2, 5, 8],
    [0, 4, 8],
    [2, 4, 6],
];

/// The board as the player sees it who moves next: 1 own, 2 of the other, 0 free.
struct Board {
    keys: Keys<[u8; 9]>,
    cells: [u8; 9],
    player: usize,
}

impl Environment for Board {
    fn states(&self) -> usize {
        self.keys.states()
    }

    fn actions(&self) -> usize {
        9
    }

    fn reset(&mut self, _rng: &mut dyn Rng) -> Result<State, Error> {
        (self.cells, self.player) = ([0; 9], 0);
        self.keys.state(&self.cells)
    }

    fn step(&mut self, action: Action, _rng: &mut dyn Rng) -> Result<Step, Error> {
        self.cells[action.0] = 1;
        let won = LINES
            .iter()
            .any(|line| line.iter().all(|&cell| self.cells[cell] == 1));
        let status = match won || !self.cells.contains(&0) {
            true => Status::Terminated,
            false => Status::Continuing,
        };
        self.cells = self.cells.map(|cell| [0, 2, 1][usize::from(cell)]);
        self.player = 1 - self.player;
        let state = self.keys.state(&self.cells)?;
        Ok(Step::new(state, if won { 1.0 } else { 0.0 }, status))
    }

    fn allows(&self, state: State, action: Action) -> bool {
        self.keys
            .key(state)
            .is_none_or(|cells| cells[action.0] == 0)
    }

    fn is_dynamic(&self) -> bool {
        true
    }

    fn player(&self) -> usize {
        self.player
    }
}

type Player = Training<QLearning, EpsilonGreedy>;

fn player(board: &Board, alpha: f64, epsilon: Schedule) -> Result<Player, Error> {
    let learner = QLearning::new(Schedule::constant(alpha)?, 1.0)?;
    let policy = EpsilonGreedy::new(epsilon)?;
    Training::new(board, QTable::new(board.states(), 9)?, learner, policy)?.with_record_every(1_000)
}

fn main() -> Result<(), Error> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let (keys, cells) = (Keys::new(10_000), [0; 9]);
    let mut board = Board {
        keys,
        cells,
        player: 0,
    };
    let fading = Schedule::linear(1.0, 0.0, 350_000)?;
    let mut cross = player(&board, 0.2, fading.clone())?;
    let mut nought = player(&board, 0.2, fading)?;
    cross.run_against(&mut nought, &mut board, 100_000, &mut rng)?;
    let returns = |of: &Player| of.curve().last().and_then(|record| record.mean_return);
    println!("{} positions met", board.states());
    println!(
        "mean return of X against O at the end: {:+.3}",
        returns(&cross).unwrap_or(f64::NAN)
    );
    for place in [0, 1] {
        let mut random = player(&board, 0.0, Schedule::constant(1.0)?)?;
        let mut learned = [&cross, &nought][place].clone();
        learned = learned.with_record_every(3_000)?;
        learned.take_curve();
        match place {
            0 => learned.run_against(&mut random, &mut board, 4_000, &mut rng)?,
            _ => random.run_against(&mut learned, &mut board, 4_000, &mut rng)?,
        }
        let mean = returns(&learned).unwrap_or(f64::NAN);
        println!("{} against a random player: {mean:+.3}", ["X", "O"][place]);
    }
    Ok(())
}
