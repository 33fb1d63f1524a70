//! The regression simulator of the centring behaviour: what a move of `JT1` does to x.

use hough_heuristic::Features;

use crate::least_squares::{Entry, Fit, Rows};
use crate::{CentreSample, FitError, Quality, SightRule};

/// The change of x on 1, d1 and r d1, with d1 the move of `JT1` in degrees.
///
/// The paper's linear regression has no product with r; without it a fifth of the variance stays unexplained, because a near ball moves
/// farther in the image.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "stored::CentreModelData"))]
pub struct CentreModel {
    with_radius: bool,
    fit: Fit,
    quality: Vec<Quality>,
}

impl CentreModel {
    /// Fits dx on 1, d1, r d1.
    ///
    /// # Errors
    /// [`FitError`]: fewer than three samples, samples that do not determine the three coefficients, a sample that is not finite.
    pub fn fit(samples: &[CentreSample]) -> Result<Self, FitError> {
        Self::fit_terms(samples, true)
    }

    /// Fits dx on 1, d1: the paper's reading of linear regression.
    ///
    /// # Errors
    /// As for [`CentreModel::fit`], with two coefficients.
    pub fn fit_without_radius(samples: &[CentreSample]) -> Result<Self, FitError> {
        Self::fit_terms(samples, false)
    }

    fn fit_terms(samples: &[CentreSample], with_radius: bool) -> Result<Self, FitError> {
        let needed = 2 + usize::from(with_radius);
        let mut rows = Rows::default();
        for (index, s) in samples.iter().enumerate() {
            for (quantity, value) in [
                ("x before", s.before.x),
                ("r before", s.before.r),
                ("d1", s.d1),
                ("x after", s.after.x),
            ] {
                let usable = value.is_finite() && (quantity != "r before" || value > 0.0);
                if !usable {
                    return Err(FitError::NotFinite {
                        index,
                        quantity,
                        value,
                    });
                }
            }
            rows.push(&terms(&s.before, s.d1)[..needed], &[s.after.x - s.before.x], 1.0)
                .map_err(|(entry, value)| FitError::NotFinite {
                    index,
                    quantity: match entry {
                        Entry::Term(i) => ["the constant term", "the term d1", "the term r d1"][i],
                        Entry::Target(_) => "the change of x",
                    },
                    value,
                })?;
        }
        let place = "centring".to_owned();
        if samples.len() < needed {
            return Err(FitError::TooFewSamples {
                place,
                got: samples.len(),
                needed,
            });
        }
        let fit = rows.solve(&place, samples.len())?;
        let mut model = Self {
            with_radius,
            fit,
            quality: Vec::new(),
        };
        model.quality = model.quality_on(samples);
        Ok(model)
    }

    /// What the image shows after `JT1` turned by `d1` degrees; y and r stay. `None` if the ball is lost
    /// ([`SightRule::sees_features`]) or an argument is not finite.
    pub fn predict(&self, before: &Features, d1: f64) -> Option<Features> {
        let after = Features {
            x: before.x + self.change(before, d1),
            ..*before
        };
        SightRule::default().sees_features(&after).then_some(after)
    }

    /// The standard deviation of x, feature units, that the fit expects around what a new observation would show.
    pub fn uncertainty(&self, before: &Features, d1: f64) -> f64 {
        let terms = terms(before, d1);
        self.fit.residual[0] * (1.0 + self.fit.leverage(&terms[..self.fit.terms()])).sqrt()
    }

    /// What the fit leaves of the changes of x on its samples: standard deviation in feature units, with the degrees of freedom that
    /// are left.
    pub fn residual_noise(&self) -> f64 {
        self.fit.residual[0]
    }

    /// How well dx is reproduced on the samples the model was fitted to.
    pub fn quality(&self) -> Vec<Quality> {
        self.quality.clone()
    }

    /// How well dx is reproduced on other samples.
    pub fn quality_on(&self, samples: &[CentreSample]) -> Vec<Quality> {
        let pairs: Vec<(f64, Option<f64>)> = samples
            .iter()
            .map(|s| (s.after.x - s.before.x, Some(self.change(&s.before, s.d1))))
            .collect();
        vec![Quality::of("dx", &pairs)]
    }

    /// Condition number of the design matrix, columns scaled to unit length.
    pub fn condition_number(&self) -> f64 {
        self.fit.condition
    }

    fn change(&self, before: &Features, d1: f64) -> f64 {
        self.fit.value(0, &terms(before, d1)[..self.fit.terms()])
    }
}

fn terms(before: &Features, d1: f64) -> [f64; 3] {
    [1.0, d1, before.r * d1]
}

#[cfg(feature = "serde")]
mod stored {
    //! A stored model is believed only after its shape has been checked.

    use super::{CentreModel, Fit, Quality};

    #[derive(serde::Deserialize)]
    pub(super) struct CentreModelData {
        with_radius: bool,
        fit: Fit,
        quality: Vec<Quality>,
    }

    impl TryFrom<CentreModelData> for CentreModel {
        type Error = &'static str;

        fn try_from(data: CentreModelData) -> Result<Self, Self::Error> {
            let CentreModelData {
                with_radius,
                fit,
                quality,
            } = data;
            if !fit.fits(1, 2 + usize::from(with_radius)) {
                return Err("the stored model has the wrong number of coefficients, or some are not finite");
            }
            Ok(Self {
                with_radius,
                fit,
                quality,
            })
        }
    }
}
