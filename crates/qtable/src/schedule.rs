//! Quantities that change during a run: the learning rate α, the exploration rate ε, the
//! temperature T.

use std::sync::Arc;

use crate::clock::{BLOCK, Block, Clock};
use crate::elementary::{exp, ln};
use crate::error::{Error, check_ascending, check_setting};
use crate::validated::validated;

validated! {
    /// The value of a quantity as a run goes on.
    ///
    /// A schedule counts the actions of the run, or its episodes ([`by_episode`]), or the visits of
    /// the state-action pair ([`inverse_visits`]).
    ///
    /// ```
    /// use qtable::Schedule;
    ///
    /// fn main() -> Result<(), qtable::Error> {
    ///     let epsilon = Schedule::linear(1.0, 0.1, 100)?;
    ///     assert_eq!((epsilon.at(0), epsilon.at(50), epsilon.at(999)), (1.0, 0.55, 0.1));
    ///     let cooling = Schedule::exponential(1000.0, 10.0, 100)?;
    ///     assert!((cooling.at(50) - 100.0).abs() < 1e-9);
    ///     let steps = Schedule::piecewise(&[(0, 1.0), (10, 0.2), (100, 0.0)])?;
    ///     assert_eq!((steps.at(5), steps.at(55)), (0.6, 0.1));
    ///     // By the visits of the pair: 1/n, and n^-0.7.
    ///     assert_eq!(Schedule::inverse_visits(1.0, 1.0)?.at(9), 0.1);
    ///     assert!(Schedule::visits_power(1.0, 0.7)?.at(9) > 0.19);
    ///     let by_hand = Schedule::custom((0.0, 1.0), |step| 1.0 / (1.0 + step as f64));
    ///     assert_eq!(by_hand?.by_episode().at(3), 0.25);
    ///     Ok(())
    /// }
    /// ```
    ///
    /// [`by_episode`]: Schedule::by_episode
    /// [`inverse_visits`]: Schedule::inverse_visits
    #[derive(Clone, Debug, PartialEq)]
    pub struct Schedule {
        shape: Shape,
        by_episode: bool,
        /// The value of a constant schedule, so that it is found at once.
        #[cfg_attr(feature = "serde", serde(skip))]
        constant: Option<f64>,
        /// The logarithm of the ratio of an exponential schedule's ends.
        #[cfg_attr(feature = "serde", serde(skip))]
        log_ratio: f64,
        /// The factors by which an exponential schedule falls over 0, 1, ... steps.
        #[cfg_attr(feature = "serde", serde(skip))]
        factors: Vec<f64>,
    }
}

/// The course of a schedule. Numbers are start, end and steps, or start and scale or exponent.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
enum Shape {
    Constant(f64),
    Linear(f64, f64, u64),
    Exponential(f64, f64, u64),
    InverseVisits(f64, f64),
    VisitsPower(f64, f64),
    Piecewise(Vec<(u64, f64)>),
    #[cfg_attr(
        feature = "serde",
        serde(skip_deserializing, serialize_with = "refuse")
    )]
    Custom(Custom),
}

/// Refuses to serialize a function.
#[cfg(feature = "serde")]
fn refuse<S: serde::Serializer>(_: &Custom, _: S) -> Result<S::Ok, S::Error> {
    let problem = "a schedule by a function of yours cannot be saved: use another one, or save \
                   table and learner without it";
    Err(serde::ser::Error::custom(problem))
}

/// A function of the caller and its range.
#[derive(Clone)]
struct Custom {
    range: (f64, f64),
    value: Arc<dyn Fn(u64) -> f64 + Send + Sync>,
}

impl std::fmt::Debug for Custom {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Custom").field(&self.range).finish()
    }
}

impl PartialEq for Custom {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.value, &other.value)
    }
}

impl Schedule {
    /// Creates a schedule that is always `value`.
    ///
    /// # Errors
    /// A value that is not finite.
    pub fn constant(value: f64) -> Result<Self, Error> {
        Self::of(Shape::Constant(value))
    }

    /// Creates a schedule from `start` at step 0 to `end` at `steps` by equal differences; it stays
    /// at `end` from there on.
    ///
    /// # Errors
    /// A value that is not finite, or `steps` of 0.
    pub fn linear(start: f64, end: f64, steps: u64) -> Result<Self, Error> {
        Self::of(Shape::Linear(start, end, steps))
    }

    /// Creates a schedule from `start` at step 0 to `end` at `steps` by equal ratios; it stays at
    /// `end` from there on.
    ///
    /// # Errors
    /// A value that is not finite or not positive, or `steps` of 0.
    pub fn exponential(start: f64, end: f64, steps: u64) -> Result<Self, Error> {
        Self::of(Shape::Exponential(start, end, steps))
    }

    /// Creates the schedule `start / (1 + visits / scale)` of the visits of each state-action pair.
    ///
    /// With both 1 it is `1/n` at the n-th visit, the sample average; a larger scale keeps learning
    /// longer. Both satisfy the conditions of Robbins and Monro under which Q-learning converges. A
    /// quantity that belongs to no pair, such as ε or T, counts its steps instead.
    ///
    /// # Errors
    /// A value that is not finite, or a scale that is not positive.
    pub fn inverse_visits(start: f64, scale: f64) -> Result<Self, Error> {
        Self::of(Shape::InverseVisits(start, scale))
    }

    /// Creates the schedule `start / n^exponent` at the n-th visit of each state-action pair, with
    /// an exponent in `0.5..=1` (above 0.5 the conditions of Robbins and Monro hold).
    ///
    /// An exponent of 0.6 to 0.8 learns faster than `1/n`, which weighs the first, wrong targets
    /// like the last ones (Even-Dar and Mansour 2003).
    ///
    /// # Errors
    /// A start that is not finite, or an exponent outside `0.5..=1`.
    pub fn visits_power(start: f64, exponent: f64) -> Result<Self, Error> {
        Self::of(Shape::VisitsPower(start, exponent))
    }

    /// Creates straight lines between `(step, value)` points; the schedule is constant before the
    /// first and after the last.
    ///
    /// # Errors
    /// No point, steps that do not ascend, or a value that is not finite.
    pub fn piecewise(points: &[(u64, f64)]) -> Result<Self, Error> {
        Self::of(Shape::Piecewise(points.to_vec()))
    }

    /// Creates a schedule from a function of the step. The function must stay within `range`;
    /// values outside are moved to its nearer end. Such a schedule cannot be saved.
    ///
    /// # Errors
    /// A range that is not finite.
    pub fn custom(
        range: (f64, f64),
        value: impl Fn(u64) -> f64 + Send + Sync + 'static,
    ) -> Result<Self, Error> {
        let value = Arc::new(value);
        Self::of(Shape::Custom(Custom { range, value }))
    }

    /// Counts episodes instead of actions: step 0 is the first episode.
    #[must_use]
    pub fn by_episode(self) -> Self {
        let by_episode = true;
        Self { by_episode, ..self }
    }

    /// Returns the value at a step, 0 being the first. A schedule by visits takes it as the number
    /// of visits.
    #[inline]
    pub fn at(&self, step: u64) -> f64 {
        match &self.shape {
            Shape::Constant(value) => *value,
            Shape::Linear(start, end, steps) => between(*start, *end, step, *steps),
            Shape::Exponential(start, end, steps) if step < *steps => {
                let factor = self.factors[(step % BLOCK) as usize];
                held_between(*start, *end, self.head(step) * factor)
            }
            Shape::Exponential(_, end, _) => *end,
            Shape::InverseVisits(start, scale) => start / (1.0 + step as f64 / scale),
            Shape::VisitsPower(start, exponent) => {
                start * exp(-exponent * ln(step.saturating_add(1) as f64))
            }
            Shape::Piecewise(points) => along(points, step),
            Shape::Custom(Custom { range, value }) => match value(step) {
                value if value.is_nan() => range.0,
                value => held_between(range.0, range.1, value),
            },
        }
    }

    /// Returns the value of an exponential schedule at the first step of a block.
    fn head(&self, step: u64) -> f64 {
        match self.shape {
            Shape::Exponential(start, _, steps) => {
                let first = step - step % BLOCK;
                start * exp(self.log_ratio * (float(first) / float(steps)))
            }
            _ => f64::NAN,
        }
    }

    /// Computes the values of the block that a step belongs to. Returns that of the step.
    #[cold]
    #[inline(never)]
    fn begin_block(&self, step: u64, clock: &mut Clock) -> f64 {
        let Block { first, values } = &mut clock.block;
        *first = step - step % BLOCK;
        let first = *first;
        values.clear();
        match self.shape {
            Shape::Exponential(start, end, last) if first < last.saturating_sub(BLOCK) => {
                let (head, factors) = (self.head(first), self.factors.iter());
                values.extend(factors.map(|factor| held_between(start, end, head * factor)));
            }
            Shape::Linear(start, end, last) if first < last.saturating_sub(BLOCK).min(1 << 52) => {
                let steps = (0..BLOCK as u32).map(|step| float(first) + f64::from(step));
                values.extend(steps.map(|step| mixed(start, end, step / float(last))));
            }
            _ => values.extend((0..BLOCK).map(|step| self.at(first.saturating_add(step)))),
        }
        values[(step - first) as usize]
    }

    /// Returns values among which are the smallest and the largest.
    fn ends(&self) -> Vec<f64> {
        match &self.shape {
            Shape::Constant(value) => vec![*value],
            Shape::Linear(start, end, _) | Shape::Exponential(start, end, _) => vec![*start, *end],
            Shape::InverseVisits(start, _) | Shape::VisitsPower(start, _) => vec![0.0, *start],
            Shape::Piecewise(points) => points.iter().map(|&(_, value)| value).collect(),
            Shape::Custom(custom) => vec![custom.range.0, custom.range.1],
        }
    }

    /// Returns the smallest and the largest value.
    pub(crate) fn range(&self) -> (f64, f64) {
        let ends = self.ends().into_iter();
        ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), end| {
            (end.min(low), end.max(high))
        })
    }

    /// Returns `true` for a schedule that counts the visits of each pair.
    pub fn is_by_visits(&self) -> bool {
        matches!(
            self.shape,
            Shape::InverseVisits(..) | Shape::VisitsPower(..)
        )
    }

    /// Returns the value now for a pair with a number of visits before.
    #[inline(always)]
    pub(crate) fn now(&self, clock: &Clock, visits: u32) -> f64 {
        if self.is_by_visits() {
            self.at(u64::from(visits))
        } else {
            self.at_time(clock)
        }
    }

    /// Returns the value now, as [`now`](Schedule::now) does, at less cost: most steps take it from
    /// the block that the clock keeps.
    #[inline(always)]
    pub(crate) fn current(&self, clock: &mut Clock, visits: u32) -> f64 {
        if let Some(value) = self.constant {
            return value;
        }
        let time = clock.time(self.by_episode);
        let block = &clock.block;
        match block.values.get(time.wrapping_sub(block.first) as usize) {
            Some(value) => *value,
            // A schedule by visits never has a block.
            None if self.is_by_visits() => self.at(u64::from(visits)),
            None => self.begin_block(time, clock),
        }
    }

    /// Returns the value now of a quantity that belongs to no pair.
    #[inline]
    pub(crate) fn at_time(&self, clock: &Clock) -> f64 {
        self.at(clock.time(self.by_episode))
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
        let value = if most > high { most } else { least };
        check_setting(name, value, least >= low && most <= high, expected)
    }

    fn of(shape: Shape) -> Result<Self, Error> {
        Self {
            shape,
            by_episode: false,
            constant: None,
            log_ratio: 0.0,
            factors: Vec::new(),
        }
        .restore()
    }

    fn restore(mut self) -> Result<Self, Error> {
        for value in self.ends() {
            check_setting("a value of a schedule", value, value.is_finite(), "finite")?;
        }
        let enough = |what, any: bool| check_setting(what, 0.0, any, "at least 1");
        let steps_given = |steps: u64| enough("the number of steps of a schedule", steps > 0);
        match &self.shape {
            Shape::Linear(_, _, steps) => steps_given(*steps)?,
            Shape::Exponential(start, end, steps) => {
                steps_given(*steps)?;
                let (lower, what) = (start.min(*end), "the lower end of an exponential schedule");
                check_setting(what, lower, lower >= f64::MIN_POSITIVE, "positive")?;
                self.log_ratio = ln(*end) - ln(*start);
                let factor = |step: u64| exp(self.log_ratio * (float(step) / float(*steps)));
                self.factors = (0..BLOCK).map(factor).collect();
            }
            Shape::InverseVisits(_, scale) => {
                let valid = scale.is_finite() && *scale > 0.0;
                check_setting("the scale of a schedule", *scale, valid, "positive")?;
            }
            Shape::VisitsPower(_, exponent) => {
                let valid = (0.5..=1.0).contains(exponent);
                check_setting("the exponent of a schedule", *exponent, valid, "in 0.5..=1")?;
            }
            Shape::Piecewise(points) => {
                enough("the number of points", !points.is_empty())?;
                let steps = points.iter().map(|&(step, _)| step as f64);
                check_ascending("the step of point", steps)?;
            }
            Shape::Constant(value) => self.constant = Some(*value),
            Shape::Custom(_) => {}
        }
        Ok(self)
    }
}

/// Returns the value of a piecewise schedule.
fn along(points: &[(u64, f64)], step: u64) -> f64 {
    let after = points.partition_point(|&(at, _)| at <= step);
    match (points[..after].last(), points.get(after)) {
        (Some(&(from, start)), Some(&(to, end))) => between(start, end, step - from, to - from),
        (Some(&(_, value)), None) | (None, Some(&(_, value))) => value,
        (None, None) => f64::NAN,
    }
}

/// Returns the value `step` of `steps` along a straight line, its end from there on.
#[inline]
fn between(start: f64, end: f64, step: u64, steps: u64) -> f64 {
    if step >= steps {
        return end;
    }
    mixed(start, end, float(step) / float(steps))
}

/// Returns the value a fraction of the way along a straight line.
#[inline(always)]
fn mixed(start: f64, end: f64, t: f64) -> f64 {
    held_between(start, end, start * (1.0 - t) + end * t)
}

/// Returns a count as a number; as a signed one it is converted by one instruction.
#[inline(always)]
fn float(count: u64) -> f64 {
    i64::try_from(count).map_or(count as f64, |count| count as f64)
}

/// Returns a value moved between two others, where rounding may have led out of their range.
#[inline]
fn held_between(start: f64, end: f64, value: f64) -> f64 {
    let (low, high) = if start < end {
        (start, end)
    } else {
        (end, start)
    };
    // Two selections, which need no branch; NaN stays.
    let value = if value < low { low } else { value };
    if value > high { high } else { value }
}

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
        let wanted = [1000.0, 100.0, 10.0, 1.0, 0.1, 0.1];
        for (step, wanted) in (0..).zip(wanted) {
            assert!((exponential.at(step) / wanted - 1.0).abs() < 1e-14);
        }
        let piecewise = Schedule::piecewise(&[(10, 1.0), (20, 3.0), (21, -1.0)]).unwrap();
        let wanted = [
            (0, 1.0),
            (10, 1.0),
            (15, 2.0),
            (20, 3.0),
            (21, -1.0),
            (99, -1.0),
        ];
        for (step, wanted) in wanted {
            assert!((piecewise.at(step) - wanted).abs() < 1e-15, "{step}");
        }
        assert_eq!(piecewise.range(), (-1.0, 3.0));
    }

    #[test]
    fn each_schedule_counts_its_own_time() {
        let mut clock = Clock::default();
        clock.begin_episode();
        clock.begin_episode();
        (0..7).for_each(|_| clock.tick());
        let mean = Schedule::inverse_visits(1.0, 1.0).unwrap();
        assert!((mean.now(&clock, 3) - 0.25).abs() < 1e-15);
        assert_eq!(mean.range(), (0.0, 1.0));
        let linear = Schedule::linear(0.0, 10.0, 10).unwrap();
        assert!((linear.now(&clock, 3) - 7.0).abs() < 1e-15);
        assert!((linear.by_episode().now(&clock, 3) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn rounding_and_functions_never_lead_out_of_the_range() {
        for level in [1e-6, 0.1, 0.6, 1.0 / 3.0, 1.0, 1e6] {
            for steps in [3, 10, 49, 1_000] {
                let near = level * (1.0 + f64::EPSILON);
                for (start, end) in [(level, level), (level, near), (near, level)] {
                    for schedule in [
                        Schedule::linear(start, end, steps),
                        Schedule::exponential(start, end, steps),
                        Schedule::piecewise(&[(0, start), (steps, end)]),
                        Schedule::custom((start, end), |step| f64::powi(-2.0, step as i32)),
                        Schedule::custom((start, end), |_| f64::NAN),
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
        let refused = [
            Schedule::constant(f64::NAN),
            Schedule::linear(1.0, 0.0, 0),
            Schedule::linear(f64::INFINITY, 0.0, 3),
            Schedule::linear(0.0, f64::NAN, 3),
            Schedule::exponential(1.0, 0.0, 3),
            Schedule::inverse_visits(1.0, 0.0),
            Schedule::piecewise(&[]),
            Schedule::custom((0.0, f64::INFINITY), |_| 0.0),
        ];
        for schedule in refused {
            let is_setting = matches!(schedule, Err(Error::Setting { .. }));
            assert!(is_setting, "{schedule:?}");
        }
        let twice = Schedule::piecewise(&[(3, 0.0), (3, 1.0)]);
        assert!(matches!(twice, Err(Error::NotAscending(_, 1, ..))));
    }
}
