//! The accuracy of a model on samples.

/// The accuracy with which a model reproduces one output.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Quality {
    /// Name of the output: `dx`, `dy` or `dr`.
    pub output: String,
    /// Coefficient of determination, at most 1; 0 where the output does not vary.
    pub r2: f64,
    /// Root of the mean squared error, feature units.
    pub rmse: f64,
    /// Number of samples.
    pub samples: usize,
    /// Number of samples for which the model has no prediction because it places the ball behind
    /// the camera. They count with all of their change as error.
    pub unpredicted: usize,
}

impl Quality {
    /// Returns `true` if these belong to `outputs`, in that order, with all numbers in their
    /// ranges. Stored ones may hold anything.
    pub(super) fn are_sound(all: &[Self], outputs: &[&str]) -> bool {
        all.len() == outputs.len()
            && all.iter().zip(outputs).all(|(q, output)| {
                let numbers =
                    q.r2.is_finite() && q.r2 <= 1.0 && q.rmse.is_finite() && q.rmse >= 0.0;
                q.output == *output && numbers && q.samples > 0 && q.unpredicted <= q.samples
            })
    }

    /// Judges pairs of observed and predicted changes.
    pub(super) fn of(output: &str, pairs: &[(f64, Option<f64>)]) -> Self {
        let n = pairs.len() as f64;
        let mean = pairs.iter().map(|p| p.0).sum::<f64>() / n;
        let spread: f64 = pairs.iter().map(|p| (p.0 - mean).powi(2)).sum();
        let missed = pairs.iter().map(|p| p.0 - p.1.unwrap_or(0.0));
        let error: f64 = missed.map(|miss| miss.powi(2)).sum();
        Self {
            output: output.to_owned(),
            r2: if spread > 0.0 {
                1.0 - error / spread
            } else {
                0.0
            },
            rmse: (error / n).sqrt(),
            samples: pairs.len(),
            unpredicted: pairs.iter().filter(|p| p.1.is_none()).count(),
        }
    }
}
