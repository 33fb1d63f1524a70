//! Quantities that change while a run goes on: the learning rate α, the exploration rate ε, the
//! temperature T.

#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::elementary::{exp, ln};
use crate::error::{Error, ScheduleError};
use crate::validated::validated;

/// The value of a quantity after a number of steps (actions taken, or visits of one state-action
/// pair).
///
/// Variants are made by the constructors, which check them; they can be matched on, not written
/// out.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(Serialize, Deserialize),
    serde(remote = "Self")
)]
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
    /// `start / (1 + visits / scale)`: by the visits of the state-action pair, not by the steps of
    /// the run.
    #[non_exhaustive]
    InverseVisits {
        /// Value at the first visit.
        start: f64,
        /// Visits after which half of `start` is left, positive.
        scale: f64,
    },
    /// Straight lines between points, constant before the first and after the last.
    #[non_exhaustive]
    Piecewise {
        /// Steps, strictly ascending, and the values there.
        points: Vec<(u64, f64)>,
    },
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

    /// `start / (1 + visits / scale)`, by the visits of each state-action pair. With both 1 it is
    /// `1/n` at the n-th visit, the sample average; a larger scale keeps learning longer, and both
    /// satisfy the conditions of Robbins and Monro under which Q-learning converges.
    ///
    /// A quantity that belongs to no pair, such as ε or T, has its steps in place of visits.
    ///
    /// # Errors
    /// A value that is not finite, or a scale that is not positive.
    pub fn inverse_visits(start: f64, scale: f64) -> Result<Self, ScheduleError> {
        Self::InverseVisits { start, scale }.restore()
    }

    /// Straight lines between `(step, value)` points; constant before the first and after the last.
    ///
    /// # Errors
    /// No point, steps that do not ascend, or a value that is not finite.
    pub fn piecewise(points: &[(u64, f64)]) -> Result<Self, ScheduleError> {
        Self::Piecewise {
            points: points.to_vec(),
        }
        .restore()
    }

    /// The paper's learning rate: exponential from 0.6 (section 4). The end, which the paper does
    /// not give, is 0.02 after `actions`, at least 1.
    pub fn paper_alpha(actions: u64) -> Self {
        Self::Exponential {
            start: 0.6,
            end: 0.02,
            steps: actions.max(1),
        }
    }

    /// The paper's temperature: from 1000 (section 4). Course and end, which the paper does not
    /// give, are exponential and 0.1 after `actions`, at least 1.
    pub fn paper_temperature(actions: u64) -> Self {
        Self::Exponential {
            start: 1000.0,
            end: 0.1,
            steps: actions.max(1),
        }
    }

    /// The value at a step, 0 being the first. [`Schedule::InverseVisits`] takes it as the number
    /// of visits.
    pub fn at(&self, step: u64) -> f64 {
        match self {
            Self::Constant { value } => *value,
            Self::Linear { start, end, steps } => between(*start, *end, step, *steps),
            Self::Exponential { start, end, steps } if step < *steps => {
                let value = start * exp((ln(*end) - ln(*start)) * (step as f64 / *steps as f64));
                held_between(*start, *end, value)
            }
            Self::Exponential { end, .. } => *end,
            Self::InverseVisits { start, scale } => start / (1.0 + step as f64 / scale),
            Self::Piecewise { points } => {
                let after = points.partition_point(|&(at, _)| at <= step);
                match (points[..after].last(), points.get(after)) {
                    (Some(&(from, start)), Some(&(to, end))) => {
                        between(start, end, step - from, to - from)
                    }
                    (Some(&(_, value)), None) | (None, Some(&(_, value))) => value,
                    (None, None) => f64::NAN,
                }
            }
        }
    }

    /// The value at a step for a pair with a number of visits before it: whichever of the two the
    /// schedule runs by.
    #[inline]
    pub fn at_visit(&self, step: u64, visits: u64) -> f64 {
        match self {
            Self::Constant { value } => *value,
            Self::InverseVisits { .. } => self.at(visits),
            _ => self.at(step),
        }
    }

    /// The smallest and the largest value it takes.
    pub fn range(&self) -> (f64, f64) {
        let within = |low: f64, value: f64, high: f64| (low.min(value), high.max(value));
        match self {
            Self::Constant { value } => (*value, *value),
            Self::Linear { start, end, .. } | Self::Exponential { start, end, .. } => {
                within(*start, *end, *start)
            }
            Self::InverseVisits { start, .. } => within(0.0, *start, 0.0),
            Self::Piecewise { points } => points.iter().fold(
                (f64::INFINITY, f64::NEG_INFINITY),
                |(low, high), &(_, value)| within(low, value, high),
            ),
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
        let finite = |values: &[f64]| match values.iter().find(|value| !value.is_finite()) {
            Some(&value) => Err(ScheduleError::NotFinite { value }),
            None => Ok(()),
        };
        match &self {
            Self::Constant { value } => finite(&[*value])?,
            Self::Linear { start, end, steps } | Self::Exponential { start, end, steps } => {
                finite(&[*start, *end])?;
                if *steps == 0 {
                    return Err(ScheduleError::NoSteps);
                }
            }
            Self::InverseVisits { start, scale } => {
                finite(&[*start])?;
                if !scale.is_finite() || *scale <= 0.0 {
                    return Err(ScheduleError::Scale { scale: *scale });
                }
            }
            Self::Piecewise { points } => {
                if points.is_empty() {
                    return Err(ScheduleError::NoPoints);
                }
                for (_, value) in points {
                    finite(&[*value])?;
                }
                if let Some(before) = points.windows(2).position(|pair| pair[0].0 >= pair[1].0) {
                    let index = before + 1;
                    return Err(ScheduleError::PointsNotAscending {
                        index,
                        step: points[index].0,
                    });
                }
            }
        }
        match self {
            Self::Exponential { start, end, .. } if start.min(end) < f64::MIN_POSITIVE => {
                Err(ScheduleError::NotPositive { start, end })
            }
            valid => Ok(valid),
        }
    }
}

/// The value `step` of `steps` along a straight line, its end from there on.
fn between(start: f64, end: f64, step: u64, steps: u64) -> f64 {
    if step >= steps {
        return end;
    }
    let t = step as f64 / steps as f64;
    held_between(start, end, start * (1.0 - t) + end * t)
}

/// A value between two others, where rounding may have led out of their range.
fn held_between(start: f64, end: f64, value: f64) -> f64 {
    value.max(start.min(end)).min(start.max(end))
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
        for (step, wanted) in [
            (0, 1000.0),
            (1, 100.0),
            (2, 10.0),
            (3, 1.0),
            (4, 0.1),
            (5, 0.1),
        ] {
            assert!((exponential.at(step) / wanted - 1.0).abs() < 1e-14);
        }
        assert!((Schedule::paper_alpha(100).at(0) - 0.6).abs() < 1e-15);
        assert!((Schedule::paper_temperature(0).at(0) - 1000.0).abs() < 1e-12);
    }

    #[test]
    fn inverse_visits_run_by_visits_and_piecewise_through_its_points() {
        let mean = Schedule::inverse_visits(1.0, 1.0).unwrap();
        assert!((mean.at_visit(1_000, 3) - 0.25).abs() < 1e-15);
        assert_eq!(mean.range(), (0.0, 1.0));
        let piecewise = Schedule::piecewise(&[(10, 1.0), (20, 3.0), (21, -1.0)]).unwrap();
        for (step, wanted) in [
            (0, 1.0),
            (10, 1.0),
            (15, 2.0),
            (20, 3.0),
            (21, -1.0),
            (99, -1.0),
        ] {
            assert!(
                (piecewise.at_visit(step, 7) - wanted).abs() < 1e-15,
                "{step}"
            );
        }
        assert_eq!(piecewise.range(), (-1.0, 3.0));
        assert_eq!(Schedule::piecewise(&[]), Err(ScheduleError::NoPoints));
        let twice = Schedule::piecewise(&[(3, 0.0), (3, 1.0)]);
        assert_eq!(
            twice,
            Err(ScheduleError::PointsNotAscending { index: 1, step: 3 })
        );
        assert!(matches!(
            Schedule::inverse_visits(1.0, 0.0),
            Err(ScheduleError::Scale { .. })
        ));
    }

    #[test]
    fn rounding_never_leads_out_of_the_range() {
        for level in [1e-6, 0.1, 0.6, 1.0 / 3.0, 1.0, 1e6] {
            for steps in [3, 10, 49, 1_000] {
                let near = level * (1.0 + f64::EPSILON);
                for (start, end) in [(level, level), (level, near), (near, level)] {
                    for schedule in [
                        Schedule::linear(start, end, steps),
                        Schedule::exponential(start, end, steps),
                        Schedule::piecewise(&[(0, start), (steps, end)]),
                    ] {
                        let schedule = schedule.unwrap();
                        let (low, high) = schedule.range();
                        for step in 0..=steps {
                            let value = schedule.at(step);
                            assert!(
                                (low..=high).contains(&value),
                                "{schedule:?} at {step}: {value:e}"
                            );
                        }
                    }
                }
            }
        }
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
