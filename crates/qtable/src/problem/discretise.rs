//! From measured quantities to a state index: intervals of one quantity, and products of intervals.

#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::index::State;
use crate::validated::validated;

/// A discretisation that cannot be, or a value that has no place in it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DiscretiseError {
    /// An edge that is NaN or infinite.
    #[error("edge {index} is {value}: edges must be finite")]
    EdgeNotFinite {
        /// Position among the edges.
        index: usize,
        /// The edge.
        value: f64,
    },
    /// An edge that is not above the one before it.
    #[error("edge {index} is {value}, not above {before} before it")]
    EdgesNotIncreasing {
        /// Position among the edges.
        index: usize,
        /// The edge.
        value: f64,
        /// The edge before it.
        before: f64,
    },
    /// A bin outside the intervals.
    #[error("bin {bin} is outside 0..{bins}")]
    BinOutOfRange {
        /// The bin.
        bin: usize,
        /// Number of bins.
        bins: usize,
    },
    /// NaN lies in no bin.
    #[error("quantity {quantity} is NaN, which lies in no interval")]
    NotANumber {
        /// Position among the quantities of a product, 0 for plain intervals.
        quantity: usize,
    },
    /// A wrong number of quantities.
    #[error("{found} quantities given where the product has {needed}")]
    WrongCount {
        /// Quantities needed.
        needed: usize,
        /// Quantities given.
        found: usize,
    },
    /// More states than an index can count.
    #[error("the product has more states than can be counted")]
    TooManyStates,
}

/// A division of the real line into `edges + 1` bins. The outer bins are unbounded, so every number
/// has a bin, the infinite ones too; NaN has none.
///
/// A bin is closed below and open above: a value on an edge belongs to the bin above it. One bin
/// can be named the *goal*; it is closed at both ends, as the paper's goal intervals `[99:108]`
/// are.
///
/// ```
/// use qtable::Intervals;
///
/// let x = Intervals::new(&[50.0, 82.0, 99.0, 108.0, 125.0, 157.0])?.with_goal(3)?;
/// assert_eq!(x.index(98.9)?, 2);
/// assert_eq!(x.index(99.0)?, 3);
/// assert_eq!(x.index(108.0)?, 3);
/// assert_eq!(x.index(125.0)?, 5);
/// assert_eq!(x.index(f64::NEG_INFINITY)?, 0);
/// # Ok::<(), qtable::DiscretiseError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(Serialize, Deserialize),
    serde(remote = "Self")
)]
pub struct Intervals {
    edges: Vec<f64>,
    goal: Option<usize>,
}

impl Intervals {
    /// From strictly increasing, finite edges. No edge at all gives a single bin.
    ///
    /// # Errors
    /// An edge that is not finite or not above the one before.
    pub fn new(edges: &[f64]) -> Result<Self, DiscretiseError> {
        Self {
            edges: edges.to_vec(),
            goal: None,
        }
        .restore()
    }

    /// Names a bin the goal and closes it at both ends.
    ///
    /// # Errors
    /// [`DiscretiseError::BinOutOfRange`].
    pub fn with_goal(self, bin: usize) -> Result<Self, DiscretiseError> {
        Self {
            goal: Some(bin),
            ..self
        }
        .restore()
    }

    /// The bin of a value.
    ///
    /// # Errors
    /// [`DiscretiseError::NotANumber`] for NaN.
    pub fn index(&self, value: f64) -> Result<usize, DiscretiseError> {
        if value.is_nan() {
            return Err(DiscretiseError::NotANumber { quantity: 0 });
        }
        let bin = self.edges.partition_point(|&edge| edge <= value);
        match self.goal {
            // On the goal's upper edge.
            Some(goal) if bin == goal + 1 && self.edges[goal] >= value => Ok(goal),
            _ => Ok(bin),
        }
    }

    /// Number of bins, at least 1.
    pub fn bins(&self) -> usize {
        self.edges.len() + 1
    }

    /// The goal bin, if one was named.
    pub fn goal(&self) -> Option<usize> {
        self.goal
    }

    /// The edges, ascending.
    pub fn edges(&self) -> &[f64] {
        &self.edges
    }

    /// Lower and upper end of a bin, infinite for the outer ones; `None` if there is no such bin.
    pub fn bounds(&self, bin: usize) -> Option<(f64, f64)> {
        let below = match bin {
            0 => f64::NEG_INFINITY,
            _ => *self.edges.get(bin - 1)?,
        };
        Some((below, self.edges.get(bin).copied().unwrap_or(f64::INFINITY)))
    }

    fn restore(self) -> Result<Self, DiscretiseError> {
        if let Some(index) = self.edges.iter().position(|edge| !edge.is_finite()) {
            return Err(DiscretiseError::EdgeNotFinite {
                index,
                value: self.edges[index],
            });
        }
        if let Some(before) = self.edges.windows(2).position(|pair| pair[0] >= pair[1]) {
            return Err(DiscretiseError::EdgesNotIncreasing {
                index: before + 1,
                value: self.edges[before + 1],
                before: self.edges[before],
            });
        }
        match self.goal {
            Some(bin) if bin >= self.bins() => Err(DiscretiseError::BinOutOfRange {
                bin,
                bins: self.bins(),
            }),
            _ => Ok(self),
        }
    }
}

validated!(Intervals);

/// Several quantities, each divided by its own [`Intervals`], as one state index: a mixed-radix
/// number in which the last quantity varies fastest.
///
/// ```
/// use qtable::{Intervals, Product, State};
///
/// let y = Intervals::new(&[50.0, 74.0, 82.0, 108.0])?.with_goal(2)?;
/// let r = Intervals::new(&[14.0, 22.0, 32.0, 34.0, 47.0])?.with_goal(3)?;
/// let theta3 = Intervals::new(&[5.0, 20.0])?;
/// let states = Product::new(vec![y, r, theta3])?;
/// assert_eq!(states.len(), 90);
/// assert_eq!(states.index(&[78.0, 33.0, 10.0])?, State((2 * 6 + 3) * 3 + 1));
/// assert_eq!(states.bins(State(46)), [2, 3, 1]);
/// assert!(states.is_goal(State(46)));
/// # Ok::<(), qtable::DiscretiseError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(Serialize, Deserialize),
    serde(remote = "Self")
)]
pub struct Product {
    quantities: Vec<Intervals>,
    #[cfg_attr(feature = "serde", serde(skip))]
    states: usize,
}

impl Product {
    /// From the intervals of each quantity, slowest first. No quantity at all gives a single state.
    ///
    /// # Errors
    /// [`DiscretiseError::TooManyStates`] if the number of states does not fit into a `usize`.
    pub fn new(quantities: Vec<Intervals>) -> Result<Self, DiscretiseError> {
        Self {
            quantities,
            states: 0,
        }
        .restore()
    }

    /// The state of one value for each quantity.
    ///
    /// # Errors
    /// A wrong number of values, or NaN among them.
    pub fn index(&self, values: &[f64]) -> Result<State, DiscretiseError> {
        self.check_count(values.len())?;
        let mut state = 0;
        for (quantity, (intervals, &value)) in self.quantities.iter().zip(values).enumerate() {
            let bin = intervals
                .index(value)
                .map_err(|_| DiscretiseError::NotANumber { quantity })?;
            state = state * intervals.bins() + bin;
        }
        Ok(State(state))
    }

    /// The state of one bin for each quantity: the inverse of [`bins`](Product::bins).
    ///
    /// # Errors
    /// A wrong number of bins, or one out of range.
    pub fn state(&self, bins: &[usize]) -> Result<State, DiscretiseError> {
        self.check_count(bins.len())?;
        let mut state = 0;
        for (intervals, &bin) in self.quantities.iter().zip(bins) {
            if bin >= intervals.bins() {
                return Err(DiscretiseError::BinOutOfRange {
                    bin,
                    bins: intervals.bins(),
                });
            }
            state = state * intervals.bins() + bin;
        }
        Ok(State(state))
    }

    /// The bin of each quantity in a state.
    ///
    /// # Panics
    /// If the state is not below [`len`](Product::len).
    pub fn bins(&self, state: State) -> Vec<usize> {
        assert!(
            state.0 < self.states,
            "state {} is outside 0..{}",
            state.0,
            self.states
        );
        let mut rest = state.0;
        let mut bins = vec![0; self.quantities.len()];
        for (bin, intervals) in bins.iter_mut().zip(&self.quantities).rev() {
            *bin = rest % intervals.bins();
            rest /= intervals.bins();
        }
        bins
    }

    /// Whether every quantity that has a goal bin is in it. `false` if none has one.
    ///
    /// # Panics
    /// As [`bins`](Product::bins).
    pub fn is_goal(&self, state: State) -> bool {
        let mut goals = self
            .bins(state)
            .into_iter()
            .zip(&self.quantities)
            .filter(|(_, of)| of.goal().is_some())
            .peekable();
        goals.peek().is_some() && goals.all(|(bin, of)| of.goal() == Some(bin))
    }

    /// Number of states, at least 1.
    #[expect(clippy::len_without_is_empty, reason = "a product is never empty")]
    pub fn len(&self) -> usize {
        self.states
    }

    /// The intervals of each quantity.
    pub fn quantities(&self) -> &[Intervals] {
        &self.quantities
    }

    fn check_count(&self, found: usize) -> Result<(), DiscretiseError> {
        let needed = self.quantities.len();
        if found == needed {
            Ok(())
        } else {
            Err(DiscretiseError::WrongCount { needed, found })
        }
    }

    fn restore(mut self) -> Result<Self, DiscretiseError> {
        self.states = self
            .quantities
            .iter()
            .try_fold(1usize, |states, intervals| {
                states.checked_mul(intervals.bins())
            })
            .ok_or(DiscretiseError::TooManyStates)?;
        Ok(self)
    }
}

validated!(Product);
