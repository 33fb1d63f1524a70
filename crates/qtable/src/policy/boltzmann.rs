//! The Boltzmann policy, in its plain form.

use rand::{Rng, RngExt};
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::elementary::exp_within;
use crate::error::Error;
use crate::index::{Action, State};
use crate::policy::rule::Policy;
use crate::schedule::Schedule;
use crate::scratch::Scratch;
use crate::table::{QTable, Value};
use crate::validated::validated;

/// The Boltzmann distribution over the action values (the paper's Eq. 4), also called softmax:
/// `p(a | s) = exp(Q(s,a)/T) / sum over b of exp(Q(s,b)/T)`, over the actions that the state
/// offers.
///
/// The row's maximum is subtracted first, so that nothing overflows for any finite values and any
/// temperature: the best action has weight 1 and the sum is never 0. Equal values have equal
/// probabilities.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(Serialize, Deserialize),
    serde(remote = "Self")
)]
pub struct Boltzmann {
    temperature: Schedule,
    choices: u64,
    #[cfg_attr(feature = "serde", serde(skip))]
    weights: Scratch,
}

impl Boltzmann {
    /// Lowest temperature allowed.
    pub const COLDEST: f64 = 1e-6;
    /// Highest temperature allowed.
    pub const HOTTEST: f64 = 1e6;

    /// With the temperature, in units of the values, following a schedule over the choices made.
    ///
    /// # Errors
    /// [`Error::ScheduleRange`] if the temperature leaves `1e-6..=1e6`.
    pub fn new(temperature: Schedule) -> Result<Self, Error> {
        Self {
            temperature,
            choices: 0,
            weights: Scratch::default(),
        }
        .restore()
    }

    /// The temperature of the next choice.
    pub fn temperature(&self) -> f64 {
        self.temperature.at(self.choices)
    }

    /// Refuses a schedule that leaves the allowed temperatures.
    pub(crate) fn check_temperature(temperature: &Schedule) -> Result<(), Error> {
        temperature.check(
            "the temperature",
            Self::COLDEST,
            Self::HOTTEST,
            "in 1e-6..=1e6",
        )
    }

    fn restore(self) -> Result<Self, Error> {
        Self::check_temperature(&self.temperature)?;
        Ok(self)
    }
}

validated!(Boltzmann);

impl<V: Value> Policy<V> for Boltzmann {
    fn choose(&mut self, table: &QTable<V>, state: State, rng: &mut dyn Rng) -> Action {
        let temperature = self.temperature();
        self.choices = self.choices.saturating_add(1);
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

    fn probabilities(&self, table: &QTable<V>, state: State, probabilities: &mut [f64]) -> bool {
        let sum = boltzmann_weights(table, state, self.temperature(), probabilities);
        for p in probabilities {
            *p /= sum;
        }
        true
    }
}

/// Writes `exp((Q - max Q) / T)` for each action (0 below `exp(-700)`), 0 for forbidden ones, and
/// returns the sum.
fn boltzmann_weights<V: Value>(
    table: &QTable<V>,
    state: State,
    temperature: f64,
    weights: &mut [f64],
) -> f64 {
    let highest = table.max(state).to_f64();
    for (weight, value) in weights.iter_mut().zip(table.row(state)) {
        let exponent = (value.to_f64() - highest) / temperature;
        // Below this an ordinary number cannot hold it; not a branch, but a choice of two values.
        *weight = if exponent < -700.0 {
            0.0
        } else {
            exp_within(exponent)
        };
    }
    if let Some(mask) = table.mask() {
        for (weight, &allowed) in weights.iter_mut().zip(mask.row(state)) {
            if !allowed {
                *weight = 0.0;
            }
        }
    }
    weights.iter().sum()
}
