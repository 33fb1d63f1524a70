//! Quantities that change while a run goes on: the learning rate α, the exploration rate ε, the temperature T.

#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::elementary::{exp, ln};
use crate::validated::validated;

/// The value of a quantity after a number of steps (actions taken, or visits of one state-action pair).
///
/// Variants are made by the constructors, which check them; they can be matched on, not written out.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize), serde(remote = "Self"))]
#[non_exhaustive]
pub enum Schedule {
    /// Always `value`.
    #[non_exhaustive]
    Constant {
        /// The value.
        value: f64,
    },
    /// From `start` to `end` by equal differences within `steps`, then `end`.
    #[non_exhaustive]
    Linear {
        /// Value at step 0.
        start: f64,
        /// Value from step `steps` on.
        end: f64,
        /// Steps from `start` to `end`.
        steps: u64,
    },
    /// From `start` to `end` by equal ratios within `steps`, then `end`.
    #[non_exhaustive]
    Exponential {
        /// Value at step 0, positive.
        start: f64,
        /// Value from step `steps` on, positive.
        end: f64,
        /// Steps from `start` to `end`.
        steps: u64,
    },
}

/// A schedule that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ScheduleError {
    /// A value that is NaN or infinite.
    #[error("a schedule value is {value}: it must be finite")]
    NotFinite {
        /// The value.
        value: f64,
    },
    /// An exponential schedule through zero or a negative value.
    #[error("an exponential schedule goes from {start} to {end}: both must be positive")]
    NotPositive {
        /// Value at step 0.
        start: f64,
        /// Last value.
        end: f64,
    },
    /// A change within no steps.
    #[error("a schedule that changes needs at least one step to do so")]
    NoSteps,
}

impl Schedule {
    /// Always `value`.
    ///
    /// # Errors
    /// [`ScheduleError::NotFinite`].
    pub fn constant(value: f64) -> Result<Self, ScheduleError> {
        Self::Constant { value }.restore()
    }

    /// From `start` at step 0 to `end` at `steps` by equal differences; `end` from there on.
    ///
    /// # Errors
    /// A value that is not finite, or `steps` of 0.
    pub fn linear(start: f64, end: f64, steps: u64) -> Result<Self, ScheduleError> {
        Self::Linear { start, end, steps }.restore()
    }

    /// From `start` at step 0 to `end` at `steps` by equal ratios; `end` from there on.
    ///
    /// # Errors
    /// A value that is not finite or not positive, or `steps` of 0.
    pub fn exponential(start: f64, end: f64, steps: u64) -> Result<Self, ScheduleError> {
        Self::Exponential { start, end, steps }.restore()
    }

    /// The paper's learning rate: exponential from 0.6 (section 4). The end, which the paper does not give, is
    /// 0.02 after `actions`, at least 1.
    pub fn paper_alpha(actions: u64) -> Self {
        Self::Exponential {
            start: 0.6,
            end: 0.02,
            steps: actions.max(1),
        }
    }

    /// The paper's temperature: from 1000 (section 4). Course and end, which the paper does not give, are
    /// exponential and 0.1 after `actions`, at least 1.
    pub fn paper_temperature(actions: u64) -> Self {
        Self::Exponential {
            start: 1000.0,
            end: 0.1,
            steps: actions.max(1),
        }
    }

    /// The value at a step, 0 being the first.
    pub fn at(&self, step: u64) -> f64 {
        match *self {
            Self::Constant { value } => value,
            Self::Linear { start, end, steps } => {
                if step >= steps {
                    end
                } else {
                    let t = step as f64 / steps as f64;
                    start * (1.0 - t) + end * t
                }
            }
            Self::Exponential { start, end, steps } => {
                if step >= steps {
                    end
                } else {
                    start * exp((ln(end) - ln(start)) * (step as f64 / steps as f64))
                }
            }
        }
    }

    /// The smallest and the largest value it takes.
    pub fn range(&self) -> (f64, f64) {
        match *self {
            Self::Constant { value } => (value, value),
            Self::Linear { start, end, .. } | Self::Exponential { start, end, .. } => {
                (start.min(end), start.max(end))
            }
        }
    }

    /// Refuses a schedule that leaves `low..=high`.
    pub(crate) fn check(
        &self,
        name: &'static str,
        low: f64,
        high: f64,
        expected: &'static str,
    ) -> Result<(), Error> {
        let (least, most) = self.range();
        if least >= low && most <= high {
            Ok(())
        } else {
            Err(Error::ScheduleRange {
                name,
                low: least,
                high: most,
                expected,
            })
        }
    }

    fn restore(self) -> Result<Self, ScheduleError> {
        let (first, last) = match self {
            Self::Constant { value } => (value, value),
            Self::Linear { start, end, .. } | Self::Exponential { start, end, .. } => (start, end),
        };
        if let Some(value) = [first, last].into_iter().find(|value| !value.is_finite()) {
            return Err(ScheduleError::NotFinite { value });
        }
        match self {
            Self::Linear { steps: 0, .. } | Self::Exponential { steps: 0, .. } => Err(ScheduleError::NoSteps),
            Self::Exponential { start, end, .. } if first.min(last) < f64::MIN_POSITIVE => {
                Err(ScheduleError::NotPositive { start, end })
            }
            valid => Ok(valid),
        }
    }
}

validated!(Schedule);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn schedules_pass_through_their_ends() {
        let linear = Schedule::linear(1.0, 0.0, 4).unwrap();
        for (step, wanted) in [(0, 1.0), (1, 0.75), (2, 0.5), (4, 0.0), (9, 0.0)] {
            assert_eq!(linear.at(step).to_bits(), f64::to_bits(wanted));
        }
        let exponential = Schedule::exponential(1000.0, 0.1, 4).unwrap();
        for (step, wanted) in [(0, 1000.0), (1, 100.0), (2, 10.0), (3, 1.0), (4, 0.1), (5, 0.1)] {
            assert!((exponential.at(step) / wanted - 1.0).abs() < 1e-14);
        }
        assert!((Schedule::paper_alpha(100).at(0) - 0.6).abs() < 1e-15);
        assert!((Schedule::paper_temperature(0).at(0) - 1000.0).abs() < 1e-12);
    }

    #[test]
    fn impossible_schedules_are_refused() {
        assert_eq!(Schedule::linear(1.0, 0.0, 0), Err(ScheduleError::NoSteps));
        assert!(matches!(
            Schedule::constant(f64::NAN),
            Err(ScheduleError::NotFinite { .. })
        ));
        assert!(matches!(
            Schedule::linear(f64::INFINITY, 0.0, 3),
            Err(ScheduleError::NotFinite { .. })
        ));
        assert!(matches!(
            Schedule::linear(0.0, f64::NAN, 3),
            Err(ScheduleError::NotFinite { .. })
        ));
        assert!(matches!(
            Schedule::exponential(1.0, 0.0, 3),
            Err(ScheduleError::NotPositive { .. })
        ));
    }
}
