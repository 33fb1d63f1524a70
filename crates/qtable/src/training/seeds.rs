//! Experiments over many seeds, and means with their intervals.

/// Runs an experiment once for every seed and returns the results in the order of the seeds.
///
/// With the feature `parallel` the runs are spread over all processor cores; the results are the
/// same to the bit, because a run sees nothing but its seed.
///
/// ```
/// use qtable::rand::{SeedableRng, rngs::Xoshiro256PlusPlus};
/// use qtable::{
///     EpsilonGreedy, Estimate, ModelEnvironment, QLearning, QTable, Schedule, State, Training,
///     Until, over_seeds,
/// };
///
/// fn main() -> Result<(), qtable::Error> {
///     let values = over_seeds(0..10, |seed| {
///         let mut chain = ModelEnvironment::chain(4)?;
///         let learner = QLearning::new(Schedule::constant(0.5)?, 0.9)?;
///         let policy = EpsilonGreedy::new(Schedule::constant(0.5)?)?;
///         let mut training = Training::new(&chain, QTable::new(4, 2)?, learner, policy)?;
///         let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
///         training.run(&mut chain, Until::Actions(2_000), &mut rng)?;
///         Ok::<_, qtable::Error>(training.table().max(State(0)))
///     })?;
///     assert!((Estimate::of(&values).mean - 0.81).abs() < 0.01);
///     Ok(())
/// }
/// ```
///
/// # Errors
/// The error of the first seed, in their order, whose run failed.
pub fn over_seeds<T: Send, E: Send>(
    seeds: impl IntoIterator<Item = u64>,
    run: impl Fn(u64) -> Result<T, E> + Sync,
) -> Result<Vec<T>, E> {
    let seeds: Vec<u64> = seeds.into_iter().collect();
    #[cfg(feature = "parallel")]
    let results: Vec<Result<T, E>> = {
        use rayon::iter::{IntoParallelIterator, ParallelIterator};
        seeds.into_par_iter().map(&run).collect()
    };
    #[cfg(not(feature = "parallel"))]
    let results: Vec<Result<T, E>> = seeds.into_iter().map(run).collect();
    results.into_iter().collect()
}

/// A mean of several runs with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Estimate {
    /// The mean; NaN of no values.
    pub mean: f64,
    /// Half the width of the 95 % interval of the mean, by Student's t: the mean lies within
    /// `mean ± half_width`. Infinite for fewer than two values.
    pub half_width: f64,
    /// Number of values.
    pub count: usize,
}

impl Estimate {
    /// Estimates the mean of independent values, one a run.
    pub fn of(values: &[f64]) -> Self {
        let count = values.len();
        let mean = values.iter().sum::<f64>() / count as f64;
        let half_width = if count < 2 {
            f64::INFINITY
        } else {
            let squares = values.iter().map(|value| (value - mean) * (value - mean));
            let deviation = (squares.sum::<f64>() / (count - 1) as f64).sqrt();
            student_t(count - 1) * deviation / (count as f64).sqrt()
        };
        Self {
            mean,
            half_width,
            count,
        }
    }
}

impl std::fmt::Display for Estimate {
    /// Writes `mean ± half width`, with three decimals unless a precision is given.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let precision = f.precision().unwrap_or(3);
        let (mean, half_width) = (self.mean, self.half_width);
        write!(f, "{mean:.precision$} ± {half_width:.precision$}")
    }
}

/// Returns the 97.5 % quantile of Student's t distribution, to 0.1 % (by the expansion of Fisher
/// and Cornish from six degrees of freedom on).
fn student_t(degrees: usize) -> f64 {
    const FEW: [f64; 5] = [12.706_2, 4.302_65, 3.182_45, 2.776_45, 2.570_58];
    if let Some(&t) = degrees.checked_sub(1).and_then(|index| FEW.get(index)) {
        return t;
    }
    let z: f64 = 1.959_964;
    let n = degrees as f64;
    let z2 = z * z;
    let z3 = z2 * z;
    let z5 = z3 * z2;
    let z7 = z5 * z2;
    z + (z3 + z) / (4.0 * n)
        + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * n * n)
        + (3.0 * z7 + 19.0 * z5 + 17.0 * z3 - 15.0 * z) / (384.0 * n * n * n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (degrees, wanted) in [
            (1, 12.706),
            (5, 2.571),
            (6, 2.447),
            (9, 2.262),
            (30, 2.042),
            (120, 1.980),
        ] {
            assert!(
                (student_t(degrees) / wanted - 1.0).abs() < 1e-3,
                "{degrees}: {}",
                student_t(degrees)
            );
        }
    }

    #[test]
    fn the_interval_of_a_mean_is_that_of_the_textbook() {
        // Ten values of mean 5.5 and deviation 3.0277: 2.262 * 3.0277 / sqrt(10).
        let values: Vec<f64> = (1..=10).map(f64::from).collect();
        let estimate = Estimate::of(&values);
        assert!((estimate.mean - 5.5).abs() < 1e-12 && (estimate.half_width - 2.1659).abs() < 1e-3);
        assert_eq!(estimate.to_string(), "5.500 ± 2.166");
        assert!(Estimate::of(&[1.0]).half_width.is_infinite() && Estimate::of(&[]).mean.is_nan());
    }
}
