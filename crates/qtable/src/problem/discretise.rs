//! States from measured quantities: intervals of one quantity, and products of intervals.

use crate::error::{Error, check_ascending, check_index, check_length, check_setting};
use crate::step::State;
use crate::validated::validated;

validated! {
    /// A division of the real line into `edges + 1` bins.
    ///
    /// The outer bins are unbounded, so every number has a bin, also the infinite ones; NaN has
    /// none. A bin is closed below and open above: a value on an edge belongs to the bin above it.
    ///
    /// ```
    /// use qtable::Intervals;
    ///
    /// fn main() -> Result<(), qtable::Error> {
    ///     let x = Intervals::new(&[50.0, 82.0, 99.0, 108.0, 125.0])?;
    ///     assert_eq!(x.index(98.9)?, 2);
    ///     assert_eq!(x.index(99.0)?, 3);
    ///     assert_eq!(x.index(108.0)?, 4);
    ///     assert_eq!(x.index(125.0)?, 5);
    ///     assert_eq!(x.index(f64::NEG_INFINITY)?, 0);
    ///     Ok(())
    /// }
    /// ```
    #[derive(Clone, Debug, PartialEq)]
    pub struct Intervals {
        edges: Vec<f64>,
    }
}

impl Intervals {
    /// Creates intervals from strictly increasing, finite edges. No edge at all gives a single bin.
    ///
    /// # Errors
    /// An edge that is not finite or not above the one before.
    pub fn new(edges: &[f64]) -> Result<Self, Error> {
        Self {
            edges: edges.to_vec(),
        }
        .restore()
    }

    /// Returns the bin of a value.
    ///
    /// # Errors
    /// [`Error::NotANumber`] for NaN.
    pub fn index(&self, value: f64) -> Result<usize, Error> {
        if value.is_nan() {
            return Err(Error::NotANumber(0));
        }
        Ok(self.edges.partition_point(|&edge| edge <= value))
    }

    /// Returns the number of bins, at least 1.
    pub fn bins(&self) -> usize {
        self.edges.len() + 1
    }

    /// Returns the edges, ascending.
    pub fn edges(&self) -> &[f64] {
        &self.edges
    }

    /// Returns the lower and upper end of a bin, infinite for the outer ones, or `None` if there is
    /// no such bin.
    pub fn bounds(&self, bin: usize) -> Option<(f64, f64)> {
        let below = match bin {
            0 => f64::NEG_INFINITY,
            _ => *self.edges.get(bin - 1)?,
        };
        Some((below, self.edges.get(bin).copied().unwrap_or(f64::INFINITY)))
    }

    fn restore(self) -> Result<Self, Error> {
        for &edge in &self.edges {
            check_setting("an edge", edge, edge.is_finite(), "finite")?;
        }
        check_ascending("edge", self.edges.iter().copied())?;
        Ok(self)
    }
}

validated! {
    /// Several quantities, each divided by its own [`Intervals`], as one state index: a mixed-radix
    /// number in which the last quantity varies fastest.
    ///
    /// ```
    /// use qtable::{Intervals, Product, State};
    ///
    /// fn main() -> Result<(), qtable::Error> {
    ///     let height = Intervals::new(&[50.0, 74.0, 82.0, 108.0])?;
    ///     let radius = Intervals::new(&[14.0, 22.0, 32.0, 34.0, 47.0])?;
    ///     let angle = Intervals::new(&[5.0, 20.0])?;
    ///     let states = Product::new(vec![height, radius, angle])?;
    ///     assert_eq!(states.states(), 90);
    ///     assert_eq!(states.index(&[78.0, 33.0, 10.0])?, State((2 * 6 + 3) * 3 + 1));
    ///     assert_eq!(states.bins(State(46)), [2, 3, 1]);
    ///     Ok(())
    /// }
    /// ```
    #[derive(Clone, Debug, PartialEq)]
    pub struct Product {
        quantities: Vec<Intervals>,
        #[cfg_attr(feature = "serde", serde(skip))]
        states: usize,
    }
}

impl Product {
    /// Creates a product from the intervals of each quantity, slowest first. No quantity at all
    /// gives a single state.
    ///
    /// # Errors
    /// [`Error::Shape`] if the number of states does not fit into a `usize`.
    pub fn new(quantities: Vec<Intervals>) -> Result<Self, Error> {
        let states = 0;
        Self { quantities, states }.restore()
    }

    /// Returns the state of one value for each quantity.
    ///
    /// # Errors
    /// A wrong number of values, or NaN among them.
    pub fn index(&self, values: &[f64]) -> Result<State, Error> {
        check_length(QUANTITIES, self.quantities.len(), values.len())?;
        let mut state = 0;
        for (quantity, (intervals, &value)) in self.quantities.iter().zip(values).enumerate() {
            let bin = intervals
                .index(value)
                .map_err(|_| Error::NotANumber(quantity))?;
            state = state * intervals.bins() + bin;
        }
        Ok(State(state))
    }

    /// Returns the state of one bin for each quantity, the inverse of [`bins`](Product::bins).
    ///
    /// # Errors
    /// A wrong number of bins, or one out of range.
    pub fn state(&self, bins: &[usize]) -> Result<State, Error> {
        check_length(QUANTITIES, self.quantities.len(), bins.len())?;
        let mut state = 0;
        for (intervals, &bin) in self.quantities.iter().zip(bins) {
            check_index("bin", bin, intervals.bins())?;
            state = state * intervals.bins() + bin;
        }
        Ok(State(state))
    }

    /// Returns the bin of each quantity in a state.
    ///
    /// # Panics
    /// If the state is not below [`states`](Product::states).
    pub fn bins(&self, state: State) -> Vec<usize> {
        let (index, states) = (state.0, self.states);
        assert!(index < states, "state {index} is outside 0..{states}");
        let mut rest = index;
        let mut bins = vec![0; self.quantities.len()];
        for (bin, intervals) in bins.iter_mut().zip(&self.quantities).rev() {
            *bin = rest % intervals.bins();
            rest /= intervals.bins();
        }
        bins
    }

    /// Returns the number of states, at least 1.
    pub fn states(&self) -> usize {
        self.states
    }

    /// Returns the intervals of each quantity.
    pub fn quantities(&self) -> &[Intervals] {
        &self.quantities
    }

    fn restore(mut self) -> Result<Self, Error> {
        let mut bins = self.quantities.iter().map(Intervals::bins);
        let states = bins.try_fold(1usize, usize::checked_mul);
        self.states = states.ok_or_else(|| Error::too_large(usize::MAX, 1))?;
        Ok(self)
    }
}

const QUANTITIES: &str = "the list of quantities";
