//! The trait of a policy, the greedy policy, and the rule for ties.

use rand::Rng;

use crate::step::{Action, State};
use crate::table::QTable;

/// A rule that chooses an action. It never chooses an action that the table's mask forbids.
///
/// A policy whose exploration changes with time counts its own choices, so that the same object
/// goes on where it stopped.
///
/// ```
/// use qtable::rand::{SeedableRng, rngs::Xoshiro256PlusPlus};
/// use qtable::{Action, Boltzmann, EpsilonGreedy, Greedy, Policy, QTable, Schedule, State, Ucb};
///
/// fn main() -> Result<(), qtable::Error> {
///     let mut table = QTable::new(1, 2)?;
///     table.set(State(0), Action(1), 1.0)?;
///     let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
///     let falling = Schedule::linear(1.0, 0.1, 10_000)?;
///     let policies: [(Box<dyn Policy>, f64); 4] = [
///         (Box::new(Greedy), 1.0),
///         (Box::new(EpsilonGreedy::new(falling)?), 0.5),
///         (Box::new(Boltzmann::new(Schedule::constant(0.5)?)?), 0.8808),
///         (Box::new(Ucb::new(2.0)?), 0.5),
///     ];
///     for (mut policy, wanted) in policies {
///         let mut p = [0.0; 2];
///         policy.probabilities(&table, State(0), &mut p);
///         assert!((p[1] - wanted).abs() < 1e-4);
///         policy.choose(&table, State(0), &mut rng);
///     }
///     Ok(())
/// }
/// ```
pub trait Policy {
    /// Chooses an action for a state of the table.
    fn choose(&mut self, table: &QTable, state: State, rng: &mut dyn Rng) -> Action;

    /// Writes the probability of every action in the next call of [`choose`](Policy::choose) into
    /// `probabilities`, one entry for each action, and returns `true`. Returns `false` if the
    /// policy does not tell them.
    fn probabilities(&self, table: &QTable, state: State, probabilities: &mut [f64]) -> bool {
        let _ = (table, state, probabilities);
        false
    }

    /// Notices that an episode begins, for schedules by episode.
    fn begin_episode(&mut self) {}
}

impl<P: Policy + ?Sized> Policy for Box<P> {
    fn choose(&mut self, table: &QTable, state: State, rng: &mut dyn Rng) -> Action {
        (**self).choose(table, state, rng)
    }

    fn probabilities(&self, table: &QTable, state: State, probabilities: &mut [f64]) -> bool {
        (**self).probabilities(table, state, probabilities)
    }

    fn begin_episode(&mut self) {
        (**self).begin_episode();
    }
}

/// The policy that always takes the best action; of several, the one with the lowest index.
/// ([`EpsilonGreedy`](crate::EpsilonGreedy) with ε = 0 and [`Ties::Random`] draws among them.)
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Greedy;

impl Policy for Greedy {
    fn choose(&mut self, table: &QTable, state: State, _rng: &mut dyn Rng) -> Action {
        table.best(state)
    }

    fn probabilities(&self, table: &QTable, state: State, probabilities: &mut [f64]) -> bool {
        probabilities.fill(0.0);
        probabilities[table.best(state).0] = 1.0;
        true
    }
}

/// The choice among equally good actions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Ties {
    /// Each with the same probability.
    #[default]
    Random,
    /// The action with the lowest index. A table of equal values then leads to one and the same
    /// action again and again: FrozenLake is not learned from a table of zeros at ε = 0.1.
    Lowest,
}
