//! Linear least squares with what one wants to know about a fit.

use nalgebra::{DMatrix, DVector};

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
    /// The samples do not tell all coefficients apart: moves all along one line, one elbow angle only, ...
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

/// Coefficients for several targets over the same terms.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Fit {
    /// One vector of coefficients per target.
    pub(crate) coefficients: Vec<Vec<f64>>,
    /// Residual standard deviation of each target, with the degrees of freedom that are left.
    pub(crate) residual: Vec<f64>,
    /// Ratio of the greatest to the least singular value of the design matrix, columns scaled to unit length.
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

    /// Whether this is a fit of `targets` targets over `terms` terms, all numbers finite: a stored one may be anything.
    #[cfg(feature = "serde")]
    pub(crate) fn fits(&self, targets: usize, terms: usize) -> bool {
        let finite = |v: &[f64]| v.iter().all(|x| x.is_finite());
        self.coefficients.len() == targets
            && self.residual.len() == targets
            && self.inverse_gram.len() == terms * terms
            && self.coefficients.iter().all(|c| c.len() == terms && finite(c))
            && finite(&self.residual)
            && finite(&self.inverse_gram)
    }

    /// The value of target `i` for these terms.
    pub(crate) fn value(&self, i: usize, terms: &[f64]) -> f64 {
        self.coefficients[i].iter().zip(terms).map(|(c, t)| c * t).sum()
    }

    /// x' (X'X)^-1 x: how far these terms lie from those the fit has seen; the variance of a prediction is the residual
    /// variance times one plus this.
    pub(crate) fn leverage(&self, terms: &[f64]) -> f64 {
        let n = terms.len();
        let rows = self.inverse_gram.chunks_exact(n.max(1));
        let sum: f64 = terms.iter().zip(rows).map(|(t, row)| t * dot(row, terms)).sum();
        sum.max(0.0)
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

impl Rows {
    /// One more observation; `weight` multiplies the row (the square root of its statistical weight).
    pub(crate) fn push(&mut self, terms: &[f64], targets: &[f64], weight: f64) {
        self.targets.resize_with(targets.len(), Vec::new);
        self.terms.extend(terms.iter().map(|t| t * weight));
        for (column, target) in self.targets.iter_mut().zip(targets) {
            column.push(target * weight);
        }
        self.count += 1;
    }

    /// Solves by QR of the column-scaled design matrix and a singular value decomposition of its triangle.
    ///
    /// `observations` is how many of the rows are real ones (a prior adds rows that are not).
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
            if *scale > 0.0 {
                column /= *scale;
            }
        }
        let qr = design.qr();
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
        let freedom = observations.saturating_sub(n).max(1) as f64;
        let (mut coefficients, mut residual) = (Vec::new(), Vec::new());
        for target in &self.targets {
            let y = DVector::from_column_slice(target);
            let projected = q.transpose() * &y;
            let scaled = &inverse * &projected;
            residual.push(((y.norm_squared() - projected.norm_squared()).max(0.0) / freedom).sqrt());
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

/// How well a model reproduces one output.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Quality {
    /// The output: `dx`, `dy` or `dr`, feature units.
    pub output: String,
    /// Coefficient of determination: the share of the output's variance that the model explains, at most 1.
    pub r2: f64,
    /// Root of the mean squared error, feature units.
    pub rmse: f64,
}

impl Quality {
    /// From pairs of (observed, predicted) changes.
    pub(crate) fn of(output: &str, pairs: &[(f64, f64)]) -> Self {
        let n = pairs.len() as f64;
        let mean = pairs.iter().map(|p| p.0).sum::<f64>() / n;
        let spread: f64 = pairs.iter().map(|p| (p.0 - mean).powi(2)).sum();
        let error: f64 = pairs.iter().map(|p| (p.0 - p.1).powi(2)).sum();
        Self {
            output: output.to_owned(),
            r2: 1.0 - error / spread,
            rmse: (error / n).sqrt(),
        }
    }
}
