//! The Boltzmann policy.

use rand::{Rng, RngExt};

use crate::clock::Clock;
use crate::elementary::exp_within;
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
