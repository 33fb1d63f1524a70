//! How an action is chosen from a table.

use rand::{Rng, RngExt};
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::elementary::exp;
use crate::validated::validated;
use crate::{Action, Error, QTable, Schedule, State, Value};

/// A rule that chooses an action. Actions that the table's mask forbids are never chosen.
///
/// A policy whose exploration changes with time counts its own choices, so that the same object goes on where it
/// stopped.
pub trait Policy<V: Value = f64> {
    /// Chooses an action for a state of the table.
    fn choose(&mut self, table: &QTable<V>, state: State, rng: &mut dyn Rng) -> Action;

    /// Writes the probability of every action, as the next call of [`choose`](Policy::choose) would have it, into
    /// `probabilities` (one entry for each action) and returns `true`; returns `false` if the policy cannot say.
    fn probabilities(&self, table: &QTable<V>, state: State, probabilities: &mut [f64]) -> bool {
        let _ = (table, state, probabilities);
        false
    }
}

/// Always the best action; of equals the lowest index.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct Greedy;

impl<V: Value> Policy<V> for Greedy {
    fn choose(&mut self, table: &QTable<V>, state: State, _rng: &mut dyn Rng) -> Action {
        table.best(state)
    }

    fn probabilities(&self, table: &QTable<V>, state: State, probabilities: &mut [f64]) -> bool {
        probabilities.fill(0.0);
        probabilities[table.best(state).0] = 1.0;
        true
    }
}

/// A random offered action with probability ε, the best one otherwise (of equals the lowest index).
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize), serde(remote = "Self"))]
pub struct EpsilonGreedy {
    epsilon: Schedule,
    choices: u64,
}

impl EpsilonGreedy {
    /// With ε following a schedule over the choices made.
    ///
    /// # Errors
    /// [`Error::ScheduleRange`] if ε leaves `0..=1`.
    pub fn new(epsilon: Schedule) -> Result<Self, Error> {
        Self { epsilon, choices: 0 }.restore()
    }

    /// ε of the next choice.
    pub fn epsilon(&self) -> f64 {
        self.epsilon.at(self.choices)
    }

    fn restore(self) -> Result<Self, Error> {
        self.epsilon.check("epsilon", 0.0, 1.0, "in 0..=1")?;
        Ok(self)
    }
}

validated!(EpsilonGreedy);

impl<V: Value> Policy<V> for EpsilonGreedy {
    fn choose(&mut self, table: &QTable<V>, state: State, rng: &mut dyn Rng) -> Action {
        let epsilon = self.epsilon();
        self.choices += 1;
        if rng.random::<f64>() >= epsilon {
            return table.best(state);
        }
        if table.mask().is_none() {
            return Action(rng.random_range(0..table.actions()));
        }
        let offered = table.offered(state).count();
        table
            .offered(state)
            .nth(rng.random_range(0..offered))
            .unwrap_or_else(|| table.best(state))
    }

    fn probabilities(&self, table: &QTable<V>, state: State, probabilities: &mut [f64]) -> bool {
        let epsilon = self.epsilon();
        probabilities.fill(0.0);
        let share = epsilon / table.offered(state).count() as f64;
        for action in table.offered(state) {
            probabilities[action.0] = share;
        }
        probabilities[table.best(state).0] += 1.0 - epsilon;
        true
    }
}

/// The Boltzmann distribution over the action values (the paper's Eq. 4):
/// `p(a | s) = exp(Q(s,a)/T) / sum over b of exp(Q(s,b)/T)`.
///
/// The row's maximum is subtracted first, so that nothing overflows for any finite values and any temperature:
/// the best action has weight 1 and the sum is never 0.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize), serde(remote = "Self"))]
pub struct Boltzmann {
    temperature: Schedule,
    choices: u64,
    #[cfg_attr(feature = "serde", serde(skip))]
    weights: Vec<f64>,
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
            weights: Vec::new(),
        }
        .restore()
    }

    /// The temperature of the next choice.
    pub fn temperature(&self) -> f64 {
        self.temperature.at(self.choices)
    }

    fn restore(self) -> Result<Self, Error> {
        self.temperature
            .check("the temperature", Self::COLDEST, Self::HOTTEST, "in 1e-6..=1e6")?;
        Ok(self)
    }
}

validated!(Boltzmann);

impl<V: Value> Policy<V> for Boltzmann {
    fn choose(&mut self, table: &QTable<V>, state: State, rng: &mut dyn Rng) -> Action {
        let temperature = self.temperature();
        self.choices += 1;
        self.weights.resize(table.actions(), 0.0);
        let sum = boltzmann_weights(table, state, temperature, &mut self.weights);
        let mut rest = rng.random::<f64>() * sum;
        for (action, &weight) in self.weights.iter().enumerate() {
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

/// Writes `exp((Q - max Q) / T)` for each action, 0 for forbidden ones, and returns the sum.
fn boltzmann_weights<V: Value>(
    table: &QTable<V>,
    state: State,
    temperature: f64,
    weights: &mut [f64],
) -> f64 {
    let highest = table.max(state).to_f64();
    for (weight, value) in weights.iter_mut().zip(table.row(state)) {
        *weight = exp((value.to_f64() - highest) / temperature);
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
