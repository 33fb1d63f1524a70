//! The regression simulator of the approaching behaviour: the changes of y and r by a move of
//! `JT2` and `JT3`.

use hough_heuristic::Features;

use crate::cell::sight::SightRule;
use crate::error::{FitError, QuantityError, check_ridge};
use crate::regression::least_squares::{Entry, Fit, Rows};
use crate::regression::quality::{Quality, VERSION, check_version};
use crate::regression::reach_form::ReachForm;
use crate::regression::samples::{ReachSample, check};

/// A regression simulator of the approaching behaviour, fitted to samples of real or simulated
/// moves.
///
/// With the feature `serde` a model can be stored; it is checked when it is read.
///
/// ```
/// use pipeline_sim::{Ball, Cell, ReachForm, ReachModel};
/// use pipeline_sim::rand::{SeedableRng, rngs::Xoshiro256PlusPlus};
///
/// fn main() -> Result<(), Box<dyn std::error::Error>> {
///     let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
///     let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
///     let (_, samples) = cell.sample_moves(500, 0.125, &mut rng)?;
///     let model = ReachModel::fit(&samples, ReachForm::Rigid22, &[])?;
///     assert!(model.quality().iter().all(|q| q.r2 > 0.99));
///     Ok(())
/// }
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "Parts")
)]
pub struct ReachModel(Parts);

#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Parts {
    #[cfg_attr(feature = "serde", serde(default))]
    version: u32,
    form: ReachForm,
    edges: Vec<f64>,
    pieces: Vec<Fit>,
    quality: Vec<Quality>,
}

impl TryFrom<Parts> for ReachModel {
    type Error = String;

    fn try_from(parts: Parts) -> Result<Self, String> {
        check_version(parts.version)?;
        let (pieces, terms) = (&parts.pieces, parts.form.terms());
        let wrong = if !ascend(&parts.edges) {
            "the elbow edges do not ascend"
        } else if pieces.len() != parts.edges.len() + 1
            || !pieces.iter().all(|fit| fit.is_sound(2, terms))
        {
            "it has the wrong number of coefficients, or a number of its fit is out of range"
        } else if !Quality::are_sound(&parts.quality, &["dy", "dr"]) {
            "its accuracy is out of range"
        } else {
            return Ok(Self(parts));
        };
        Err(format!("the stored model is damaged: {wrong}"))
    }
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
        if !ascend(&edges) {
            return Err(FitError::Edges { edges });
        }
        let mut model = Self(Parts {
            version: VERSION,
            form,
            edges,
            pieces: Vec::new(),
            quality: Vec::new(),
        });
        for (i, group) in model.groups(samples)?.iter().enumerate() {
            model.enough(i, group.len())?;
            let mut rows = Rows::default();
            for (index, sample) in group {
                push(form, &mut rows, *index, sample, 1.0)?;
            }
            let fit = rows.solve(&model.place(i), group.len())?;
            model.0.pieces.push(fit);
        }
        model.0.quality = model.judge(samples);
        Ok(model)
    }

    /// Fits the model to samples of another plant by ridge regression toward this model.
    ///
    /// For each elbow interval and output the coefficients c minimise the mean of w (change - terms
    /// · c)² plus `ridge` · |c - c0|², with c0 this model's coefficients and w = r before to the
    /// power `radius_power`, normalised to mean 1. The fitted quantities of the `Rigid` forms are
    /// noisier for a smaller ball: 2 to 4 is right for them, 0 for `Linear`. Intervals without
    /// samples stay unchanged.
    ///
    /// # Errors
    /// [`FitError::Prior`] for a `ridge` out of 0..=1e100 and for a power that is not finite;
    /// otherwise those of [`ReachModel::fit`]. With a ridge of 1e-12 or above any number of samples
    /// is enough.
    pub fn refit(
        &self,
        samples: &[ReachSample],
        ridge: f64,
        radius_power: f64,
    ) -> Result<Self, FitError> {
        check_ridge(ridge)?;
        if !radius_power.is_finite() {
            let what = format!("the power of the radius must be finite, but is {radius_power}");
            return Err(FitError::Prior { what });
        }
        let (mut model, form) = (self.clone(), self.0.form);
        for (i, group) in self.groups(samples)?.iter().enumerate() {
            let count = group.len();
            if count == 0 {
                continue;
            }
            if ridge == 0.0 {
                self.enough(i, count)?;
            }
            // Logarithms relative to the greatest keep any power in range.
            let log_weight = |sample: &ReachSample| radius_power * sample.before.r.ln();
            let greatest = group
                .iter()
                .map(|(_, s)| log_weight(s))
                .fold(f64::NEG_INFINITY, f64::max);
            let relative = |sample: &ReachSample| (log_weight(sample) - greatest).exp();
            let mean = group.iter().map(|(_, s)| relative(s)).sum::<f64>() / count as f64;
            let mut rows = Rows::default();
            for (index, sample) in group {
                let weight = (relative(sample) / mean).sqrt();
                push(form, &mut rows, *index, sample, weight)?;
            }
            if ridge > 0.0 {
                rows.pull(&self.0.pieces[i], &[], ridge, count)?;
            }
            model.0.pieces[i] = rows.solve(&self.place(i), count)?;
        }
        if !samples.is_empty() {
            model.0.quality = model.judge(samples);
        }
        Ok(model)
    }

    /// Sorts the samples by elbow interval, each with its position.
    fn groups<'a>(
        &self,
        samples: &'a [ReachSample],
    ) -> Result<Vec<Vec<(usize, &'a ReachSample)>>, FitError> {
        let mut groups = vec![Vec::new(); self.0.edges.len() + 1];
        for (index, sample) in samples.iter().enumerate() {
            check(index, sample)?;
            groups[self.piece(sample.jt3_degrees)].push((index, sample));
        }
        Ok(groups)
    }

    fn enough(&self, piece: usize, got: usize) -> Result<(), FitError> {
        let needed = self.0.form.terms();
        if got < needed {
            return Err(FitError::TooFewSamples {
                place: self.place(piece),
                got,
                needed,
            });
        }
        Ok(())
    }

    /// Predicts the features after `JT2` and `JT3` turned by `d2` and `d3` degrees; x stays. `None`
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

    /// Predicts like [`ReachModel::predict`], also where the ball would count as lost. `None` only
    /// where the model places the ball behind the camera, an argument is not finite, or `before`
    /// has a radius that is not above zero.
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

    /// Predicts like [`ReachModel::predict_unbounded`], also from a prediction of `Linear` whose
    /// radius is not above zero.
    pub(super) fn predict_onward(
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
        let (mut buffer, form) = ([0.0; 22], self.0.form);
        let terms = form.fill(before, jt3_degrees, d2, d3, &mut buffer);
        let fit = &self.0.pieces[self.piece(jt3_degrees)];
        let from = form.outputs(before);
        let (y, r) = form.image([from[0] + fit.value(0, terms), from[1] + fit.value(1, terms)])?;
        (y.is_finite() && r.is_finite()).then_some(Features { x: before.x, y, r })
    }

    /// Accuracy of the changes of y and r on the samples the model was fitted to.
    pub fn quality(&self) -> &[Quality] {
        &self.0.quality
    }

    /// Judges the model on other samples. A sample for which the model has no prediction counts as
    /// one for which it predicts no change, and in [`Quality::unpredicted`].
    ///
    /// # Errors
    /// [`QuantityError`]: no samples, or one that holds a NaN, an infinity, or a radius that is not
    /// above zero.
    pub fn quality_on(&self, samples: &[ReachSample]) -> Result<Vec<Quality>, QuantityError> {
        Quality::some(samples.len())?;
        for (index, sample) in samples.iter().enumerate() {
            check(index, sample).map_err(FitError::into_quantity)?;
        }
        Ok(self.judge(samples))
    }

    fn judge(&self, samples: &[ReachSample]) -> Vec<Quality> {
        let (y, r): (Vec<_>, Vec<_>) = samples
            .iter()
            .map(|s| {
                let after = self.predict_unbounded(&s.before, s.jt3_degrees, s.d2, s.d3);
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
        self.0.pieces.iter().map(|fit| fit.condition).collect()
    }

    fn piece(&self, jt3_degrees: f64) -> usize {
        let edges = self.0.edges.iter();
        edges.filter(|edge| jt3_degrees >= **edge).count()
    }

    fn place(&self, piece: usize) -> String {
        match (piece, &self.0.edges[..]) {
            (_, []) => "all elbow angles".to_owned(),
            (0, [first, ..]) => format!("JT3 below {first}"),
            (i, edges) if i == edges.len() => format!("JT3 from {}", edges[i - 1]),
            (i, edges) => format!("JT3 {}..{}", edges[i - 1], edges[i]),
        }
    }
}

/// Returns `true` if all edges are finite and each is above the one before.
fn ascend(edges: &[f64]) -> bool {
    edges.iter().all(|e| e.is_finite()) && edges.windows(2).all(|w| w[0] < w[1])
}

/// Adds a sample to the rows of its piece.
fn push(
    form: ReachForm,
    rows: &mut Rows,
    index: usize,
    sample: &ReachSample,
    weight: f64,
) -> Result<(), FitError> {
    let mut buffer = [0.0; 22];
    let (from, to) = (form.outputs(&sample.before), form.outputs(&sample.after));
    let (jt3, d2, d3) = (sample.jt3_degrees, sample.d2, sample.d3);
    let terms = form.fill(&sample.before, jt3, d2, d3, &mut buffer);
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
