//! FrozenLake, CliffWalking and a chain.

use crate::error::{Error, check_length, check_setting};
use crate::model::{Model, ModelEnvironment, Outcome};
use crate::step::{Action, State};

const LAKE_4X4: &str = "SFFF FHFH FFFH HFFG";
const LAKE_8X8: &str = "SFFFFFFF FFFFFFFF FFFHFFFF FFFFFHFF FFFHFFFF FHHFFFHF FHFFHFHF FFFHFFFG";

impl ModelEnvironment {
    /// Creates FrozenLake-v1: cross the ice from `S` to `G` without falling into a hole.
    ///
    /// The map is `"4x4"`, `"8x8"`, or its rows parted by white space: `S`tart, `F`rozen, `H`ole,
    /// `G`oal. States are `row * columns + column`. Actions: 0 left, 1 down, 2 right, 3 up; a move
    /// off the map stays. On slippery ice the move goes the way asked for or to either side of it,
    /// each with probability 1/3. The goal pays 1, all else 0; goal and holes end the episode, and
    /// only the goal is a success.
    ///
    /// # Errors
    /// A map without a cell, with another letter, whose rows are not equally long, or without a
    /// start.
    pub fn frozen_lake(map: &str, slippery: bool) -> Result<Self, Error> {
        let map = match map {
            "4x4" => LAKE_4X4,
            "8x8" => LAKE_8X8,
            own => own,
        };
        let (mut cells, mut rows, mut columns) = (Vec::new(), 0, 0);
        for (row, line) in map.split_whitespace().enumerate() {
            let unknown = |&(_, letter): &(usize, char)| !"SFHG".contains(letter);
            if let Some((column, letter)) = line.chars().enumerate().find(unknown) {
                return Err(Error::MapLetter(letter, row, column));
            }
            if row > 0 {
                check_length("a row of the map", columns, line.len())?;
            }
            cells.extend(line.bytes());
            (rows, columns) = (row + 1, line.len());
        }
        let ends = |cell: State| matches!(cells[cell.0], b'G' | b'H');
        let model = Model::new(rows * columns, 4, |state, Action(action)| {
            if ends(state) {
                return vec![Outcome::certain(state, 0.0, true)];
            }
            let ways = match slippery {
                true => vec![(action + 3) % 4, action, (action + 1) % 4],
                false => vec![action],
            };
            let outcome = |way: &usize| {
                let next = moved(state, LEFT_DOWN_RIGHT_UP[*way], rows, columns);
                let reward = f64::from(u8::from(cells[next.0] == b'G'));
                Outcome {
                    probability: 1.0 / ways.len() as f64,
                    ..Outcome::certain(next, reward, ends(next))
                }
            };
            ways.iter().map(outcome).collect()
        })?;
        let starts = (0..cells.len()).filter(|&cell| cells[cell] == b'S');
        let share = 1.0 / starts.clone().count() as f64;
        let start: Vec<_> = starts.map(|cell| (State(cell), share)).collect();
        Ok(Self::new(model, &start)?.with_success_by_reward())
    }

    /// Creates CliffWalking-v1 (Sutton and Barto, example 6.6): walk from the lower left to the
    /// lower right corner of a 4x12 grid, along a cliff.
    ///
    /// States are `row * 12 + column`; the start is 36, the goal 47, the cliff 37 to 46. Actions: 0
    /// up, 1 right, 2 down, 3 left; a move off the grid stays. Every move pays -1, one into the
    /// cliff -100 and leads back to the start. The goal ends the episode, and that is a success.
    /// The best return is -13.
    ///
    /// # Errors
    /// None for this map; the type is that of all presets.
    pub fn cliff_walking() -> Result<Self, Error> {
        const START: State = State(36);
        const GOAL: State = State(47);
        const WAYS: [(isize, isize); 4] = [(-1, 0), (0, 1), (1, 0), (0, -1)];
        let model = Model::new(48, 4, |state, Action(action)| {
            let next = moved(state, WAYS[action], 4, 12);
            vec![match next {
                _ if state == GOAL => Outcome::certain(GOAL, 0.0, true),
                State(37..=46) => Outcome::certain(START, -100.0, false),
                _ => Outcome::certain(next, -1.0, next == GOAL),
            }]
        })?;
        Self::new(model, &[(START, 1.0)])
    }

    /// Creates a row of `length` cells. Action 0 goes left (at the left end it stays), action 1
    /// right; the right end pays 1 and ends the episode. From the left end on.
    ///
    /// The optimum is `V*(s) = γ^(length - 2 - s)` for every cell but the last.
    ///
    /// # Errors
    /// [`Error::Setting`] for a length below 2.
    pub fn chain(length: usize) -> Result<Self, Error> {
        check_setting("length", length as f64, length >= 2, "at least 2")?;
        let end = State(length - 1);
        let model = Model::new(length, 2, |State(cell), action| {
            let next = match action {
                Action(0) => State(cell.saturating_sub(1)),
                _ => State((cell + 1).min(end.0)),
            };
            vec![match State(cell) == end {
                true => Outcome::certain(end, 0.0, true),
                false => Outcome::certain(next, f64::from(u8::from(next == end)), next == end),
            }]
        })?;
        Self::new(model, &[(State(0), 1.0)])
    }
}

/// Rows and columns that the actions of a frozen lake go.
const LEFT_DOWN_RIGHT_UP: [(isize, isize); 4] = [(0, -1), (1, 0), (0, 1), (-1, 0)];

/// Returns the cell that a move leads to, the same cell at the border of the grid.
fn moved(State(cell): State, way: (isize, isize), rows: usize, columns: usize) -> State {
    let row = (cell / columns).saturating_add_signed(way.0).min(rows - 1);
    let column = (cell % columns)
        .saturating_add_signed(way.1)
        .min(columns - 1);
    State(row * columns + column)
}
