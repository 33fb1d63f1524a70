//! Linear least squares by QR and a singular value decomposition.

use nalgebra::{DMatrix, DVector};

use crate::error::QuantityError;

/// Coefficients of several targets over the same terms.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Fit {
    /// One vector of coefficients per target.
    pub(super) coefficients: Vec<Vec<f64>>,
    /// Ratio of the greatest to the least singular value of the design matrix, columns scaled to
    /// unit length.
    pub(super) condition: f64,
}

impl Fit {
    /// Number of terms.
    pub(super) fn terms(&self) -> usize {
        self.coefficients.first().map_or(0, Vec::len)
    }

    /// Returns the value of target `i` for these terms.
    pub(super) fn value(&self, i: usize, terms: &[f64]) -> f64 {
        let pairs = self.coefficients[i].iter().zip(terms);
        pairs.map(|(c, t)| c * t).sum()
    }

    /// Returns `true` for `targets` targets over `terms` terms with all numbers in their ranges.
    /// Stored fits may hold anything.
    pub(super) fn is_sound(&self, targets: usize, terms: usize) -> bool {
        let sound = |c: &Vec<f64>| c.len() == terms && c.iter().all(|v| v.is_finite());
        self.coefficients.len() == targets
            && self.coefficients.iter().all(sound)
            && self.condition.is_finite()
            && self.condition >= 1.0
    }
}

/// Rows of terms with their targets.
#[derive(Clone, Debug, Default)]
pub(super) struct Rows {
    terms: Vec<f64>,
    targets: Vec<Vec<f64>>,
    count: usize,
}

/// Greatest magnitude of a number in a row: its squares can be summed. Columns shorter than its
/// reciprocal count as zero.
const GREATEST: f64 = 1e120;

impl Rows {
    /// Adds an observation; `weight` multiplies the row (the square root of its statistical
    /// weight).
    ///
    /// # Errors
    /// Position, terms first, and value of the first number that is not finite or too large to be
    /// squared; the row is not added.
    pub(super) fn push(
        &mut self,
        terms: &[f64],
        targets: &[f64],
        weight: f64,
    ) -> Result<(), (usize, f64)> {
        let usable = |v: f64| v.abs() <= GREATEST && (v * weight).abs() <= GREATEST;
        let mut entries = terms.iter().chain(targets).enumerate();
        if let Some((entry, value)) = entries.find(|(_, value)| !usable(**value)) {
            return Err((entry, *value));
        }
        self.targets.resize_with(targets.len(), Vec::new);
        self.terms.extend(terms.iter().map(|t| t * weight));
        for (column, target) in self.targets.iter_mut().zip(targets) {
            column.push(target * weight);
        }
        self.count += 1;
        Ok(())
    }

    /// Adds the rows of a ridge that pulls the coefficients toward those of `prior`: `ridge` counts
    /// against the mean over `count` samples, each coefficient in units of the reciprocal of its
    /// scale.
    ///
    /// # Errors
    /// [`QuantityError::Value`] if `ridge` is too large for the arithmetic.
    pub(super) fn pull(
        &mut self,
        prior: &Fit,
        scale: impl Fn(usize) -> f64,
        ridge: f64,
        count: usize,
    ) -> Result<(), QuantityError> {
        let strength = (ridge * count as f64).sqrt();
        let mut unit = vec![0.0; prior.terms()];
        for k in 0..unit.len() {
            unit[k] = scale(k);
            let targets: Vec<f64> = prior.coefficients.iter().map(|c| c[k] * unit[k]).collect();
            self.push(&unit, &targets, strength)
                .map_err(|(_, value)| QuantityError::Value {
                    quantity: "the ridge of a refit".to_owned(),
                    value: ridge,
                    allowed: format!("smaller for a coefficient of {value}"),
                })?;
            unit[k] = 0.0;
        }
        Ok(())
    }

    /// Solves by QR of the column-scaled design matrix and a singular value decomposition of its
    /// triangle. `place` and `observations` (the rows that are no ridge) are for errors.
    pub(super) fn solve(&self, place: &str, observations: usize) -> Result<Fit, QuantityError> {
        let n = self.terms.len().checked_div(self.count).unwrap_or(0);
        if self.count < n || self.count == 0 {
            return Err(too_few(place, observations, n.max(1)));
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
        let qr = design.qr();
        let (q, svd) = (qr.q(), qr.r().svd(true, true));
        let greatest = svd.singular_values.max();
        let floor = greatest * 1e-9;
        let rank = svd.singular_values.iter().filter(|s| **s > floor).count();
        let deficient = |rank| QuantityError::Undetermined {
            place: place.to_owned(),
            rank,
            terms: n,
        };
        if rank < n || !greatest.is_finite() {
            return Err(deficient(rank));
        }
        let (Some(u), Some(v_t)) = (&svd.u, &svd.v_t) else {
            return Err(deficient(0));
        };
        let inverse_singular = svd.singular_values.map(|s| 1.0 / s);
        // R^-1 of the scaled system, from its singular vectors.
        let inverse = v_t.transpose() * DMatrix::from_diagonal(&inverse_singular) * u.transpose();
        let coefficients = self.targets.iter().map(|target| {
            let scaled = &inverse * (q.transpose() * DVector::from_column_slice(target));
            scaled.iter().zip(&scales).map(|(c, s)| c / s).collect()
        });
        Ok(Fit {
            coefficients: coefficients.collect(),
            condition: greatest / svd.singular_values.min(),
        })
    }
}

/// Returns the error of fewer samples than coefficients.
pub(super) fn too_few(place: &str, got: usize, needed: usize) -> QuantityError {
    QuantityError::Value {
        quantity: format!("the number of samples for {place}"),
        value: got as f64,
        allowed: format!("at least {needed}"),
    }
}
