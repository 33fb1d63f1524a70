//! The regression simulator of the centring behaviour: what a move of `JT1` does to x.

use hough_heuristic::Features;

use crate::cell::geometry::SightRule;
use crate::error::QuantityError;
use crate::regression::least_squares::{Entry, Fit, Hold, Rows, ridge_strength};
use crate::regression::least_squares::{FitError, Quality};
use crate::regression::reach_noise::{Misfit, Noise, Shares, widening};
use crate::regression::samples::CentreSample;
use crate::regression::stored::StoredModelError;
use crate::regression::stored::{Reader, Writer};

/// Terms 1, d1, r d1 of the longest move of the list at the goal's radius: what one unit of a ridge
/// is measured in.
const SCALES: [f64; 3] = [1.0, 5.0, 5.0 * 33.0];

/// The change of x on 1, d1 and r d1, with d1 the move of `JT1` in degrees.
///
/// The paper's linear regression has no product with r; without it a fifth of the variance stays
/// unexplained, because a near ball moves farther in the image.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(into = "stored::CentreModelData", try_from = "stored::CentreModelData")
)]
pub struct CentreModel {
    with_radius: bool,
    fit: Fit,
    /// How far observations of x lie from predictions.
    noise: Noise,
    quality: Vec<Quality>,
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
    /// As for [`CentreModel::fit`], with two coefficients.
    pub fn fit_without_radius(samples: &[CentreSample]) -> Result<Self, FitError> {
        Self::fit_terms(samples, false)
    }

    fn fit_terms(samples: &[CentreSample], with_radius: bool) -> Result<Self, FitError> {
        let needed = 2 + usize::from(with_radius);
        let rows = rows(samples, needed)?;
        enough(samples, needed)?;
        let fit = rows.solve(PLACE, samples.len())?;
        Ok(Self::with(with_radius, fit, samples, None))
    }

    /// The model fitted anew to samples of another plant, held toward this one, as
    /// [`ReachModel::refit`](crate::ReachModel::refit) does it for the approach: the coefficients c
    /// minimise the mean of (change - terms · c)² plus `ridge` · |c - c0|², with c0 this model's
    /// coefficients and the terms 1, d1 / 5, r d1 / 165 (all near 1 for the longest move of the
    /// list at the goal). Without samples the model stays as it is. [`CentreModel::uncertainty`] is
    /// found as there.
    ///
    /// # Errors
    /// [`FitError::Prior`] for a `ridge` that is not a finite number of zero or above, or above
    /// 1e100; otherwise as for [`CentreModel::fit`] (with a ridge of 1e-12 or above neither too few
    /// samples nor a lack of rank is an error).
    pub fn refit(&self, samples: &[CentreSample], ridge: f64) -> Result<Self, FitError> {
        let strength = ridge_strength(ridge, samples.len())?;
        let needed = self.fit.terms();
        let mut rows = rows(samples, needed)?;
        if samples.is_empty() {
            return Ok(self.clone());
        }
        if ridge > 0.0 {
            rows.pull(&self.fit, &SCALES[..needed], strength)?;
        } else {
            enough(samples, needed)?;
        }
        let fit = rows.solve(PLACE, samples.len())?;
        let hold = Hold::new(strength, &SCALES, samples.len());
        Ok(Self::with(
            self.with_radius,
            fit,
            samples,
            Some((self, hold)),
        ))
    }

    /// The model with these coefficients, judged on the samples they were fitted to; of a refit,
    /// with the prior.
    fn with(
        with_radius: bool,
        fit: Fit,
        samples: &[CentreSample],
        prior: Option<(&Self, Hold)>,
    ) -> Self {
        let mut model = Self {
            with_radius,
            fit,
            noise: Noise::default(),
            quality: Vec::new(),
        };
        let n = model.fit.terms();
        let taken: f64 = samples
            .iter()
            .map(|s| model.fit.leverage(&terms(&s.before, s.d1)[..n]))
            .sum();
        let residuals: Vec<(Shares, f64)> = samples
            .iter()
            .map(|s| {
                let missed = s.after.x - s.before.x - model.change(&s.before, s.d1);
                (shares(&s.before, s.d1, with_radius), missed * missed)
            })
            .collect();
        let count = samples.len() as f64;
        let freedom = count - taken;
        model.noise = Noise::of(&residuals, freedom.max(1.0) / count);
        if let Some((prior, hold)) = prior {
            let misfit = prior.misfit(samples, &model.fit, &hold);
            model.fit.pool(&prior.fit, freedom, [&misfit]);
            model.fit.hold(&hold);
            model.noise = model.noise.pooled(&prior.noise, freedom, &misfit);
        }
        model.quality = vec![model.judge(samples)];
        model
    }

    /// By how much more, or less, than this model expects its refit errs: each sample is predicted
    /// by what the others and the prior say of it, `fit` without it.
    fn misfit(&self, samples: &[CentreSample], fit: &Fit, hold: &Hold) -> Misfit {
        let mut misfit = Misfit::default();
        for s in samples {
            let terms = &terms(&s.before, s.d1)[..fit.terms()];
            let Some((left, leverage)) = fit.without(terms, 1.0, hold) else {
                continue;
            };
            let missed = (s.after.x - s.before.x - fit.value(0, terms)) / left;
            let noise = self
                .noise
                .variance(shares(&s.before, s.d1, self.with_radius));
            misfit.add(missed * missed / (noise + self.fit.residual[0].powi(2) * leverage));
        }
        misfit
    }

    /// What the image shows after `JT1` turned by `d1` degrees; y and r stay. `None` if the ball is
    /// lost ([`SightRule::sees_features`]) or an argument is not finite.
    pub fn predict(&self, before: &Features, d1: f64) -> Option<Features> {
        let after = Features {
            x: before.x + self.change(before, d1),
            ..*before
        };
        SightRule::default().sees_features(&after).then_some(after)
    }

    /// The standard deviation of x, feature units, that the fit expects around what a new
    /// observation would show: noise, what the terms leave out (which grows with the move), and the
    /// uncertainty of the coefficients. `None` if an argument is not finite, or `before` shows a
    /// radius that is not above zero.
    pub fn uncertainty(&self, before: &Features, d1: f64) -> Option<f64> {
        let finite = before.x.is_finite() && before.y.is_finite();
        if !finite || before.r.is_nan() || before.r <= 0.0 {
            return None;
        }
        let terms = terms(before, d1);
        let of_fit = self.fit.residual[0].powi(2) * self.fit.leverage(&terms[..self.fit.terms()]);
        let sd = (self.noise.variance(shares(before, d1, self.with_radius)) + of_fit).sqrt();
        let sd = sd * widening(self.fit.samples);
        sd.is_finite().then_some(sd)
    }

    /// What the fit leaves of the changes of x on its samples: standard deviation in feature units,
    /// with the degrees of freedom that are left; of a refit, together with those of its prior.
    pub fn residual_noise(&self) -> f64 {
        self.fit.residual[0]
    }

    /// How well dx is reproduced on the samples the model was fitted to.
    pub fn quality(&self) -> Vec<Quality> {
        self.quality.clone()
    }

    /// How well dx is reproduced on other samples.
    ///
    /// # Errors
    /// [`QuantityError`]: no samples, or one that holds a NaN, an infinity, or a radius that is not
    /// above zero.
    pub fn quality_on(&self, samples: &[CentreSample]) -> Result<Vec<Quality>, QuantityError> {
        Quality::some(samples.len())?;
        rows(samples, self.fit.terms()).map_err(FitError::into_quantity)?;
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
        self.fit.condition
    }

    fn change(&self, before: &Features, d1: f64) -> f64 {
        self.fit.value(0, &terms(before, d1)[..self.fit.terms()])
    }
}

fn terms(before: &Features, d1: f64) -> [f64; 3] {
    [1.0, d1, before.r * d1]
}

/// By how much noise, and what the terms leave out, show in x. Without r d1 they leave out how near
/// the ball is; with it, how far it is from the waist's axis, which says how far a turn carries it.
fn shares(before: &Features, d1: f64, with_radius: bool) -> Shares {
    let [_, turned, near] = terms(before, d1);
    let left_out = if with_radius {
        near / SCALES[2]
    } else {
        turned / SCALES[1]
    };
    Shares {
        observed: 1.0,
        fitted: left_out * left_out,
    }
}

/// What errors call the whole of the samples.
const PLACE: &str = "centring";

/// The rows of the first `needed` terms; refuses samples that cannot be fitted to.
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
        rows.push(
            &terms(&s.before, s.d1)[..needed],
            &[s.after.x - s.before.x],
            1.0,
        )
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

impl CentreModel {
    const KIND: &str = "centre-model";

    /// The model as text, which [`CentreModel::from_text`] turns into the same model again.
    pub fn to_text(&self) -> String {
        let mut out = Writer::new(Self::KIND);
        out.line("with-radius", &[self.with_radius]);
        out.quality(&self.quality);
        out.fit(&self.fit);
        out.noise(&self.noise);
        out.finish()
    }

    /// The model that was stored as text.
    ///
    /// # Errors
    /// [`StoredModelError`]: no stored model of this kind, one of another version, or a damaged
    /// one.
    pub fn from_text(text: &str) -> Result<Self, StoredModelError> {
        let mut stored = Reader::new(Self::KIND, text)?;
        let with_radius: bool = stored.one("with-radius")?;
        let model = Self {
            with_radius,
            quality: stored.quality(&["dx"])?,
            fit: stored.fit(1, 2 + usize::from(with_radius))?,
            noise: stored.noise()?,
        };
        stored.end()?;
        model.sound()
    }

    /// Passes the model on if it could have come out of a fit.
    fn sound(self) -> Result<Self, StoredModelError> {
        let fitted = self.fit.fits(1, 2 + usize::from(self.with_radius)) && self.noise.is_sound();
        if fitted && Quality::are_sound(&self.quality, &["dx"]) {
            return Ok(self);
        }
        Err(StoredModelError::Contents {
            what: "it has the wrong number of coefficients, or a number is out of range",
        })
    }
}

#[cfg(feature = "serde")]
mod stored {
    //! The model in serde's terms. What comes back is believed only after it has been checked.

    use super::{CentreModel, Fit, Noise, Quality, StoredModelError};
    use crate::regression::stored::{VERSION, known};

    #[derive(serde::Serialize, serde::Deserialize)]
    pub(super) struct CentreModelData {
        #[serde(default)]
        version: u32,
        with_radius: bool,
        fit: Fit,
        #[serde(default)]
        noise: Noise,
        quality: Vec<Quality>,
    }

    impl From<CentreModel> for CentreModelData {
        fn from(model: CentreModel) -> Self {
            Self {
                version: VERSION,
                with_radius: model.with_radius,
                fit: model.fit,
                noise: model.noise,
                quality: model.quality,
            }
        }
    }

    impl TryFrom<CentreModelData> for CentreModel {
        type Error = StoredModelError;

        fn try_from(data: CentreModelData) -> Result<Self, Self::Error> {
            known(data.version)?;
            let model = Self {
                with_radius: data.with_radius,
                fit: data.fit,
                noise: data.noise,
                quality: data.quality,
            };
            model.sound()
        }
    }
}
