//! The regression simulators: the change of the image by a move.

use hough_heuristic::Features;

use crate::cell::sight::SightRule;
use crate::error::{QuantityError, amount, at_most, finite, positive};
use crate::regression::form::{MOST_TERMS, MoveForm};
use crate::regression::least_squares::{Fit, Rows, too_few};
use crate::regression::quality::Quality;
use crate::regression::samples::MoveSample;

/// A regression simulator of one behaviour, fitted to samples of real or simulated moves.
///
/// With the feature `serde` a model can be stored; it is checked when it is read.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "Parts")
)]
pub struct MoveModel(Parts);

#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default)
)]
struct Parts {
    version: u32,
    form: MoveForm,
    edges: Vec<f64>,
    pieces: Vec<Fit>,
    quality: Vec<Quality>,
}

/// Version of the stored form.
const VERSION: u32 = 3;

impl TryFrom<Parts> for MoveModel {
    type Error = String;

    fn try_from(parts: Parts) -> Result<Self, String> {
        let (version, terms) = (parts.version, parts.form.terms());
        if version != VERSION {
            let (age, remedy) = if version < VERSION {
                ("an earlier", "fit it again")
            } else {
                ("a later", "read it with that version")
            };
            return Err(format!(
                "the model was made by {age} version of pipeline-sim (format {version}, this one \
                 reads {VERSION}); {remedy}"
            ));
        }
        let outputs = parts.form.outputs();
        let sound = |fit: &Fit| fit.is_sound(outputs.len(), terms);
        let wrong = if ascend(&parts.edges).is_err() {
            "the elbow edges do not ascend"
        } else if parts.pieces.len() != parts.edges.len() + 1 || !parts.pieces.iter().all(sound) {
            "it has the wrong number of coefficients, or a number of its fit is out of range"
        } else if !Quality::are_sound(&parts.quality, outputs) {
            "its accuracy is out of range"
        } else {
            return Ok(Self(parts));
        };
        Err(format!("the stored model is damaged: {wrong}"))
    }
}

impl MoveModel {
    /// The paper's elbow edges (its theta3 at 5 and 20 degrees) as `JT3`, degrees.
    pub const PAPER_ELBOW_EDGES: [f64; 2] = [175.0, 190.0];

    /// Fits a model of the given form, one set of coefficients for each interval between
    /// `elbow_edges_degrees` (`JT3` before the move); without edges, one for all.
    ///
    /// # Errors
    /// [`QuantityError`]: edges that do not ascend; a sample that is not finite; an interval with
    /// too few samples, or with samples that do not determine all coefficients.
    pub fn fit(
        samples: &[MoveSample],
        form: MoveForm,
        elbow_edges_degrees: &[f64],
    ) -> Result<Self, QuantityError> {
        ascend(elbow_edges_degrees)?;
        let mut model = Self(Parts {
            version: VERSION,
            form,
            edges: elbow_edges_degrees.to_vec(),
            ..Parts::default()
        });
        for (i, group) in model.groups(samples)?.iter().enumerate() {
            model.enough(i, group.len())?;
            let mut rows = Rows::default();
            for (index, sample) in group {
                model.push(&mut rows, *index, sample, 1.0)?;
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
    /// noisier for a smaller ball: 2 to 4 is right for them, 0 for the others. The terms of
    /// centering count in units of their size for the longest move at the goal: 1, 5, 165.
    /// Intervals without samples stay unchanged.
    ///
    /// # Errors
    /// [`QuantityError`] for a `ridge` out of 0..=1e100 and for a power that is not finite;
    /// otherwise those of [`MoveModel::fit`]. With a ridge of 1e-12 or above any number of samples
    /// is enough.
    pub fn refit(
        &self,
        samples: &[MoveSample],
        ridge: f64,
        radius_power: f64,
    ) -> Result<Self, QuantityError> {
        amount("the ridge of a refit", ridge)?;
        at_most("the ridge of a refit", ridge, 1e100)?;
        finite("the power of the radius", radius_power)?;
        let mut model = self.clone();
        for (i, group) in self.groups(samples)?.iter().enumerate() {
            let count = group.len();
            if count == 0 {
                continue;
            }
            if ridge == 0.0 {
                self.enough(i, count)?;
            }
            // Logarithms relative to the greatest keep any power in range.
            let log_weight = |sample: &MoveSample| radius_power * sample.before.r.ln();
            let logs = group.iter().map(|(_, s)| log_weight(s));
            let greatest = logs.fold(f64::NEG_INFINITY, f64::max);
            let relative = |sample: &MoveSample| (log_weight(sample) - greatest).exp();
            let mean = group.iter().map(|(_, s)| relative(s)).sum::<f64>() / count as f64;
            let mut rows = Rows::default();
            for (index, sample) in group {
                let weight = (relative(sample) / mean).sqrt();
                self.push(&mut rows, *index, sample, weight)?;
            }
            if ridge > 0.0 {
                let scale = |term| self.0.form.scale(term);
                rows.pull(&self.0.pieces[i], scale, ridge, count)?;
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
        samples: &'a [MoveSample],
    ) -> Result<Vec<Vec<(usize, &'a MoveSample)>>, QuantityError> {
        let mut groups = vec![Vec::new(); self.0.edges.len() + 1];
        for (index, sample) in samples.iter().enumerate() {
            sample.check(index)?;
            groups[self.piece(sample.jt3_degrees)].push((index, sample));
        }
        Ok(groups)
    }

    fn enough(&self, piece: usize, got: usize) -> Result<(), QuantityError> {
        let needed = self.0.form.terms();
        if got < needed {
            return Err(too_few(&self.place(piece), got, needed));
        }
        Ok(())
    }

    /// Adds a sample to the rows of its piece.
    fn push(
        &self,
        rows: &mut Rows,
        index: usize,
        sample: &MoveSample,
        weight: f64,
    ) -> Result<(), QuantityError> {
        let (form, mut buffer) = (self.0.form, [0.0; MOST_TERMS]);
        let (from, to) = (form.fitted(&sample.before), form.fitted(&sample.after));
        let terms = form.fill(
            &sample.before,
            sample.jt3_degrees,
            sample.turns,
            &mut buffer,
        );
        let changes = [to[0] - from[0], to[1] - from[1]];
        rows.push(terms, &changes[..form.outputs().len()], weight)
            .map_err(|(entry, value)| QuantityError::Value {
                quantity: format!("sample {index}: {}", form.entry_name(entry)),
                value,
                allowed: "a number whose square is finite".to_owned(),
            })
    }

    /// Predicts the features after `JT1`, `JT2` and `JT3` turned by `turns` degrees. Centering
    /// changes x alone, approaching y and r. `None` if the ball is lost
    /// ([`SightRule::sees_features`]) or an argument is not finite.
    pub fn predict(
        &self,
        before: &Features,
        jt3_degrees: f64,
        turns: [f64; 3],
    ) -> Option<Features> {
        self.predict_unbounded(before, jt3_degrees, turns)
            .filter(|features| SightRule::default().sees_features(features))
    }

    /// Predicts like [`MoveModel::predict`], also where the ball would count as lost. `None` only
    /// where the model places the ball behind the camera, an argument is not finite, or `before`
    /// has a radius that is not above zero.
    pub fn predict_unbounded(
        &self,
        before: &Features,
        jt3_degrees: f64,
        turns: [f64; 3],
    ) -> Option<Features> {
        let finite = |f: &Features| [f.x, f.y, f.r].iter().all(|v| v.is_finite());
        let usable = finite(before) && before.r > 0.0 && jt3_degrees.is_finite();
        if !(usable && turns.iter().all(|v| v.is_finite())) {
            return None;
        }
        let (form, mut buffer) = (self.0.form, [0.0; MOST_TERMS]);
        let terms = form.fill(before, jt3_degrees, turns, &mut buffer);
        let fit = &self.0.pieces[self.piece(jt3_degrees)];
        let mut to = form.fitted(before);
        for (k, to) in to.iter_mut().take(form.outputs().len()).enumerate() {
            *to += fit.value(k, terms);
        }
        form.image(before, to).filter(finite)
    }

    /// Accuracy of the changes of x, or of y and r, on the samples the model was fitted to.
    pub fn quality(&self) -> &[Quality] {
        &self.0.quality
    }

    /// Judges the model on other samples. A sample for which the model has no prediction counts as
    /// one for which it predicts no change, and in [`Quality::unpredicted`].
    ///
    /// # Errors
    /// [`QuantityError`]: no samples, or one that holds a NaN, an infinity, or a radius that is not
    /// above zero.
    pub fn quality_on(&self, samples: &[MoveSample]) -> Result<Vec<Quality>, QuantityError> {
        let count = samples.len() as f64;
        positive("the number of samples to judge a model on", count)?;
        for (index, sample) in samples.iter().enumerate() {
            sample.check(index)?;
        }
        Ok(self.judge(samples))
    }

    fn judge(&self, samples: &[MoveSample]) -> Vec<Quality> {
        let output = |name: &&str| {
            let of = |f: &Features| match *name {
                "dx" => f.x,
                "dy" => f.y,
                _ => f.r,
            };
            let pair = |s: &MoveSample| {
                let after = self.predict_unbounded(&s.before, s.jt3_degrees, s.turns);
                let change = |after: &Features| of(after) - of(&s.before);
                (change(&s.after), after.as_ref().map(change))
            };
            Quality::of(name, &samples.iter().map(pair).collect::<Vec<_>>())
        };
        self.0.form.outputs().iter().map(output).collect()
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

/// Refuses edges that are not finite or not each above the one before.
fn ascend(edges: &[f64]) -> Result<(), QuantityError> {
    for edge in edges {
        finite("an elbow edge (degrees)", *edge)?;
    }
    match edges.windows(2).find(|pair| pair[0] >= pair[1]) {
        None => Ok(()),
        Some(pair) => Err(QuantityError::Range {
            quantity: "the elbow edges (degrees)",
            low: pair[0],
            high: pair[1],
        }),
    }
}
