//! Linear least squares with what one wants to know about a fit.

use nalgebra::{DMatrix, DVector};

use crate::error::QuantityError;
use crate::regression::reach_noise::{Misfit, pooled};

/// Why a regression has no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// Fewer samples than coefficients.
    #[error("{place}: {got} samples are too few for {needed} coefficients")]
    TooFewSamples {
        /// Which part of the model: an elbow interval, or the whole.
        place: String,
        /// Samples given.
        got: usize,
        /// Least number.
        needed: usize,
    },
    /// The samples do not tell all coefficients apart: moves all along one line, one elbow angle
    /// only, ...
    #[error(
        "{place}: the samples determine only {rank} of {terms} coefficients; vary the moves and the poses more"
    )]
    RankDeficient {
        /// Which part of the model.
        place: String,
        /// Numerical rank of the design matrix.
        rank: usize,
        /// Number of coefficients.
        terms: usize,
    },
    /// A sample holds a NaN or an infinity, or a radius that is not above zero.
    #[error("sample {index}: {quantity} is not a usable number ({value})")]
    NotFinite {
        /// Position of the sample, from 0.
        index: usize,
        /// Which of its quantities.
        quantity: &'static str,
        /// Its value.
        value: f64,
    },
    /// The edges of the elbow intervals are not finite and strictly ascending.
    #[error("the elbow edges must be finite and strictly ascending: {edges:?}")]
    Edges {
        /// The edges given, degrees.
        edges: Vec<f64>,
    },
    /// Prior and refit do not belong together, or a weight is not a finite number of zero or above.
    #[error("{what}")]
    Prior {
        /// What does not fit.
        what: String,
    },
}

impl FitError {
    /// The error of a sample that a model cannot be judged on.
    pub(crate) fn into_quantity(self) -> QuantityError {
        match self {
            Self::NotFinite {
                index,
                quantity,
                value,
            } => {
                let quantity = format!("sample {index}: {quantity}");
                if value.is_finite() && value <= 0.0 {
                    QuantityError::NotPositive { quantity, value }
                } else {
                    QuantityError::NotFinite { quantity, value }
                }
            }
            other => QuantityError::NotFinite {
                quantity: other.to_string(),
                value: f64::NAN,
            },
        }
    }
}

/// Coefficients for several targets over the same terms.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Fit {
    /// One vector of coefficients per target.
    pub(crate) coefficients: Vec<Vec<f64>>,
    /// Residual standard deviation of each target, with the degrees of freedom that are left.
    pub(crate) residual: Vec<f64>,
    /// Ratio of the greatest to the least singular value of the design matrix, columns scaled to
    /// unit length.
    pub(crate) condition: f64,
    /// (X'X)^-1, row after row.
    pub(crate) inverse_gram: Vec<f64>,
    /// Number of samples.
    pub(crate) samples: usize,
}

impl Fit {
    /// Number of terms.
    pub(crate) fn terms(&self) -> usize {
        self.coefficients.first().map_or(0, Vec::len)
    }

    /// Whether this is a fit of `targets` targets over `terms` terms, all numbers in their ranges:
    /// a stored one may be anything.
    pub(crate) fn fits(&self, targets: usize, terms: usize) -> bool {
        let finite = |v: &[f64]| v.iter().all(|x| x.is_finite());
        self.coefficients.len() == targets
            && self.residual.len() == targets
            && self.inverse_gram.len() == terms * terms
            && self
                .coefficients
                .iter()
                .all(|c| c.len() == terms && finite(c))
            && finite(&self.residual)
            && self.residual.iter().all(|sd| *sd >= 0.0)
            && finite(&self.inverse_gram)
            && self.gram_is_symmetric(terms)
            && self.condition.is_finite()
            && self.condition >= 1.0
            && self.samples > 0
    }

    /// Whether the inverse Gram matrix is symmetric, but for rounding, with nothing below zero on
    /// its diagonal.
    fn gram_is_symmetric(&self, terms: usize) -> bool {
        let of = |i: usize, j: usize| self.inverse_gram[i * terms + j];
        let length = |i: usize| of(i, i).sqrt();
        (0..terms).all(|i| {
            of(i, i) >= 0.0
                && (0..i).all(|j| (of(i, j) - of(j, i)).abs() <= 1e-6 * length(i) * length(j))
        })
    }

    /// Adds to the residual variances of a refit those of its prior; `freedom` is what the refit
    /// has left.
    pub(crate) fn pool<'a>(
        &mut self,
        prior: &Self,
        freedom: f64,
        misfits: impl IntoIterator<Item = &'a Misfit>,
    ) {
        let both = self.residual.iter_mut().zip(&prior.residual);
        for ((own, before), misfit) in both.zip(misfits) {
            *own = pooled(own.powi(2), before.powi(2), freedom, misfit).sqrt();
        }
    }

    /// The value of target `i` for these terms.
    pub(crate) fn value(&self, i: usize, terms: &[f64]) -> f64 {
        self.coefficients[i]
            .iter()
            .zip(terms)
            .map(|(c, t)| c * t)
            .sum()
    }

    /// x' (X'X)^-1 x: how far these terms lie from those the fit has seen; the variance of a
    /// prediction is the residual variance times one plus this.
    pub(crate) fn leverage(&self, terms: &[f64]) -> f64 {
        let n = terms.len();
        let rows = self.inverse_gram.chunks_exact(n.max(1));
        let sum: f64 = terms
            .iter()
            .zip(rows)
            .map(|(t, row)| t * dot(row, terms))
            .sum();
        sum.max(0.0)
    }
}

/// How a refit's coefficients are held toward those of its prior.
///
/// A ridge of k on the mean of the squared errors weighs n k against n samples, and is right where
/// the prior's coefficients are off by one residual variance over n k each. How far another plant's
/// coefficients are off does not depend on how many samples one has of it: what is expected is one
/// over k, as for a single sample.
pub(crate) struct Hold {
    strength: f64,
    scales: Vec<f64>,
    samples: usize,
}

impl Hold {
    /// With the `strength` and the `scales` of [`Rows::pull`].
    pub(crate) fn new(strength: f64, scales: &[f64], samples: usize) -> Self {
        Self {
            strength,
            scales: scales.to_vec(),
            samples,
        }
    }

    /// How strongly coefficient `k` is held.
    fn of(&self, k: usize) -> f64 {
        (self.strength * self.scales.get(k).copied().unwrap_or(1.0)).powi(2)
    }

    /// How much farther the prior's coefficients are off, in variance, than holding them so
    /// strongly supposes.
    fn farther(&self) -> f64 {
        self.samples.saturating_sub(1) as f64
    }
}

impl Fit {
    /// What a sample of these terms and this weight leaves to the others (1 less its leverage), and
    /// how uncertain they are of it: their leverage of it. `None` for a sample that alone decides a
    /// coefficient: nothing is left to predict it by.
    pub(crate) fn without(&self, terms: &[f64], weight: f64, hold: &Hold) -> Option<(f64, f64)> {
        let leverage = self.leverage(terms);
        let left = 1.0 - weight * leverage;
        let rows = self.inverse_gram.chunks_exact(terms.len().max(1));
        let pulled: f64 = rows
            .enumerate()
            .map(|(k, row)| hold.of(k) * dot(row, terms).powi(2))
            .sum();
        let of_others = leverage / left + hold.farther() * pulled / (left * left);
        (left > 1e-9).then_some((left, of_others))
    }

    /// Makes the leverages of a refit say how far its coefficients are off, whose prior is off by
    /// as much as `hold` says.
    pub(crate) fn hold(&mut self, hold: &Hold) {
        let n = self.terms();
        let gram = self.inverse_gram.clone();
        for i in 0..n {
            for j in 0..n {
                let pulled: f64 = (0..n)
                    .map(|k| gram[i * n + k] * hold.of(k) * gram[k * n + j])
                    .sum();
                self.inverse_gram[i * n + j] += hold.farther() * pulled;
            }
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Rows of terms with their targets.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rows {
    terms: Vec<f64>,
    targets: Vec<Vec<f64>>,
    count: usize,
}

/// One of the numbers of a row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Entry {
    /// A term, by position.
    Term(usize),
    /// A target, by position.
    Target(usize),
}

/// Greatest number in a row: squares of it can be summed. Columns shorter than its reciprocal count
/// as zero.
const GREATEST: f64 = 1e120;

impl Rows {
    /// One more observation; `weight` multiplies the row (the square root of its statistical
    /// weight).
    ///
    /// # Errors
    /// The first number that is not finite, or is too large to be squared; nothing has been added
    /// then.
    pub(crate) fn push(
        &mut self,
        terms: &[f64],
        targets: &[f64],
        weight: f64,
    ) -> Result<(), (Entry, f64)> {
        let entries = (terms.iter().enumerate().map(|(i, t)| (Entry::Term(i), t))).chain(
            targets
                .iter()
                .enumerate()
                .map(|(i, t)| (Entry::Target(i), t)),
        );
        for (entry, value) in entries {
            let usable = |v: f64| v.abs() <= GREATEST;
            if !usable(*value) || !usable(value * weight) {
                return Err((entry, *value));
            }
        }
        self.targets.resize_with(targets.len(), Vec::new);
        self.terms.extend(terms.iter().map(|t| t * weight));
        for (column, target) in self.targets.iter_mut().zip(targets) {
            column.push(target * weight);
        }
        self.count += 1;
        Ok(())
    }

    /// Rows that draw the coefficients toward those of `prior`, each over the `scales` of its term.
    ///
    /// # Errors
    /// [`FitError::Prior`] if the prior is too strong to be reckoned with.
    pub(crate) fn pull(
        &mut self,
        prior: &Fit,
        scales: &[f64],
        strength: f64,
    ) -> Result<(), FitError> {
        let mut unit = vec![0.0; prior.terms()];
        for k in 0..unit.len() {
            let scale = scales.get(k).copied().unwrap_or(1.0);
            unit[k] = scale;
            let targets: Vec<f64> = prior.coefficients.iter().map(|c| c[k] * scale).collect();
            self.push(&unit, &targets, strength)
                .map_err(|(_, value)| FitError::Prior {
                    what: format!("the prior is too strong to be reckoned with ({value})"),
                })?;
            unit[k] = 0.0;
        }
        Ok(())
    }

    /// Solves by QR of the column-scaled design matrix and a singular value decomposition of its
    /// triangle.
    ///
    /// The first `observations` rows are real ones; a prior adds rows that are not.
    pub(crate) fn solve(&self, place: &str, observations: usize) -> Result<Fit, FitError> {
        let n = self.terms.len().checked_div(self.count).unwrap_or(0);
        if self.count < n || self.count == 0 {
            let needed = n.max(1);
            return Err(FitError::TooFewSamples {
                place: place.to_owned(),
                got: observations,
                needed,
            });
        }
        let mut design = DMatrix::from_row_slice(self.count, n, &self.terms);
        let scales: Vec<f64> = design.column_iter().map(|c| c.norm()).collect();
        for (mut column, scale) in design.column_iter_mut().zip(&scales) {
            if *scale > 1.0 / GREATEST {
                column /= *scale;
            } else {
                column.fill(0.0);
            }
        }
        let qr = design.clone().qr();
        let (q, svd) = (qr.q(), qr.r().svd(true, true));
        let greatest = svd.singular_values.max();
        let floor = greatest * 1e-9;
        let rank = svd.singular_values.iter().filter(|s| **s > floor).count();
        if rank < n || !greatest.is_finite() {
            return Err(FitError::RankDeficient {
                place: place.to_owned(),
                rank,
                terms: n,
            });
        }
        let (Some(u), Some(v_t)) = (&svd.u, &svd.v_t) else {
            return Err(FitError::RankDeficient {
                place: place.to_owned(),
                rank: 0,
                terms: n,
            });
        };
        let inverse_singular = svd.singular_values.map(|s| 1.0 / s);
        // R^-1 of the scaled system, from its singular vectors.
        let inverse = v_t.transpose() * DMatrix::from_diagonal(&inverse_singular) * u.transpose();
        let gram = &inverse * inverse.transpose();
        // What the coefficients take from the real rows: their number, or less where a prior holds
        // them.
        let real = design.rows(0, observations.min(self.count));
        let taken = (real * &gram).component_mul(&real).sum();
        let freedom = (observations as f64 - taken).max(1.0);
        let (mut coefficients, mut residual) = (Vec::new(), Vec::new());
        for target in &self.targets {
            let y = DVector::from_column_slice(target);
            let scaled = &inverse * (q.transpose() * &y);
            let missed = y.rows(0, real.nrows()) - real * &scaled;
            residual.push((missed.norm_squared() / freedom).sqrt());
            coefficients.push(scaled.iter().zip(&scales).map(|(c, s)| c / s).collect());
        }
        let inverse_gram = (0..n * n)
            .map(|k| gram[(k / n, k % n)] / (scales[k / n] * scales[k % n]))
            .collect();
        Ok(Fit {
            coefficients,
            residual,
            condition: greatest / svd.singular_values.min(),
            inverse_gram,
            samples: observations,
        })
    }
}

/// What the rows of a prior are multiplied with, so that `ridge` counts against the mean over
/// `count` samples.
///
/// # Errors
/// [`FitError::Prior`] for a ridge that is not a number from 0 to 1e100.
pub(crate) fn ridge_strength(ridge: f64, count: usize) -> Result<f64, FitError> {
    if !(0.0..=1e100).contains(&ridge) {
        let what = format!("a refit needs a ridge of 0..=1e100, not {ridge}");
        return Err(FitError::Prior { what });
    }
    Ok((ridge * count as f64).sqrt())
}

/// How well a model reproduces one output.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Quality {
    /// The output: `dx`, `dy` or `dr`, feature units.
    pub output: String,
    /// Coefficient of determination: the share of the output's variance that the model explains, at
    /// most 1; 0 where the output does not vary.
    pub r2: f64,
    /// Root of the mean squared error, feature units.
    pub rmse: f64,
    /// Number of samples.
    #[cfg_attr(feature = "serde", serde(default))]
    pub samples: usize,
    /// How many of them the model has no prediction for (it places the ball behind the camera).
    /// They count with all of their change as error.
    #[cfg_attr(feature = "serde", serde(default))]
    pub unpredicted: usize,
}

impl Quality {
    /// Refuses to judge a model on nothing.
    pub(crate) fn some(samples: usize) -> Result<(), QuantityError> {
        if samples == 0 {
            return Err(QuantityError::NotPositive {
                quantity: "the number of samples to judge a model on".to_owned(),
                value: 0.0,
            });
        }
        Ok(())
    }

    /// Whether these are judgements of `outputs`, in that order, with all numbers in their ranges:
    /// stored ones may be anything.
    pub(crate) fn are_sound(all: &[Self], outputs: &[&str]) -> bool {
        all.len() == outputs.len()
            && all.iter().zip(outputs).all(|(q, output)| {
                let numbers =
                    q.r2.is_finite() && q.r2 <= 1.0 && q.rmse.is_finite() && q.rmse >= 0.0;
                q.output == *output && numbers && q.samples > 0 && q.unpredicted <= q.samples
            })
    }

    /// From pairs of (observed, predicted) changes.
    pub(crate) fn of(output: &str, pairs: &[(f64, Option<f64>)]) -> Self {
        let n = pairs.len() as f64;
        let mean = pairs.iter().map(|p| p.0).sum::<f64>() / n;
        let spread: f64 = pairs.iter().map(|p| (p.0 - mean).powi(2)).sum();
        let error: f64 = pairs
            .iter()
            .map(|p| (p.0 - p.1.unwrap_or(0.0)).powi(2))
            .sum();
        Self {
            output: output.to_owned(),
            // Where nothing varies there is nothing to explain.
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
