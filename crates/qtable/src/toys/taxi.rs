//! Taxi-v4.

use crate::error::Error;
use crate::model::{Model, ModelEnvironment, Outcome};
use crate::step::{Action, State};

/// Row and column of the four stands: 0 red, 1 green, 2 yellow, 3 blue.
const TAXI_STANDS: [(usize, usize); 4] = [(0, 0), (0, 4), (4, 0), (4, 3)];

/// The passenger's place while in the taxi.
const IN_TAXI: usize = 4;

/// For each row, `true` if no wall stands between a column and the next one to the east.
const OPEN_TO_THE_EAST: [[bool; 4]; 5] = [
    [true, false, true, true],
    [true, false, true, true],
    [true, true, true, true],
    [false, true, false, true],
    [false, true, false, true],
];

impl ModelEnvironment {
    /// Creates Taxi-v4: fetch the passenger at one of four stands and bring them to another, on a
    /// 5x5 grid with walls.
    ///
    /// States are `((row * 5 + column) * 5 + passenger) * 4 + destination`; the passenger is at
    /// stand 0 to 3 (red, green, yellow, blue), or 4 for in the taxi. Actions: 0 south, 1 north, 2
    /// east, 3 west, 4 pick up, 5 drop off; a move into a wall stays. Every action pays -1, an
    /// impossible pick-up or drop-off -10, the drop-off at the destination 20 and ends the episode.
    /// A drop-off at another stand leaves the passenger there. The 300 first states, with the
    /// passenger at a stand other than the destination, are equally likely.
    ///
    /// # Errors
    /// None for this map; the type is that of all presets.
    pub fn taxi() -> Result<Self, Error> {
        let model = Model::new(500, 6, |state, action| vec![outcome(state, action)])?;
        // The passenger is at a stand other than the destination.
        let is_start = |state: &usize| state / 4 % 5 != IN_TAXI && state / 4 % 5 != state % 4;
        let starts = (0..500).filter(is_start);
        let start: Vec<_> = starts.map(|state| (State(state), 1.0 / 300.0)).collect();
        Self::new(model, &start)
    }
}

/// Returns the number of a state.
fn taxi_state(row: usize, column: usize, passenger: usize, destination: usize) -> State {
    State(((row * 5 + column) * 5 + passenger) * 4 + destination)
}

fn outcome(state: State, action: Action) -> Outcome {
    let (place, passenger, destination) = (state.0 / 20, state.0 / 4 % 5, state.0 % 4);
    let (row, column) = (place / 5, place % 5);
    let stand = TAXI_STANDS.iter().position(|&stand| stand == (row, column));
    let at = |row, column| {
        Outcome::certain(taxi_state(row, column, passenger, destination), -1.0, false)
    };
    let with = |passenger, reward, terminated| {
        Outcome::certain(
            taxi_state(row, column, passenger, destination),
            reward,
            terminated,
        )
    };
    match action.0 {
        0 => at((row + 1).min(4), column),
        1 => at(row.saturating_sub(1), column),
        2 if column < 4 && OPEN_TO_THE_EAST[row][column] => at(row, column + 1),
        3 if column > 0 && OPEN_TO_THE_EAST[row][column - 1] => at(row, column - 1),
        4 if passenger < IN_TAXI && stand == Some(passenger) => with(IN_TAXI, -1.0, false),
        5 if passenger == IN_TAXI && stand == Some(destination) => with(destination, 20.0, true),
        5 if passenger == IN_TAXI => match stand {
            Some(stand) => with(stand, -1.0, false),
            None => with(IN_TAXI, -10.0, false),
        },
        4 | 5 => with(passenger, -10.0, false),
        _ => at(row, column),
    }
}
