//! The Boltzmann policy.

use std::f64::consts::LOG2_E;
use std::ops::RangeInclusive;

use rand::{Rng, RngExt};

use crate::clock::Clock;
use crate::elementary::{PARTS, exp_within, exp2_quick};
use crate::error::Error;
use crate::policy::rule::Policy;
use crate::schedule::Schedule;
use crate::scratch::Scratch;
use crate::step::{Action, State};
use crate::table::QTable;
use crate::validated::validated;

validated! {
    /// The Boltzmann distribution over the action values, also called softmax:
    /// `p(a | s) = exp(Q(s,a)/T) / sum over b of exp(Q(s,b)/T)`, over the actions that the state
    /// offers.
    ///
    /// The row's maximum is subtracted first, so that no exponential overflows: the best action has
    /// weight 1 and the sum is never 0.
    #[derive(Clone, Debug, PartialEq)]
    pub struct Boltzmann {
        temperature: Schedule,
        clock: Clock,
        #[cfg_attr(feature = "serde", serde(skip))]
        weights: Scratch,
    }
}

/// Numbers of actions for which [`draw_of_few`] exists.
const FEW: RangeInclusive<usize> = 2..=6;

/// Factor from a number of temperatures to the unit of [`exp2_quick`].
const SLOPE: f64 = LOG2_E * PARTS as f64;

impl Boltzmann {
    /// Lowest temperature allowed.
    pub(crate) const COLDEST: f64 = 1e-6;

    /// Creates the policy with a schedule of the temperature over its choices, or over episodes, in
    /// units of the values.
    ///
    /// # Errors
    /// [`Error::Setting`] if the temperature falls below 1e-6.
    pub fn new(temperature: Schedule) -> Result<Self, Error> {
        Self {
            temperature,
            clock: Clock::default(),
            weights: Scratch::default(),
        }
        .restore()
    }

    /// Returns the temperature of the next choice.
    #[inline]
    pub fn temperature(&self) -> f64 {
        self.temperature.at_time(&self.clock)
    }

    /// Counts a choice that was made from cached weights.
    #[inline(always)]
    pub(crate) fn tick(&mut self) {
        self.clock.tick();
    }

    fn restore(self) -> Result<Self, Error> {
        let (low, high) = (Self::COLDEST, f64::MAX);
        self.temperature
            .check("the temperature", low, high, "at least 1e-6")?;
        Ok(self)
    }
}

impl Policy for Boltzmann {
    #[inline(always)]
    fn choose(&mut self, table: &QTable, state: State, rng: &mut dyn Rng) -> Action {
        let temperature = self.temperature.current(&mut self.clock, 0);
        self.clock.tick();
        if FEW.contains(&table.actions()) && !table.is_restricted() {
            let (highest, slope) = (table.max(state), SLOPE / temperature);
            let uniform = rng.random();
            let drawn = match *table.row(state) {
                [a, b] => draw_of_few([a, b], highest, slope, uniform),
                [a, b, c] => draw_of_few([a, b, c], highest, slope, uniform),
                [a, b, c, d] => draw_of_few([a, b, c, d], highest, slope, uniform),
                [a, b, c, d, e] => draw_of_few([a, b, c, d, e], highest, slope, uniform),
                [a, b, c, d, e, f] => draw_of_few([a, b, c, d, e, f], highest, slope, uniform),
                _ => None,
            };
            return drawn.map_or_else(|| table.best(state), Action);
        }
        let weights = self.weights.of_length(table.actions());
        let sum = boltzmann_weights(table, state, temperature, weights);
        let mut rest = rng.random::<f64>() * sum;
        for (action, &weight) in weights.iter().enumerate() {
            rest -= weight;
            if rest < 0.0 {
                return Action(action);
            }
        }
        // Rounding left a crumb after the last action.
        table.best(state)
    }

    fn probabilities(&self, table: &QTable, state: State, probabilities: &mut [f64]) -> bool {
        let sum = boltzmann_weights(table, state, self.temperature(), probabilities);
        for p in probabilities {
            *p /= sum;
        }
        true
    }

    fn begin_episode(&mut self) {
        self.clock.begin_episode();
    }
}

/// Draws one of a few actions, which waits for one exponential and not for a loop of them. Returns
/// `None` if rounding left a crumb after the last action.
#[inline(always)]
fn draw_of_few<const N: usize>(
    row: [f64; N],
    highest: f64,
    slope: f64,
    uniform: f64,
) -> Option<usize> {
    let mut ends = [0.0; N];
    for (end, value) in ends.iter_mut().zip(row) {
        *end = exp2_quick((value - highest) * slope);
    }
    for action in 1..N {
        ends[action] += ends[action - 1];
    }
    let drawn = uniform * ends[N - 1];
    ends.iter().position(|&end| drawn < end)
}

/// Writes `exp((Q - max Q) / T)` for each action (0 below `exp(-700)`), 0 for forbidden ones, and
/// returns the sum.
fn boltzmann_weights(table: &QTable, state: State, temperature: f64, weights: &mut [f64]) -> f64 {
    let highest = table.max(state);
    for (weight, value) in weights.iter_mut().zip(table.row(state)) {
        let exponent = (value - highest) / temperature;
        // Below this an ordinary number cannot hold it; not a branch, but a choice of two values.
        *weight = if exponent < -700.0 {
            0.0
        } else {
            exp_within(exponent)
        };
    }
    if let Some(mask) = table.mask_row(state) {
        for (weight, &allowed) in weights.iter_mut().zip(mask) {
            if !allowed {
                *weight = 0.0;
            }
        }
    }
    weights.iter().sum()
}
