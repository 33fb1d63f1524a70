//! Boltzmann exploration on cached weights.

use std::f64::consts::LOG2_E;
use std::ops::Range;

use rand::Rng;

use crate::elementary::{PARTS, exp2_parts};
use crate::error::{Error, check_finite, check_index, check_setting};
use crate::policy::Boltzmann;
use crate::step::{Action, State, Status, Step};
use crate::table::QTable;

/// Actions of a group, and blocks of a row: as many sums as are compared at once.
const GROUP: usize = 16;
const BLOCKS: usize = 8;
/// A row's offset follows its maximum once they are this many temperatures apart. The largest
/// weight of a row lies within `exp(±30)`, where even the sum of a million of them is far from the
/// ends of `f32`.
const DRIFT: f64 = 30.0;

/// A table of `f32` for Q-learning with Boltzmann exploration at one temperature, which computes
/// one exponential for each *update* instead of one for each action of each choice.
///
/// The weights `exp((Q - c) / T)` are kept beside the values, with one offset c for each state and
/// running sums over the eight blocks of a row and within each block. A choice compares them with
/// one random number, without a branch and without a sum; an update writes one weight and sums its
/// block anew, so that no error builds up.
///
/// While T stands still the distribution is that of [`Boltzmann`] to single precision and 24 random
/// bits: no probability is off by more than `1e-6 + 1e-8` for each action of the row, and an action
/// of a probability below 6e-8 may never be drawn. A change of the temperature rebuilds all
/// weights, so it is made in blocks of many actions:
/// [`Training::run_in_blocks`](crate::Training::run_in_blocks). Below 8 actions [`Boltzmann`]
/// itself is faster. Methods that return no `Result` panic outside the table.
///
/// ```
/// use qtable::rand::{SeedableRng, rngs::Xoshiro256PlusPlus};
/// use qtable::{CachedBoltzmann, QTable, State, Status, Step};
///
/// fn main() -> Result<(), qtable::Error> {
///     let mut table = QTable::new(1, 81)?;
///     let mut cached = CachedBoltzmann::new(&table, 0.5)?;
///     let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
///     let action = cached.choose(State(0), &mut rng);
///     let step = Step { observation: State(0), reward: 1.0, status: Status::Terminated };
///     cached.update(State(0), action, &step, 0.1, 0.9)?;
///     cached.write_to(&mut table)?;
///     assert_eq!(table.best(State(0)), action);
///     Ok(())
/// }
/// ```
#[derive(Clone, Debug)]
pub struct CachedBoltzmann {
    actions: usize,
    groups_per_row: usize,
    /// Groups of a block, as a power of two: 0 for up to 128 actions.
    block_shift: u32,
    temperature: f64,
    /// Growth of a weight's exponent with the value, in parts of an octave.
    slope: f64,
    heads: Vec<Head>,
    groups: Vec<Group>,
}

/// Data of a state, aligned so that no vector lies across two cache lines.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
struct Head {
    /// The sum of the weights of all blocks before each.
    starts: [f32; BLOCKS],
    /// The sum of all weights.
    total: f32,
    max: f32,
    best: u32,
    /// The value beyond which the offset has to follow.
    ceiling: f32,
    /// The offset c.
    offset: f64,
    /// The sum of the weights of each block.
    sums: [f32; BLOCKS],
}

/// Data of 16 actions.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Group {
    /// Values; negative infinity for the padding of a row and for forbidden actions.
    values: [f32; GROUP],
    /// Weights; 0 for the padding and for forbidden actions.
    weights: [f32; GROUP],
    /// The sum of the weights of the block up to and with each.
    ends: [f32; GROUP],
    visits: [u32; GROUP],
}

const NO_ACTIONS: Group = Group {
    values: [f32::NEG_INFINITY; GROUP],
    weights: [0.0; GROUP],
    ends: [0.0; GROUP],
    visits: [0; GROUP],
};

impl CachedBoltzmann {
    /// Copies values, visits and mask of a table and makes the weights for a temperature, in units
    /// of the values.
    ///
    /// # Errors
    /// A temperature below 1e-6, or a value too large for `f32`.
    pub fn new(table: &QTable, temperature: f64) -> Result<Self, Error> {
        let (states, actions) = (table.states(), table.actions());
        let groups_per_row = actions.div_ceil(GROUP);
        let per_block = groups_per_row.div_ceil(BLOCKS).next_power_of_two();
        let mut cached = Self {
            actions,
            groups_per_row,
            block_shift: per_block.trailing_zeros(),
            temperature: 1.0,
            slope: 1.0,
            heads: vec![Head::default(); states],
            groups: vec![NO_ACTIONS; states * groups_per_row],
        };
        for state in (0..states).map(State) {
            for action in table.offered(state) {
                let value = table.value(state, action);
                let group = &mut cached.groups[state.0 * groups_per_row + action.0 / GROUP];
                let stored = value as f32;
                check_finite("value", state, action, f64::from(stored))?;
                group.values[action.0 % GROUP] = stored;
                group.visits[action.0 % GROUP] = table.visits(state, action);
            }
            cached.find_best(state);
        }
        cached.set_temperature(temperature)?;
        Ok(cached)
    }

    /// Changes the temperature and rebuilds all weights.
    ///
    /// # Errors
    /// A temperature below 1e-6.
    pub fn set_temperature(&mut self, temperature: f64) -> Result<(), Error> {
        let valid = (Boltzmann::COLDEST..=f64::MAX).contains(&temperature);
        check_setting("the temperature", temperature, valid, "at least 1e-6")?;
        self.temperature = temperature;
        self.slope = PARTS as f64 * LOG2_E / temperature;
        for state in 0..self.heads.len() {
            self.rebuild(State(state));
        }
        Ok(())
    }

    /// Makes one step of Q-learning with a given α: `action` taken in `state` led to `step`.
    /// Counts the visit and returns the error before the update. Nothing is bootstrapped through a
    /// step that terminated the episode.
    ///
    /// # Errors
    /// A state or action out of range or forbidden, a reward that is not finite, or a value that
    /// would not be. α and γ are not checked.
    #[inline(always)]
    pub fn update(
        &mut self,
        state: State,
        action: Action,
        step: &Step,
        alpha: f64,
        gamma: f64,
    ) -> Result<f64, Error> {
        let at = state.0 * self.groups_per_row + action.0 / GROUP;
        let next = self.heads.get(step.observation.0).map(|head| head.max);
        let (true, Some(next), Some(head), Some(group)) = (
            action.0 < self.actions,
            next,
            self.heads.get_mut(state.0),
            self.groups.get_mut(at),
        ) else {
            return Err(self.fault(state, action, step, f64::NAN));
        };
        let lane = action.0 % GROUP;
        let old = group.values[lane];
        let next = match step.status {
            Status::Terminated => 0.0,
            Status::Continuing | Status::Truncated => gamma * f64::from(next),
        };
        let error = step.reward + next - f64::from(old);
        let wanted = f64::from(old) + alpha * error;
        let value = wanted as f32;
        // Neither is it finite where the reward is not, nor where the action is forbidden.
        if !value.is_finite() {
            return Err(self.fault(state, action, step, wanted));
        }
        group.values[lane] = value;
        group.visits[lane] = group.visits[lane].saturating_add(1);

        // Selected, not branched to: the best action may be taken now and then, which no processor
        // foresees.
        let index = action.0 as u32;
        let falls = (index == head.best) & (value < old);
        let leads = (value > head.max) | ((value >= head.max) & (index < head.best));
        head.max = if value > head.max { value } else { head.max };
        head.best = if leads { index } else { head.best };

        group.weights[lane] = exp2_parts((f64::from(value) - head.offset) * self.slope);
        let block = ((action.0 / GROUP) >> self.block_shift) % BLOCKS;
        if self.block_shift == 0 {
            head.sums[block] = group.sum(-0.0);
        } else {
            let groups = block_of(state, block, self.groups_per_row, self.block_shift);
            head.sums[block] = sum_block(&mut self.groups[groups]);
        }
        head.sum();
        if falls | (value > head.ceiling) {
            self.follow(state, falls);
        }
        Ok(error)
    }

    /// Returns the error of an update that cannot be made.
    #[cold]
    #[inline(never)]
    fn fault(&self, state: State, action: Action, step: &Step, value: f64) -> Error {
        let states = self.heads.len();
        let checked = check_index("state", state.0, states)
            .and_then(|()| check_index("state", step.observation.0, states))
            .and_then(|()| check_index("action", action.0, self.actions));
        if let Err(error) = checked {
            return error;
        }
        if self.value(state, action) == f32::NEG_INFINITY {
            return Error::ActionNotAllowed(state, action);
        }
        let reward = check_finite("reward", state, action, step.reward);
        reward.err().unwrap_or(Error::NotFinite {
            what: "value",
            state,
            action,
            value,
        })
    }

    /// Writes values and visits back into a table of the same shape and mask.
    ///
    /// # Errors
    /// [`Error::ShapeMismatch`], or a table that forbids an action that was allowed here.
    pub fn write_to(&self, table: &mut QTable) -> Result<(), Error> {
        table.check_shape("the cached table", (self.heads.len(), self.actions))?;
        for state in (0..self.heads.len()).map(State) {
            for action in (0..self.actions).map(Action) {
                let value = self.value(state, action);
                if value > f32::NEG_INFINITY {
                    table.set(state, action, f64::from(value))?;
                    table.set_visits(state, action, self.visits(state, action));
                }
            }
        }
        Ok(())
    }

    /// Draws an action with its probability by Boltzmann.
    #[inline(always)]
    pub fn choose<R: Rng + ?Sized>(&self, state: State, rng: &mut R) -> Action {
        // As many random bits as an f32 holds; all that is drawn is below the total.
        let uniform = (rng.next_u64() >> 40) as u32 as i32 as f32 * (1.0 / (1u32 << 24) as f32);
        let head = &self.heads[state.0];
        let drawn = uniform * head.total;
        // The first block starts at 0, so it is counted always.
        let block = count_up_to(&head.starts[1..], drawn) % BLOCKS;
        let rest = drawn - head.starts[block];
        if self.block_shift > 0 {
            return self.choose_within(state, block, rest);
        }
        let lane = count_up_to(
            &self.groups[state.0 * self.groups_per_row + block].ends,
            rest,
        );
        // Rounding may lead past the last weight.
        if lane < GROUP {
            Action(block * GROUP + lane)
        } else {
            self.best(state)
        }
    }

    /// Returns the action within a block of several groups.
    #[inline(never)]
    fn choose_within(&self, state: State, block: usize, rest: f32) -> Action {
        let groups = block_of(state, block, self.groups_per_row, self.block_shift);
        let ends = self.groups[groups.clone()].iter().map(|group| &group.ends);
        let place: usize = ends.map(|ends| count_up_to(ends, rest)).sum();
        if place < groups.len() * GROUP {
            Action((block << self.block_shift) * GROUP + place)
        } else {
            self.best(state)
        }
    }

    /// Writes the probability of each action into `probabilities`, one entry for each.
    pub fn probabilities(&self, state: State, probabilities: &mut [f64]) {
        let weights = self.row(state).iter().flat_map(|group| group.weights);
        let weights = weights.map(f64::from);
        let sum: f64 = weights.clone().sum();
        for (p, weight) in probabilities.iter_mut().zip(weights) {
            *p = weight / sum;
        }
    }

    /// Returns the value of a pair, negative infinity for a forbidden one.
    pub fn value(&self, state: State, action: Action) -> f32 {
        let (index, actions) = (action.0, self.actions);
        assert!(index < actions, "action {index} is outside 0..{actions}");
        self.row(state)[index / GROUP].values[index % GROUP]
    }

    /// Returns how often a pair inside the table was visited.
    #[inline]
    pub(crate) fn visits(&self, state: State, action: Action) -> u32 {
        self.row(state)[action.0 / GROUP].visits[action.0 % GROUP]
    }

    /// Returns the highest value of a state.
    #[inline(always)]
    pub fn max(&self, state: State) -> f32 {
        self.heads[state.0].max
    }

    /// Returns the action of the highest value; of several, the one with the lowest index.
    #[inline(always)]
    pub fn best(&self, state: State) -> Action {
        Action(self.heads[state.0].best as usize)
    }

    /// Checks that a state lies in the table.
    #[inline(always)]
    pub(crate) fn check_state(&self, state: State) -> Result<(), Error> {
        check_index("state", state.0, self.heads.len())
    }

    fn row(&self, state: State) -> &[Group] {
        &self.groups[state.0 * self.groups_per_row..][..self.groups_per_row]
    }

    #[inline(never)]
    fn find_best(&mut self, state: State) {
        let row = &self.groups[state.0 * self.groups_per_row..][..self.groups_per_row];
        // Lane by lane, so that it is done with vectors.
        let mut lanes = [f32::NEG_INFINITY; GROUP];
        for group in row {
            for (lane, value) in lanes.iter_mut().zip(group.values) {
                *lane = if value > *lane { value } else { *lane };
            }
        }
        let max = lanes.into_iter().fold(f32::NEG_INFINITY, f32::max);
        let head = &mut self.heads[state.0];
        head.max = max;
        for (start, group) in row.iter().enumerate() {
            if let Some(lane) = group.values.iter().position(|&value| value >= max) {
                head.best = (start * GROUP + lane) as u32;
                break;
            }
        }
    }

    /// Finds the maximum after it fell, and moves the offset if it is far.
    #[inline(never)]
    fn follow(&mut self, state: State, falls: bool) {
        if falls {
            self.find_best(state);
        }
        let head = &self.heads[state.0];
        if (f64::from(head.max) - head.offset).abs() > DRIFT * self.temperature {
            self.rebuild(state);
        }
    }

    /// Moves the offset to the maximum and computes the whole row.
    fn rebuild(&mut self, state: State) {
        let head = &mut self.heads[state.0];
        head.offset = f64::from(head.max);
        let ceiling = head.offset + DRIFT * self.temperature;
        head.ceiling = ceiling as f32;
        if f64::from(head.ceiling) > ceiling {
            head.ceiling = head.ceiling.next_down();
        }
        let row = &mut self.groups[state.0 * self.groups_per_row..][..self.groups_per_row];
        for group in row {
            for (weight, value) in group.weights.iter_mut().zip(group.values) {
                *weight = exp2_parts((f64::from(value) - head.offset) * self.slope);
            }
        }
        for block in 0..self.groups_per_row.div_ceil(1 << self.block_shift) {
            let groups = block_of(state, block, self.groups_per_row, self.block_shift);
            head.sums[block] = sum_block(&mut self.groups[groups]);
        }
        head.sum();
    }
}

/// Returns the groups of a block.
fn block_of(state: State, block: usize, per_row: usize, shift: u32) -> Range<usize> {
    let (start, first) = (state.0 * per_row, block << shift);
    start + first..start + (first + (1 << shift)).min(per_row)
}

/// Sums a block anew.
#[inline(never)]
fn sum_block(groups: &mut [Group]) -> f32 {
    groups.iter_mut().fold(-0.0, |sum, group| group.sum(sum))
}

// Nothing is added to an old sum, so no error builds up. One weight after the other, not as a tree:
// so sums never fall along a row, and those before and after a weight of 0 are equal, so that it
// cannot be drawn.
impl Group {
    /// Sums the weights anew, beyond the sum of those before; -0 if there is none, which changes no
    /// number.
    #[inline(always)]
    fn sum(&mut self, before: f32) -> f32 {
        let mut sum = before;
        for (end, weight) in self.ends.iter_mut().zip(self.weights) {
            sum += weight;
            *end = sum;
        }
        sum
    }
}

impl Head {
    /// Sums the blocks anew.
    #[inline(always)]
    fn sum(&mut self) {
        let mut sum = self.sums[0];
        for (start, block) in self.starts.iter_mut().zip(self.sums).skip(1) {
            *start = sum;
            sum += block;
        }
        self.total = sum;
    }
}

/// Returns the number of sums up to `point`. No sum is negative, so that comparing their bits as
/// integers gives the order of the numbers, and is fast with and without vectors.
#[inline(always)]
fn count_up_to(sums: &[f32], point: f32) -> usize {
    let point = point.to_bits() as i32;
    let beyond: i32 = sums
        .iter()
        .map(|sum| (point - sum.to_bits() as i32) >> 31)
        .sum();
    (sums.len() as i32 + beyond) as usize
}
