//! FrozenLake, CliffWalking and a chain.

use crate::error::{Error, check_setting};
use crate::model::{Model, ModelEnvironment, Outcome};
use crate::step::{Action, State};

/// The small lake of FrozenLake: `S`tart, `F`rozen, `H`ole, `G`oal.
pub const FROZEN_LAKE_4X4: [&str; 4] = ["SFFF", "FHFH", "FFFH", "HFFG"];

/// The large lake of FrozenLake.
pub const FROZEN_LAKE_8X8: [&str; 8] = [
    "SFFFFFFF", "FFFFFFFF", "FFFHFFFF", "FFFFFHFF", "FFFHFFFF", "FHHFFFHF", "FHFFHFHF", "FFFHFFFG",
];

/// Creates FrozenLake-v1: cross the ice from `S` to `G` without falling into a hole.
///
/// States are `row * columns + column`. Actions: 0 left, 1 down, 2 right, 3 up; a move off the map
/// stays. On slippery ice the move goes the way asked for or to either side of it, each with
/// probability 1/3. The goal pays 1, all else 0; goal and holes end the episode.
///
/// # Errors
/// A map without a cell, with a letter other than these four, whose rows are not equally long, or
/// without a start.
pub fn frozen_lake(map: &[&str], slippery: bool) -> Result<ModelEnvironment, Error> {
    for (row, cells) in map.iter().enumerate() {
        if let Some((column, letter)) = cells
            .chars()
            .enumerate()
            .find(|(_, cell)| !"SFHG".contains(*cell))
        {
            return Err(Error::MapLetter {
                letter,
                row,
                column,
            });
        }
    }
    let (rows, columns) = (map.len(), map.first().map_or(0, |row| row.len()));
    if let Some(row) = map.iter().find(|row| row.len() != columns) {
        return Err(Error::WrongLength {
            what: "a row of the map",
            needed: columns,
            found: row.len(),
        });
    }
    let cells: Vec<u8> = map.iter().flat_map(|row| row.bytes()).collect();
    let model = Model::new(rows * columns, 4, |state, action| {
        let ends = |cell: State| matches!(cells[cell.0], b'G' | b'H');
        if ends(state) {
            return vec![Outcome::certain(state, 0.0, true)];
        }
        let ways = if slippery {
            vec![(action.0 + 3) % 4, action.0, (action.0 + 1) % 4]
        } else {
            vec![action.0]
        };
        let probability = 1.0 / ways.len() as f64;
        let outcome = |way: &usize| {
            let direction = [
                Direction::Left,
                Direction::Down,
                Direction::Right,
                Direction::Up,
            ][*way];
            let next = direction.from(state, rows, columns);
            let reward = if cells[next.0] == b'G' { 1.0 } else { 0.0 };
            Outcome {
                probability,
                next,
                reward,
                terminated: ends(next),
            }
        };
        ways.iter().map(outcome).collect()
    })?;
    let starts: Vec<State> = (0..cells.len())
        .filter(|&cell| cells[cell] == b'S')
        .map(State)
        .collect();
    let share = 1.0 / starts.len() as f64;
    ModelEnvironment::new(
        model,
        &starts
            .iter()
            .map(|&state| (state, share))
            .collect::<Vec<_>>(),
    )
    .map(ModelEnvironment::with_success_by_reward)
}

/// Creates CliffWalking-v1: walk from the lower left to the lower right corner of a 4x12 grid,
/// along a cliff.
///
/// States are `row * 12 + column`; the start is 36, the goal 47, the cliff 37 to 46. Actions: 0 up,
/// 1 right, 2 down, 3 left; a move off the grid stays. Every move pays -1, one into the cliff -100
/// and leads back to the start. The goal ends the episode, and that is a success. The best return
/// is -13.
///
/// # Errors
/// None for this map; the type is that of all toys.
pub fn cliff_walking() -> Result<ModelEnvironment, Error> {
    const START: State = State(36);
    const GOAL: State = State(47);
    let model = Model::new(48, 4, |state, action| {
        if state == GOAL {
            return vec![Outcome::certain(GOAL, 0.0, true)];
        }
        let direction = [
            Direction::Up,
            Direction::Right,
            Direction::Down,
            Direction::Left,
        ][action.0]
            .from(state, 4, 12);
        vec![match direction.0 {
            37..=46 => Outcome::certain(START, -100.0, false),
            _ => Outcome::certain(direction, -1.0, direction == GOAL),
        }]
    })?;
    ModelEnvironment::new(model, &[(START, 1.0)])
}

/// Creates a row of `length` cells. Action 0 goes left (at the left end it stays), action 1 right;
/// the right end pays 1 and ends the episode. From the left end on.
///
/// The optimum is `V*(s) = γ^(length - 2 - s)` for every cell but the last.
///
/// # Errors
/// [`Error::Setting`] for a length below 2.
pub fn chain(length: usize) -> Result<ModelEnvironment, Error> {
    check_setting("length", length as f64, length >= 2, "at least 2")?;
    let end = State(length - 1);
    let model = Model::new(length, 2, |state, action| {
        let next = match action {
            Action(0) => State(state.0.saturating_sub(1)),
            _ => State(state.0 + 1),
        };
        vec![if state == end {
            Outcome::certain(end, 0.0, true)
        } else {
            Outcome::certain(next, if next == end { 1.0 } else { 0.0 }, next == end)
        }]
    })?;
    ModelEnvironment::new(model, &[(State(0), 1.0)])
}

#[derive(Clone, Copy)]
enum Direction {
    Left,
    Down,
    Right,
    Up,
}

impl Direction {
    /// Returns the cell one step away, or the same cell at the border of the grid.
    fn from(self, state: State, rows: usize, columns: usize) -> State {
        let (row, column) = (state.0 / columns, state.0 % columns);
        let (row, column) = match self {
            Self::Left => (row, column.saturating_sub(1)),
            Self::Down => ((row + 1).min(rows - 1), column),
            Self::Right => (row, (column + 1).min(columns - 1)),
            Self::Up => (row.saturating_sub(1), column),
        };
        State(row * columns + column)
    }
}
