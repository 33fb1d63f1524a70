//! The problems of the book.

use qtable::rand::{Rng, RngExt};
use qtable::{Action, Environment, Error, State, Status, Step};

/// Next state, reward, and `true` at the end of an episode; from state, action and steps taken.
type Rule = Box<dyn Fn(usize, usize, u64, &mut dyn Rng) -> (usize, f64, bool)>;

/// A problem that counts its steps and rewards.
pub(crate) struct World {
    shape: (usize, usize),
    start: usize,
    state: usize,
    rule: Rule,
    /// Number of actions offered in the first state.
    offered: usize,
    /// Steps taken so far.
    time: u64,
    /// Sum of all rewards so far.
    pub(crate) paid: f64,
    /// The last action taken in the first state.
    pub(crate) first: usize,
}

impl World {
    fn new(
        shape: (usize, usize),
        start: usize,
        rule: impl Fn(usize, usize, u64, &mut dyn Rng) -> (usize, f64, bool) + 'static,
    ) -> Self {
        Self {
            shape,
            start,
            state: start,
            rule: Box::new(rule),
            offered: shape.1,
            time: 0,
            paid: 0.0,
            first: 0,
        }
    }
}

impl Environment for World {
    fn states(&self) -> usize {
        self.shape.0
    }

    fn actions(&self) -> usize {
        self.shape.1
    }

    fn reset(&mut self, _rng: &mut dyn Rng) -> Result<State, Error> {
        self.state = self.start;
        Ok(State(self.state))
    }

    fn step(&mut self, action: Action, rng: &mut dyn Rng) -> Result<Step, Error> {
        if self.state == self.start {
            self.first = action.0;
        }
        let (next, reward, ends) = (self.rule)(self.state, action.0, self.time, rng);
        (self.state, self.time, self.paid) = (next, self.time + 1, self.paid + reward);
        let status = if ends {
            Status::Terminated
        } else {
            Status::Continuing
        };
        Ok(Step::new(State(next), reward, status))
    }

    fn allows(&self, state: State, action: Action) -> bool {
        state.0 != self.start || action.0 < self.offered
    }
}

/// A draw from the standard normal distribution, after Box and Muller.
pub(crate) fn normal(rng: &mut dyn Rng) -> f64 {
    let (u, v): (f64, f64) = (1.0 - rng.random::<f64>(), rng.random());
    (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

/// Up, down, left, right on a grid; off the grid stays.
fn moved(cell: usize, action: usize, (rows, columns): (usize, usize)) -> (usize, usize) {
    let (row, column) = (cell / columns, cell % columns);
    match action {
        0 => (row.saturating_sub(1), column),
        1 => ((row + 1).min(rows - 1), column),
        2 => (row, column.saturating_sub(1)),
        _ => (row, (column + 1).min(columns - 1)),
    }
}

/// Section 2.3: ten arms with normal rewards about normal means.
pub(crate) fn bandit(rng: &mut dyn Rng) -> World {
    let means = [(); 10].map(|()| normal(rng));
    World::new((1, 10), 0, move |_, arm, _, rng| {
        (0, means[arm] + normal(rng), true)
    })
}

/// Example 6.5: a grid with an upward wind.
pub(crate) fn windy() -> World {
    World::new((70, 4), 30, |cell, action, _, _| {
        let next = blown(cell, action);
        (next, -1.0, next == 37)
    })
}

/// The cell that a move on the windy grid leads to.
pub(crate) fn blown(cell: usize, action: usize) -> usize {
    const WIND: [usize; 10] = [0, 0, 0, 1, 1, 1, 2, 2, 1, 0];
    let (row, column) = moved(cell, action, (7, 10));
    row.saturating_sub(WIND[cell % 10]) * 10 + column
}

/// Example 6.6: the cliff.
pub(crate) fn cliff() -> World {
    World::new((48, 4), 36, |cell, action, _, _| {
        let (row, column) = moved(cell, action, (4, 12));
        match row * 12 + column {
            37..=46 => (36, -100.0, false),
            next => (next, -1.0, next == 47),
        }
    })
}

/// Example 6.7: left of the first state there are ten ways to lose 0.1 on the average.
pub(crate) fn bias() -> World {
    let world = World::new((2, 10), 0, |state, action, _, rng| match (state, action) {
        (0, 0) => (1, 0.0, false),
        (0, _) => (0, 0.0, true),
        _ => (0, normal(rng) - 0.1, true),
    });
    World {
        offered: 2,
        ..world
    }
}

/// Example 7.1: a random walk over 19 states that pays -1 at the left end and 1 at the right one.
pub(crate) fn walk() -> World {
    World::new((19, 1), 9, |state, _, _, rng| match rng.random::<bool>() {
        true if state == 18 => (18, 1.0, true),
        false if state == 0 => (0, -1.0, true),
        true => (state + 1, 0.0, false),
        false => (state - 1, 0.0, false),
    })
}

/// A maze of 6 x 9 cells whose walls depend on the time; the upper right corner pays 1.
fn maze(start: usize, is_wall: fn(usize, usize, u64) -> bool) -> World {
    World::new((54, 4), start, move |cell, action, time, _| {
        let (row, column) = moved(cell, action, (6, 9));
        match row * 9 + column {
            8 => (8, 1.0, true),
            _ if is_wall(row, column, time) => (cell, 0.0, false),
            next => (next, 0.0, false),
        }
    })
}

/// Example 8.1.
pub(crate) fn dyna_maze() -> World {
    maze(18, |row, column, _| {
        [(1, 2), (2, 2), (3, 2), (4, 5), (0, 7), (1, 7), (2, 7)].contains(&(row, column))
    })
}

/// Example 8.2: the way on the right closes after 1000 steps, another opens on the left.
pub(crate) fn blocking_maze() -> World {
    maze(48, |row, column, time| {
        row == 3 && column != if time < 1000 { 8 } else { 0 }
    })
}

/// Example 8.3: a shorter way opens on the right after 3000 steps.
pub(crate) fn shortcut_maze() -> World {
    maze(48, |row, column, time| {
        row == 3 && column != 0 && (column != 8 || time < 3000)
    })
}
