//! The regression simulator of the approaching behaviour: what a move of `JT2` and `JT3` does to y and r.

use hough_heuristic::Features;

use crate::least_squares::{Fit, Rows};
use crate::{FitError, Quality, ReachSample, SightRule};

/// Which terms a [`ReachModel`] is made of.
///
/// With d2, d3 the moves in degrees, a = d2 / 20, b = d3 / 16, Z = 33 / r, V = (y - 72) / r, E = (`JT3` - 140) / 40 before the move. In
/// the arm's plane (Z, V) is, up to a scale, the ball's place as the camera sees it, and a move of the arm turns and
/// shifts it rigidly; that is why the `Rigid` forms, which fit the changes of Z and V, need far fewer terms than the image's own
/// coordinates would.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum ReachForm {
    /// Changes of y and r on 1, d2, d3: the paper's own reading of linear regression, per elbow interval.
    Linear,
    /// Changes of Z and V on 1, a, b, Za, Zb, Va, Vb, Ea.
    Rigid8,
    /// Changes of Z and V on 1, and a, b, a², ab, b² each times 1, Z, V, E, and E²a.
    Rigid22,
    /// Changes of Z and V on the twelve products that a rigid motion of a two-joint arm consists of: with c, s cosine and sine
    /// of d3 (index 3) and d2 + d3 (index 23), and e = `JT3`: (c23 - 1) and s23 times Z and V; (c3 - c23) and (s3 - s23) times 1, cos e,
    /// sin e; 1 - c3; s3. No further terms exist: what is left is the outline's slight ellipticity.
    RigidBody,
}

impl ReachForm {
    /// Number of terms.
    pub fn terms(self) -> usize {
        match self {
            Self::Linear => 3,
            Self::Rigid8 => 8,
            Self::Rigid22 => 22,
            Self::RigidBody => 12,
        }
    }

    /// Writes the terms and returns them as a slice of `buffer`.
    fn fill<'a>(
        self,
        before: &Features,
        jt3_degrees: f64,
        d2: f64,
        d3: f64,
        buffer: &'a mut [f64; 22],
    ) -> &'a [f64] {
        let (a, b) = (d2 / 20.0, d3 / 16.0);
        let (z, v, e) = (
            33.0 / before.r,
            (before.y - 72.0) / before.r,
            (jt3_degrees - 140.0) / 40.0,
        );
        match self {
            Self::Linear => buffer[..3].copy_from_slice(&[1.0, d2, d3]),
            Self::Rigid8 => buffer[..8].copy_from_slice(&[1.0, a, b, z * a, z * b, v * a, v * b, e * a]),
            Self::Rigid22 => {
                buffer[0] = 1.0;
                for (i, moved) in [a, b, a * a, a * b, b * b].into_iter().enumerate() {
                    for (j, place) in [1.0, z, v, e].into_iter().enumerate() {
                        buffer[1 + 4 * i + j] = moved * place;
                    }
                }
                buffer[21] = e * e * a;
            }
            Self::RigidBody => {
                let ((s3, c3), (s23, c23)) = (d3.to_radians().sin_cos(), (d2 + d3).to_radians().sin_cos());
                let (sin_e, cos_e) = jt3_degrees.to_radians().sin_cos();
                let (c, s) = (c3 - c23, s3 - s23);
                let turned = c23 - 1.0;
                buffer[..12].copy_from_slice(&[
                    turned * z,
                    turned * v,
                    s23 * z,
                    s23 * v,
                    c,
                    c * cos_e,
                    c * sin_e,
                    s,
                    s * cos_e,
                    s * sin_e,
                    1.0 - c3,
                    s3,
                ]);
            }
        }
        &buffer[..self.terms()]
    }

    /// The two quantities that are fitted, from image features: (y, r), or (Z, V).
    fn outputs(self, features: &Features) -> [f64; 2] {
        match self {
            Self::Linear => [features.y, features.r],
            _ => [33.0 / features.r, (features.y - 72.0) / features.r],
        }
    }

    /// (y, r) from the fitted quantities; `None` where they belong to no ball in front of the camera.
    fn image(self, outputs: [f64; 2]) -> Option<(f64, f64)> {
        match self {
            Self::Linear => Some((outputs[0], outputs[1])),
            _ => (outputs[0] > 0.0).then(|| (72.0 + 33.0 * outputs[1] / outputs[0], 33.0 / outputs[0])),
        }
    }
}

/// A regression simulator of the approaching behaviour, fitted to samples of real or simulated moves.
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
#[cfg_attr(feature = "serde", serde(try_from = "stored::ReachModelData"))]
pub struct ReachModel {
    form: ReachForm,
    edges: Vec<f64>,
    pieces: Vec<Fit>,
    quality: Vec<Quality>,
}

impl ReachModel {
    /// The paper's elbow edges (its theta3 at 5 and 20 degrees) as `JT3`, degrees.
    pub const PAPER_ELBOW_EDGES: [f64; 2] = [175.0, 190.0];

    /// Fits a model of the given form, one set of coefficients for each interval between `elbow_edges_degrees` (`JT3` before the
    /// move); without edges, one for all.
    ///
    /// # Errors
    /// [`FitError`]: edges that do not ascend; a sample that is not finite; an interval with too few samples, or with samples that do not
    /// determine all coefficients.
    pub fn fit(
        samples: &[ReachSample],
        form: ReachForm,
        elbow_edges_degrees: &[f64],
    ) -> Result<Self, FitError> {
        let edges = elbow_edges_degrees.to_vec();
        if !edges.iter().all(|e| e.is_finite()) || !edges.windows(2).all(|w| w[0] < w[1]) {
            return Err(FitError::Edges { edges });
        }
        let (pieces, quality) = (Vec::new(), Vec::new());
        let mut model = Self {
            form,
            edges,
            pieces,
            quality,
        };
        let mut rows = vec![Rows::default(); model.edges.len() + 1];
        let mut counts = vec![0; rows.len()];
        let mut buffer = [0.0; 22];
        for (index, sample) in samples.iter().enumerate() {
            check(index, sample)?;
            let piece = model.piece(sample.jt3_degrees);
            let (from, to) = (form.outputs(&sample.before), form.outputs(&sample.after));
            let terms = form.fill(
                &sample.before,
                sample.jt3_degrees,
                sample.d2,
                sample.d3,
                &mut buffer,
            );
            rows[piece].push(terms, &[to[0] - from[0], to[1] - from[1]], 1.0);
            counts[piece] += 1;
        }
        for (i, rows) in rows.iter().enumerate() {
            let place = model.place(i);
            if counts[i] < form.terms() {
                return Err(FitError::TooFewSamples {
                    place,
                    got: counts[i],
                    needed: form.terms(),
                });
            }
            model.pieces.push(rows.solve(&place, counts[i])?);
        }
        model.quality = model.quality_on(samples);
        Ok(model)
    }

    /// The model fitted anew to samples of another plant, held toward this one: what N real moves teach about an arm that is not
    /// the one the model was made for.
    ///
    /// For each elbow interval and output the coefficients c minimise the mean of w (change - terms · c)² plus `ridge` · |c - c0|², with
    /// c0 this model's coefficients and w = r before to the power `radius_power`, normalised to mean 1 (the fitted quantities of the
    /// `Rigid` forms are the noisier the smaller the ball; 2 to 4 is right for them, 0 for `Linear`). An interval without samples stays as it is.
    ///
    /// # Errors
    /// [`FitError::Prior`] for a `ridge` or power that is not a finite number of zero or above; otherwise as for [`ReachModel::fit`] (with
    /// a ridge above zero neither too few samples nor a lack of rank is an error).
    pub fn refit(&self, samples: &[ReachSample], ridge: f64, radius_power: f64) -> Result<Self, FitError> {
        if !(ridge.is_finite() && ridge >= 0.0 && radius_power.is_finite()) {
            let what = format!(
                "a refit needs a finite ridge of zero or above and a finite power, not {ridge} and {radius_power}"
            );
            return Err(FitError::Prior { what });
        }
        let mut groups = vec![Vec::new(); self.pieces.len()];
        for (index, sample) in samples.iter().enumerate() {
            check(index, sample)?;
            groups[self.piece(sample.jt3_degrees)].push(sample);
        }
        let mut model = self.clone();
        let mut buffer = [0.0; 22];
        for (i, group) in groups.iter().enumerate().filter(|(_, group)| !group.is_empty()) {
            let count = group.len();
            if ridge == 0.0 && count < self.form.terms() {
                return Err(FitError::TooFewSamples {
                    place: self.place(i),
                    got: count,
                    needed: self.form.terms(),
                });
            }
            let weigh = |sample: &ReachSample| sample.before.r.powf(radius_power);
            let mean = group.iter().map(|s| weigh(s)).sum::<f64>() / count as f64;
            let mut rows = Rows::default();
            for sample in group {
                let (from, to) = (
                    self.form.outputs(&sample.before),
                    self.form.outputs(&sample.after),
                );
                let terms = self.form.fill(
                    &sample.before,
                    sample.jt3_degrees,
                    sample.d2,
                    sample.d3,
                    &mut buffer,
                );
                rows.push(
                    terms,
                    &[to[0] - from[0], to[1] - from[1]],
                    (weigh(sample) / mean).sqrt(),
                );
            }
            if ridge > 0.0 {
                let pull = (ridge * count as f64).sqrt();
                let mut unit = vec![0.0; self.form.terms()];
                for (k, (c0, c1)) in self.pieces[i].coefficients[0]
                    .iter()
                    .zip(&self.pieces[i].coefficients[1])
                    .enumerate()
                {
                    unit[k] = 1.0;
                    rows.push(&unit, &[*c0, *c1], pull);
                    unit[k] = 0.0;
                }
            }
            model.pieces[i] = rows.solve(&self.place(i), count)?;
        }
        model.quality = model.quality_on(samples);
        Ok(model)
    }

    /// The form the model was fitted in.
    pub fn form(&self) -> ReachForm {
        self.form
    }

    /// Edges of the elbow intervals, degrees of `JT3`.
    pub fn elbow_edges(&self) -> &[f64] {
        &self.edges
    }

    /// What the image shows after `JT2` and `JT3` turned by `d2` and `d3` degrees; x stays. `None` if the ball is lost
    /// ([`SightRule::sees_features`]) or an argument is not finite.
    pub fn predict(&self, before: &Features, jt3_degrees: f64, d2: f64, d3: f64) -> Option<Features> {
        self.predict_unbounded(before, jt3_degrees, d2, d3)
            .filter(|features| SightRule::default().sees_features(features))
    }

    /// As [`ReachModel::predict`], but also where the ball would count as lost. `None` only where the model places the ball behind
    /// the camera, or an argument is not finite.
    pub fn predict_unbounded(
        &self,
        before: &Features,
        jt3_degrees: f64,
        d2: f64,
        d3: f64,
    ) -> Option<Features> {
        let mut buffer = [0.0; 22];
        let terms = self.form.fill(before, jt3_degrees, d2, d3, &mut buffer);
        let fit = &self.pieces[self.piece(jt3_degrees)];
        let from = self.form.outputs(before);
        let (y, r) = self
            .form
            .image([from[0] + fit.value(0, terms), from[1] + fit.value(1, terms)])?;
        (y.is_finite() && r.is_finite() && before.x.is_finite()).then_some(Features { x: before.x, y, r })
    }

    /// The standard deviations of y and r, feature units, that the fit expects of [`ReachModel::predict_unbounded`] around what a
    /// new observation would show: residual noise and the uncertainty of the coefficients together. `None` as there.
    pub fn uncertainty(&self, before: &Features, jt3_degrees: f64, d2: f64, d3: f64) -> Option<(f64, f64)> {
        let after = self.predict_unbounded(before, jt3_degrees, d2, d3)?;
        let mut buffer = [0.0; 22];
        let terms = self.form.fill(before, jt3_degrees, d2, d3, &mut buffer);
        let fit = &self.pieces[self.piece(jt3_degrees)];
        let widened = (1.0 + fit.leverage(terms)).sqrt();
        let (first, second) = (fit.residual[0] * widened, fit.residual[1] * widened);
        Some(match self.form {
            ReachForm::Linear => (first, second),
            // r = 33 / Z and y = 72 + r V: first order in the errors of Z and V.
            _ => {
                let r_of_z = after.r * after.r / 33.0;
                (
                    (after.r * second).hypot((after.y - 72.0) / after.r * r_of_z * first),
                    r_of_z * first,
                )
            }
        })
    }

    /// How well the changes of y and r are reproduced on the samples the model was fitted to.
    pub fn quality(&self) -> Vec<Quality> {
        self.quality.clone()
    }

    /// How well the changes of y and r are reproduced on other samples.
    pub fn quality_on(&self, samples: &[ReachSample]) -> Vec<Quality> {
        let (mut y, mut r) = (
            Vec::with_capacity(samples.len()),
            Vec::with_capacity(samples.len()),
        );
        for s in samples {
            if let Some(after) = self.predict_unbounded(&s.before, s.jt3_degrees, s.d2, s.d3) {
                y.push((s.after.y - s.before.y, after.y - s.before.y));
                r.push((s.after.r - s.before.r, after.r - s.before.r));
            }
        }
        vec![Quality::of("dy", &y), Quality::of("dr", &r)]
    }

    /// Condition number of each elbow interval's design matrix, columns scaled to unit length.
    pub fn condition_numbers(&self) -> Vec<f64> {
        self.pieces.iter().map(|fit| fit.condition).collect()
    }

    fn piece(&self, jt3_degrees: f64) -> usize {
        self.edges.iter().filter(|edge| jt3_degrees >= **edge).count()
    }

    fn place(&self, piece: usize) -> String {
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

/// Refuses samples that cannot be fitted to.
fn check(index: usize, sample: &ReachSample) -> Result<(), FitError> {
    let numbers = [
        ("y before", sample.before.y),
        ("r before", sample.before.r),
        ("JT3", sample.jt3_degrees),
        ("d2", sample.d2),
        ("d3", sample.d3),
        ("y after", sample.after.y),
        ("r after", sample.after.r),
    ];
    for (quantity, value) in numbers {
        let usable = value.is_finite() && (!quantity.starts_with('r') || value > 0.0);
        if !usable {
            return Err(FitError::NotFinite {
                index,
                quantity,
                value,
            });
        }
    }
    Ok(())
}

#[cfg(feature = "serde")]
mod stored {
    //! A stored model is believed only after its shape has been checked.

    use super::{Fit, Quality, ReachForm, ReachModel};

    #[derive(serde::Deserialize)]
    pub(super) struct ReachModelData {
        form: ReachForm,
        edges: Vec<f64>,
        pieces: Vec<Fit>,
        quality: Vec<Quality>,
    }

    impl TryFrom<ReachModelData> for ReachModel {
        type Error = &'static str;

        fn try_from(data: ReachModelData) -> Result<Self, Self::Error> {
            let ReachModelData {
                form,
                edges,
                pieces,
                quality,
            } = data;
            let ascending = edges.iter().all(|e| e.is_finite()) && edges.windows(2).all(|w| w[0] < w[1]);
            if !ascending {
                return Err("the elbow edges of the stored model do not ascend");
            }
            if pieces.len() != edges.len() + 1 || !pieces.iter().all(|p| p.fits(2, form.terms())) {
                return Err("the stored model has the wrong number of coefficients, or some are not finite");
            }
            Ok(Self {
                form,
                edges,
                pieces,
                quality,
            })
        }
    }
}
