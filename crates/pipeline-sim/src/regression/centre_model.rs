//! The regression simulator of the centering behaviour: the change of x by a move of `JT1`.

use hough_heuristic::Features;

use crate::cell::sight::SightRule;
use crate::error::{FitError, QuantityError, check_ridge};
use crate::regression::least_squares::{Entry, Fit, Rows};
use crate::regression::quality::{Quality, VERSION, check_version};
use crate::regression::samples::CentreSample;

/// Terms 1, d1, r d1 of the longest move of the list at the goal's radius: the units of a ridge.
const SCALES: [f64; 3] = [1.0, 5.0, 5.0 * 33.0];

/// A regression of the change of x on 1, d1 and r d1, with d1 the move of `JT1` in degrees.
///
/// The paper's linear regression has no product with r; without it a fifth of the variance stays
/// unexplained, because a near ball moves farther in the image.
///
/// With the feature `serde` a model can be stored; it is checked when it is read.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "Parts")
)]
pub struct CentreModel(Parts);

#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Parts {
    #[cfg_attr(feature = "serde", serde(default))]
    version: u32,
    with_radius: bool,
    fit: Fit,
    quality: Vec<Quality>,
}

impl TryFrom<Parts> for CentreModel {
    type Error = String;

    fn try_from(parts: Parts) -> Result<Self, String> {
        check_version(parts.version)?;
        if parts.fit.is_sound(1, 2 + usize::from(parts.with_radius))
            && Quality::are_sound(&parts.quality, &["dx"])
        {
            return Ok(Self(parts));
        }
        Err(
            "the stored model is damaged: it has the wrong number of coefficients, or a number is \
             out of range"
                .to_owned(),
        )
    }
}

impl CentreModel {
    /// Fits dx on 1, d1, r d1.
    ///
    /// # Errors
    /// [`FitError`]: fewer than three samples, samples that do not determine the three
    /// coefficients, a sample that is not finite.
    pub fn fit(samples: &[CentreSample]) -> Result<Self, FitError> {
        Self::fit_terms(samples, true)
    }

    /// Fits dx on 1, d1: the paper's reading of linear regression.
    ///
    /// # Errors
    /// [`CentreModel::fit`] lists them; two samples are enough.
    pub fn fit_without_radius(samples: &[CentreSample]) -> Result<Self, FitError> {
        Self::fit_terms(samples, false)
    }

    fn fit_terms(samples: &[CentreSample], with_radius: bool) -> Result<Self, FitError> {
        let needed = 2 + usize::from(with_radius);
        let rows = rows(samples, needed)?;
        enough(samples, needed)?;
        let fit = rows.solve(PLACE, samples.len())?;
        Ok(Self::with(with_radius, fit, samples))
    }

    /// Fits the model to samples of another plant by ridge regression toward this model.
    ///
    /// The coefficients c minimise the mean of (change - terms · c)² plus `ridge` · |c - c0|², with
    /// c0 this model's coefficients and the terms 1, d1 / 5, r d1 / 165 (all near 1 for the longest
    /// move of the list at the goal). Without samples the model is returned unchanged.
    ///
    /// # Errors
    /// [`FitError::Prior`] for a `ridge` out of 0..=1e100; otherwise those of
    /// [`CentreModel::fit`]. With a ridge of 1e-12 or above any number of samples is enough.
    pub fn refit(&self, samples: &[CentreSample], ridge: f64) -> Result<Self, FitError> {
        check_ridge(ridge)?;
        let needed = self.0.fit.terms();
        let mut rows = rows(samples, needed)?;
        if samples.is_empty() {
            return Ok(self.clone());
        }
        if ridge > 0.0 {
            rows.pull(&self.0.fit, &SCALES[..needed], ridge, samples.len())?;
        } else {
            enough(samples, needed)?;
        }
        let fit = rows.solve(PLACE, samples.len())?;
        Ok(Self::with(self.0.with_radius, fit, samples))
    }

    /// Builds the model with these coefficients, judged on the samples they were fitted to.
    fn with(with_radius: bool, fit: Fit, samples: &[CentreSample]) -> Self {
        let mut model = Self(Parts {
            version: VERSION,
            with_radius,
            fit,
            quality: Vec::new(),
        });
        model.0.quality = vec![model.judge(samples)];
        model
    }

    /// Predicts the features after `JT1` turned by `d1` degrees; y and r stay. `None` if the ball
    /// is lost ([`SightRule::sees_features`]) or an argument is not finite.
    pub fn predict(&self, before: &Features, d1: f64) -> Option<Features> {
        let after = Features {
            x: before.x + self.change(before, d1),
            ..*before
        };
        SightRule::default().sees_features(&after).then_some(after)
    }

    /// Accuracy of dx on the samples the model was fitted to.
    pub fn quality(&self) -> &[Quality] {
        &self.0.quality
    }

    /// Judges the model on other samples.
    ///
    /// # Errors
    /// [`QuantityError`]: no samples, or one that holds a NaN, an infinity, or a radius that is not
    /// above zero.
    pub fn quality_on(&self, samples: &[CentreSample]) -> Result<Vec<Quality>, QuantityError> {
        Quality::some(samples.len())?;
        rows(samples, self.0.fit.terms()).map_err(FitError::into_quantity)?;
        Ok(vec![self.judge(samples)])
    }

    fn judge(&self, samples: &[CentreSample]) -> Quality {
        let pairs: Vec<(f64, Option<f64>)> = samples
            .iter()
            .map(|s| (s.after.x - s.before.x, Some(self.change(&s.before, s.d1))))
            .collect();
        Quality::of("dx", &pairs)
    }

    /// Condition number of the design matrix, columns scaled to unit length.
    pub fn condition_number(&self) -> f64 {
        self.0.fit.condition
    }

    fn change(&self, before: &Features, d1: f64) -> f64 {
        let fit = &self.0.fit;
        fit.value(0, &terms(before, d1)[..fit.terms()])
    }
}

fn terms(before: &Features, d1: f64) -> [f64; 3] {
    [1.0, d1, before.r * d1]
}

/// Name of the whole of the samples in errors.
const PLACE: &str = "centering";

/// Collects the rows of the first `needed` terms; refuses samples that cannot be fitted to.
fn rows(samples: &[CentreSample], needed: usize) -> Result<Rows, FitError> {
    let mut rows = Rows::default();
    for (index, s) in samples.iter().enumerate() {
        let not_finite = |quantity, value| FitError::NotFinite {
            index,
            quantity,
            value,
        };
        for (quantity, value) in [
            ("x before", s.before.x),
            ("r before", s.before.r),
            ("d1", s.d1),
            ("x after", s.after.x),
        ] {
            let usable = value.is_finite() && (quantity != "r before" || value > 0.0);
            if !usable {
                return Err(not_finite(quantity, value));
            }
        }
        let change = s.after.x - s.before.x;
        rows.push(&terms(&s.before, s.d1)[..needed], &[change], 1.0)
            .map_err(|(entry, value)| {
                let quantity = match entry {
                    Entry::Term(i) => ["the constant term", "the term d1", "the term r d1"][i],
                    Entry::Target(_) => "the change of x",
                };
                not_finite(quantity, value)
            })?;
    }
    Ok(rows)
}

fn enough(samples: &[CentreSample], needed: usize) -> Result<(), FitError> {
    if samples.len() < needed {
        return Err(FitError::TooFewSamples {
            place: PLACE.to_owned(),
            got: samples.len(),
            needed,
        });
    }
    Ok(())
}
