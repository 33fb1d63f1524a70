//! The regression simulator of the approaching behaviour: what a move of `JT2` and `JT3` does to y
//! and r.

use hough_heuristic::Features;

use crate::cell::geometry::SightRule;
use crate::error::QuantityError;
use crate::regression::least_squares::{Entry, Fit, Rows};
use crate::regression::least_squares::{FitError, Quality};
use crate::regression::reach_form::ReachForm;
use crate::regression::reach_noise::{Noise, widening};
use crate::regression::samples;
use crate::regression::samples::ReachSample;
use crate::regression::stored::StoredModelError;
use crate::regression::stored::{Reader, Writer};

/// A regression simulator of the approaching behaviour, fitted to samples of real or simulated
/// moves.
///
/// ```
/// use pipeline_sim::{Ball, Cell, ReachForm, ReachModel, sample_moves};
/// use rand::SeedableRng;
///
/// let mut rng = rand::rngs::Xoshiro256PlusPlus::seed_from_u64(1);
/// let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
/// let (_, samples) = sample_moves(&cell, 500, 0.125, &mut rng);
/// let model = ReachModel::fit(&samples, ReachForm::Rigid22, &[])?;
/// assert!(model.quality().iter().all(|q| q.r2 > 0.99));
/// # Ok::<(), pipeline_sim::FitError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(into = "stored::ReachModelData", try_from = "stored::ReachModelData")
)]
pub struct ReachModel {
    pub(crate) form: ReachForm,
    edges: Vec<f64>,
    pub(crate) pieces: Vec<Fit>,
    /// Of each piece: how far observations of y and of r lie from predictions.
    pub(crate) noise: Vec<[Noise; 2]>,
    pub(crate) quality: Vec<Quality>,
}

impl ReachModel {
    /// The paper's elbow edges (its theta3 at 5 and 20 degrees) as `JT3`, degrees.
    pub const PAPER_ELBOW_EDGES: [f64; 2] = [175.0, 190.0];

    /// Fits a model of the given form, one set of coefficients for each interval between
    /// `elbow_edges_degrees` (`JT3` before the move); without edges, one for all.
    ///
    /// # Errors
    /// [`FitError`]: edges that do not ascend; a sample that is not finite; an interval with too
    /// few samples, or with samples that do not determine all coefficients.
    pub fn fit(
        samples: &[ReachSample],
        form: ReachForm,
        elbow_edges_degrees: &[f64],
    ) -> Result<Self, FitError> {
        let edges = elbow_edges_degrees.to_vec();
        if !edges.iter().all(|e| e.is_finite()) || !edges.windows(2).all(|w| w[0] < w[1]) {
            return Err(FitError::Edges { edges });
        }
        let mut model = Self {
            form,
            edges,
            pieces: Vec::new(),
            noise: Vec::new(),
            quality: Vec::new(),
        };
        for (i, group) in model.groups(samples)?.iter().enumerate() {
            let place = model.place(i);
            if group.len() < form.terms() {
                return Err(FitError::TooFewSamples {
                    place,
                    got: group.len(),
                    needed: form.terms(),
                });
            }
            let mut rows = Rows::default();
            for (index, sample) in group {
                push(form, &mut rows, *index, sample, 1.0)?;
            }
            model.pieces.push(rows.solve(&place, group.len())?);
            model.noise.push(Default::default());
            model.noise[i] = model.noise_of(i, group, |_| 1.0).0;
        }
        model.quality = model.judge(samples);
        Ok(model)
    }

    /// The samples by elbow interval, each with its position.
    pub(crate) fn groups<'a>(
        &self,
        samples: &'a [ReachSample],
    ) -> Result<Vec<Vec<(usize, &'a ReachSample)>>, FitError> {
        let mut groups = vec![Vec::new(); self.edges.len() + 1];
        for (index, sample) in samples.iter().enumerate() {
            samples::check(index, sample)?;
            groups[self.piece(sample.jt3_degrees)].push((index, sample));
        }
        Ok(groups)
    }

    /// How far the samples of piece `i` lie from what it predicts for them, and the degrees of
    /// freedom that are left.
    pub(crate) fn noise_of(
        &self,
        i: usize,
        group: &[(usize, &ReachSample)],
        weight: impl Fn(&ReachSample) -> f64,
    ) -> ([Noise; 2], f64) {
        let mut buffer = [0.0; 22];
        let (mut y, mut r, mut fitted) = (Vec::new(), Vec::new(), 0.0);
        for (_, s) in group {
            let terms = self
                .form
                .fill(&s.before, s.jt3_degrees, s.d2, s.d3, &mut buffer);
            fitted += weight(s) * self.pieces[i].leverage(terms);
            if let Some(after) = self.predict_unbounded(&s.before, s.jt3_degrees, s.d2, s.d3) {
                let [of_y, of_r] = self.form.shares(&s.before, &after, s.d2, s.d3);
                y.push((of_y, (s.after.y - after.y).powi(2)));
                r.push((of_r, (s.after.r - after.r).powi(2)));
            }
        }
        // What the coefficients have taken from the samples is missing in the residuals.
        let freedom = group.len() as f64 - fitted;
        let left = freedom.max(1.0) / group.len() as f64;
        ([Noise::of(&y, left), Noise::of(&r, left)], freedom)
    }

    /// The form the model was fitted in.
    pub fn form(&self) -> ReachForm {
        self.form
    }

    /// Edges of the elbow intervals, degrees of `JT3`.
    pub fn elbow_edges(&self) -> &[f64] {
        &self.edges
    }

    /// What the image shows after `JT2` and `JT3` turned by `d2` and `d3` degrees; x stays. `None`
    /// if the ball is lost ([`SightRule::sees_features`]) or an argument is not finite.
    pub fn predict(
        &self,
        before: &Features,
        jt3_degrees: f64,
        d2: f64,
        d3: f64,
    ) -> Option<Features> {
        self.predict_unbounded(before, jt3_degrees, d2, d3)
            .filter(|features| SightRule::default().sees_features(features))
    }

    /// As [`ReachModel::predict`], but also where the ball would count as lost. `None` only where
    /// the model places the ball behind the camera, an argument is not finite, or `before` shows a
    /// radius that is not above zero.
    pub fn predict_unbounded(
        &self,
        before: &Features,
        jt3_degrees: f64,
        d2: f64,
        d3: f64,
    ) -> Option<Features> {
        (before.r > 0.0)
            .then(|| self.predict_onward(before, jt3_degrees, d2, d3))
            .flatten()
    }

    /// As [`ReachModel::predict_unbounded`], also from a prediction of `Linear` whose radius is not
    /// above zero.
    pub(crate) fn predict_onward(
        &self,
        before: &Features,
        jt3_degrees: f64,
        d2: f64,
        d3: f64,
    ) -> Option<Features> {
        let arguments = [before.x, before.y, before.r, jt3_degrees, d2, d3];
        if !arguments.iter().all(|v| v.is_finite()) {
            return None;
        }
        let mut buffer = [0.0; 22];
        let terms = self.form.fill(before, jt3_degrees, d2, d3, &mut buffer);
        let fit = &self.pieces[self.piece(jt3_degrees)];
        let from = self.form.outputs(before);
        let (y, r) = self
            .form
            .image([from[0] + fit.value(0, terms), from[1] + fit.value(1, terms)])?;
        (y.is_finite() && r.is_finite()).then_some(Features { x: before.x, y, r })
    }

    /// The standard deviations of y and r, feature units, that the fit expects of
    /// [`ReachModel::predict_unbounded`] around what a new observation would show: noise of both
    /// observations, what the form cannot express, and the uncertainty of the coefficients
    /// together, widened for models of few samples so that 95 % lie within 1.96 of them. `None` as
    /// there, and where they are no finite numbers.
    ///
    /// Noise of `before` is carried along: what comes four times as near shows it four times (in y)
    /// and sixteen times (in r) as large.
    pub fn uncertainty(
        &self,
        before: &Features,
        jt3_degrees: f64,
        d2: f64,
        d3: f64,
    ) -> Option<(f64, f64)> {
        let after = self.predict_unbounded(before, jt3_degrees, d2, d3)?;
        let mut buffer = [0.0; 22];
        let terms = self.form.fill(before, jt3_degrees, d2, d3, &mut buffer);
        let piece = self.piece(jt3_degrees);
        let fit = &self.pieces[piece];
        let wider = widening(fit.samples);
        let [y, r] = self
            .variances(piece, before, &after, (d2, d3), fit.leverage(terms))
            .map(|variance| wider * variance.sqrt());
        (y.is_finite() && r.is_finite()).then_some((y, r))
    }

    /// Variances of y and r around a prediction `after` of piece `i`.
    pub(crate) fn variances(
        &self,
        i: usize,
        before: &Features,
        after: &Features,
        (d2, d3): (f64, f64),
        leverage: f64,
    ) -> [f64; 2] {
        let [of_y, of_r] = self.form.shares(before, after, d2, d3);
        let [noise_y, noise_r] = &self.noise[i];
        let [first, second] = [0, 1].map(|k| leverage * self.pieces[i].residual[k].powi(2));
        let (from_y, from_r) = match self.form {
            ReachForm::Linear => (first, second),
            // r = 33 / Z and y = 72 + r V: first order in the errors of Z and V.
            _ => {
                let r_of_z = after.r * after.r / 33.0;
                let v = (after.y - 72.0) / after.r;
                (
                    after.r.powi(2) * second + (v * r_of_z).powi(2) * first,
                    r_of_z.powi(2) * first,
                )
            }
        };
        [
            noise_y.variance(of_y) + from_y,
            noise_r.variance(of_r) + from_r,
        ]
    }

    /// What the fit leaves of the changes of y and r on its samples, a pair for each elbow
    /// interval: standard deviations in feature units, with the degrees of freedom that are left;
    /// of a refit, together with those of its prior.
    pub fn residual_noise(&self) -> Vec<(f64, f64)> {
        self.noise
            .iter()
            .map(|[y, r]| (y.residual, r.residual))
            .collect()
    }

    /// How well the changes of y and r are reproduced on the samples the model was fitted to.
    pub fn quality(&self) -> Vec<Quality> {
        self.quality.clone()
    }

    /// How well the changes of y and r are reproduced on other samples. A sample for which the
    /// model has no prediction counts as one for which it predicts no change, and in
    /// [`Quality::unpredicted`].
    ///
    /// # Errors
    /// [`QuantityError`]: no samples, or one that holds a NaN, an infinity, or a radius that is not
    /// above zero.
    pub fn quality_on(&self, samples: &[ReachSample]) -> Result<Vec<Quality>, QuantityError> {
        Quality::some(samples.len())?;
        for (index, sample) in samples.iter().enumerate() {
            samples::check(index, sample).map_err(FitError::into_quantity)?;
        }
        Ok(self.judge(samples))
    }

    pub(crate) fn judge(&self, samples: &[ReachSample]) -> Vec<Quality> {
        let predicted = samples.iter().map(|s| {
            let after = self.predict_unbounded(&s.before, s.jt3_degrees, s.d2, s.d3);
            (s, after)
        });
        let (y, r): (Vec<_>, Vec<_>) = predicted
            .map(|(s, after)| {
                (
                    (s.after.y - s.before.y, after.map(|a| a.y - s.before.y)),
                    (s.after.r - s.before.r, after.map(|a| a.r - s.before.r)),
                )
            })
            .unzip();
        vec![Quality::of("dy", &y), Quality::of("dr", &r)]
    }

    /// Condition number of each elbow interval's design matrix, columns scaled to unit length.
    pub fn condition_numbers(&self) -> Vec<f64> {
        self.pieces.iter().map(|fit| fit.condition).collect()
    }

    fn piece(&self, jt3_degrees: f64) -> usize {
        self.edges
            .iter()
            .filter(|edge| jt3_degrees >= **edge)
            .count()
    }

    pub(crate) fn place(&self, piece: usize) -> String {
        let edge = |i: usize| {
            self.edges
                .get(i)
                .map_or_else(|| "open".to_owned(), ToString::to_string)
        };
        match (piece, self.edges.len()) {
            (_, 0) => "all elbow angles".to_owned(),
            (0, _) => format!("JT3 below {}", edge(0)),
            (i, n) if i == n => format!("JT3 from {}", edge(n - 1)),
            (i, _) => format!("JT3 {}..{}", edge(i - 1), edge(i)),
        }
    }
}

/// One more sample in the rows of its piece.
pub(crate) fn push(
    form: ReachForm,
    rows: &mut Rows,
    index: usize,
    sample: &ReachSample,
    weight: f64,
) -> Result<(), FitError> {
    let mut buffer = [0.0; 22];
    let (from, to) = (form.outputs(&sample.before), form.outputs(&sample.after));
    let terms = form.fill(
        &sample.before,
        sample.jt3_degrees,
        sample.d2,
        sample.d3,
        &mut buffer,
    );
    rows.push(terms, &[to[0] - from[0], to[1] - from[1]], weight)
        .map_err(|(entry, value)| FitError::NotFinite {
            index,
            quantity: match entry {
                Entry::Term(i) => form.term_names()[i],
                Entry::Target(i) => form.output_names()[i],
            },
            value,
        })
}

impl ReachModel {
    const KIND: &str = "reach-model";

    /// The model as text, which [`ReachModel::from_text`] turns into the same model again.
    ///
    /// ```
    /// # use pipeline_sim::{Ball, Cell, ReachForm, ReachModel, sample_moves};
    /// # use rand::SeedableRng;
    /// # let mut rng = rand::rngs::Xoshiro256PlusPlus::seed_from_u64(1);
    /// # let (_, samples) = sample_moves(&Cell::paper(Ball::at(0.6, 0.0, -0.1)), 100, 0.125, &mut rng);
    /// # let path = std::env::temp_dir().join(format!("pipeline-sim-{}.txt", std::process::id()));
    /// let model = ReachModel::fit(&samples, ReachForm::Rigid8, &[])?;
    /// std::fs::write(&path, model.to_text())?;
    /// assert_eq!(ReachModel::from_text(&std::fs::read_to_string(&path)?)?, model);
    /// # std::fs::remove_file(&path)?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn to_text(&self) -> String {
        let mut out = Writer::new(Self::KIND);
        out.line("form", &[self.form]);
        out.line("elbow-edges", &self.edges);
        out.quality(&self.quality);
        for (fit, noise) in self.pieces.iter().zip(&self.noise) {
            out.fit(fit);
            noise.iter().for_each(|noise| out.noise(noise));
        }
        out.finish()
    }

    /// The model that was stored as text.
    ///
    /// # Errors
    /// [`StoredModelError`]: no stored model of this kind, one of another version, or a damaged
    /// one.
    pub fn from_text(text: &str) -> Result<Self, StoredModelError> {
        let mut stored = Reader::new(Self::KIND, text)?;
        let form = stored.form()?;
        let edges: Vec<f64> = stored.line("elbow-edges", None)?;
        let quality = stored.quality(&["dy", "dr"])?;
        let (mut pieces, mut noise) = (Vec::new(), Vec::new());
        for _ in 0..=edges.len() {
            pieces.push(stored.fit(2, form.terms())?);
            noise.push([stored.noise()?, stored.noise()?]);
        }
        stored.end()?;
        let model = Self {
            form,
            edges,
            pieces,
            noise,
            quality,
        };
        model.sound()
    }

    /// Passes the model on if it could have come out of a fit.
    fn sound(self) -> Result<Self, StoredModelError> {
        let damaged = |what| Err(StoredModelError::Contents { what });
        let edges = &self.edges;
        if !(edges.iter().all(|e| e.is_finite()) && edges.windows(2).all(|w| w[0] < w[1])) {
            return damaged("the elbow edges do not ascend");
        }
        let terms = self.form.terms();
        if self.pieces.len() != edges.len() + 1 || !self.pieces.iter().all(|p| p.fits(2, terms)) {
            return damaged(
                "it has the wrong number of coefficients, or a number of its fit is out of range",
            );
        }
        if self.noise.len() != self.pieces.len()
            || !self.noise.iter().flatten().all(Noise::is_sound)
        {
            return damaged("its noise is not a finite number of zero or above for each piece");
        }
        if !Quality::are_sound(&self.quality, &["dy", "dr"]) {
            return damaged("its accuracy is out of range");
        }
        Ok(self)
    }
}

#[cfg(feature = "serde")]
mod stored {
    //! The model in serde's terms. What comes back is believed only after it has been checked.

    use super::{Fit, Noise, Quality, ReachForm, ReachModel, StoredModelError};
    use crate::regression::stored::{VERSION, known};

    #[derive(serde::Serialize, serde::Deserialize)]
    pub(super) struct ReachModelData {
        #[serde(default)]
        version: u32,
        form: ReachForm,
        edges: Vec<f64>,
        pieces: Vec<Fit>,
        noise: Vec<[Noise; 2]>,
        quality: Vec<Quality>,
    }

    impl From<ReachModel> for ReachModelData {
        fn from(model: ReachModel) -> Self {
            Self {
                version: VERSION,
                form: model.form,
                edges: model.edges,
                pieces: model.pieces,
                noise: model.noise,
                quality: model.quality,
            }
        }
    }

    impl TryFrom<ReachModelData> for ReachModel {
        type Error = StoredModelError;

        fn try_from(data: ReachModelData) -> Result<Self, Self::Error> {
            known(data.version)?;
            let model = Self {
                form: data.form,
                edges: data.edges,
                pieces: data.pieces,
                noise: data.noise,
                quality: data.quality,
            };
            model.sound()
        }
    }
}
