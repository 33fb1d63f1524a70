//! States of a behaviour: bins of each input, of which one may be the goal.

use qtable::{Error, Intervals, Product, State};
use serde::{Deserialize, Serialize};

/// The bins of each input of a behaviour. Their product is the set of states, in which the last
/// input varies fastest.
///
/// A bin includes its lower end and excludes its upper one; a *goal bin* includes both.
///
/// ```
/// use grasp_agent::StateSpace;
/// use grasp_agent::qtable::{Intervals, State};
///
/// fn main() -> Result<(), grasp_agent::qtable::Error> {
///     let x = Intervals::new(&[99.0, 108.0])?;
///     let r = Intervals::new(&[32.0])?;
///     let space = StateSpace::new(vec![(x, Some(1)), (r, None)])?;
///     assert_eq!(space.states(), 6);
///     // 108 is the goal's upper end, 32 the lower end of the upper bin.
///     assert_eq!(space.state([108.0, 32.0])?, State(3));
///     Ok(())
/// }
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Stored", into = "Stored")]
pub struct StateSpace {
    bins: Product,
    goals: Vec<Option<usize>>,
}

/// A state space in a file.
#[derive(Serialize, Deserialize)]
struct Stored {
    quantities: Vec<StoredBins>,
}

#[derive(Serialize, Deserialize)]
struct StoredBins {
    edges: Vec<f64>,
    goal: Option<usize>,
}

impl StateSpace {
    /// Creates a state space from the bins of each input, and its goal bin if it has one.
    ///
    /// # Errors
    /// A goal bin out of range, or more states than can be counted.
    pub fn new(inputs: Vec<(Intervals, Option<usize>)>) -> Result<Self, Error> {
        let (bins, goals): (Vec<_>, Vec<_>) = inputs.into_iter().unzip();
        for (bins, goal) in bins.iter().zip(&goals) {
            let count = bins.bins();
            if let Some(index) = goal.filter(|goal| *goal >= count) {
                let what = "goal bin";
                return Err(Error::OutOfRange { what, index, count });
            }
        }
        let bins = Product::new(bins)?;
        Ok(Self { bins, goals })
    }

    /// Returns the bins and the goal bin of each input.
    pub(crate) fn inputs(&self) -> impl ExactSizeIterator<Item = (&Intervals, Option<usize>)> {
        let bins = self.bins.quantities().iter();
        bins.zip(self.goals.iter().copied())
    }

    /// Returns the number of states.
    pub fn states(&self) -> usize {
        self.bins.states()
    }

    /// Returns the state of one value for each input.
    ///
    /// # Errors
    /// A wrong number of values, or NaN among them.
    pub fn state(
        &self,
        values: impl IntoIterator<Item = f64, IntoIter: ExactSizeIterator>,
    ) -> Result<State, Error> {
        let (values, needed) = (values.into_iter(), self.goals.len());
        let found = values.len();
        if found != needed {
            let what = "the list of inputs";
            return Err(Error::WrongLength {
                what,
                needed,
                found,
            });
        }
        let mut state = 0;
        for (place, (value, (bins, goal))) in values.zip(self.inputs()).enumerate() {
            let bin = bins.index(value).map_err(|_| Error::NotANumber(place))?;
            let is_on_upper_end = |goal: &usize| bin == goal + 1 && bins.edges()[*goal] >= value;
            state = state * bins.bins() + goal.filter(is_on_upper_end).unwrap_or(bin);
        }
        Ok(State(state))
    }
}

impl TryFrom<Stored> for StateSpace {
    type Error = Error;

    fn try_from(stored: Stored) -> Result<Self, Error> {
        let inputs = stored.quantities.into_iter();
        let inputs = inputs.map(|bins| Ok((Intervals::new(&bins.edges)?, bins.goal)));
        Self::new(inputs.collect::<Result<_, _>>()?)
    }
}

impl From<StateSpace> for Stored {
    fn from(space: StateSpace) -> Self {
        let quantities = space.inputs().map(|(bins, goal)| StoredBins {
            edges: bins.edges().to_vec(),
            goal,
        });
        Self {
            quantities: quantities.collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::behaviour::spec::BehaviourSpec;

    /// The layout of `policy.json`, which other programs read.
    #[test]
    fn a_file_tells_the_edges_and_the_goal_of_each_input() {
        let space = BehaviourSpec::approaching().space;
        let file = serde_json::to_value(&space).unwrap();
        let wanted = serde_json::json!({ "quantities": [
            { "edges": [43.0, 74.0, 82.0, 98.0], "goal": 2 },
            { "edges": [15.0, 27.0, 32.0, 34.0, 50.0], "goal": 3 },
            { "edges": [6.0, 27.0], "goal": null },
        ] });
        assert_eq!(file, wanted);
        assert_eq!(serde_json::from_value::<StateSpace>(file).unwrap(), space);
        for (pointer, value, text) in [
            ("/quantities/0/goal", 5.into(), "goal bin 5 is outside 0..5"),
            ("/quantities/0/edges/1", 43.into(), "not above 43"),
        ] {
            let mut damaged = wanted.clone();
            *damaged.pointer_mut(pointer).unwrap() = value;
            let refused = serde_json::from_value::<StateSpace>(damaged).unwrap_err();
            assert!(refused.to_string().contains(text), "{refused}");
        }
    }

    #[test]
    fn only_goal_bins_include_their_upper_end() {
        let bins = Intervals::new(&[1.0, 2.0, 3.0]).unwrap();
        let space = StateSpace::new(vec![(bins, Some(1))]).unwrap();
        for (value, bin) in [(1.0, 1), (2.0, 1), (2.0f64.next_up(), 2), (3.0, 3)] {
            assert_eq!(space.state([value]), Ok(State(bin)), "{value}");
        }
        assert_eq!(space.state([f64::NAN]), Err(Error::NotANumber(0)));
        assert!(space.state([]).is_err());
    }
}
