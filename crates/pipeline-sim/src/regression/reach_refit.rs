//! The regression simulator of approaching, fitted anew to another plant.

use hough_heuristic::Features;

use crate::regression::least_squares::FitError;
use crate::regression::least_squares::{Fit, Hold, Rows, ridge_strength};
use crate::regression::reach_form::ReachForm;
use crate::regression::reach_model::ReachModel;
use crate::regression::reach_model::push;
use crate::regression::reach_noise::Misfit;
use crate::regression::samples::ReachSample;

impl ReachModel {
    /// The model fitted anew to samples of another plant, held toward this one: what N real moves
    /// teach about an arm that is not the one the model was made for.
    ///
    /// For each elbow interval and output the coefficients c minimise the mean of w (change - terms
    /// · c)² plus `ridge` · |c - c0|², with c0 this model's coefficients and w = r before to the
    /// power `radius_power`, normalised to mean 1 (the fitted quantities of the `Rigid` forms are
    /// the noisier the smaller the ball; 2 to 4 is right for them, 0 for `Linear`). An interval
    /// without samples stays as it is, and so does the whole model without any.
    ///
    /// [`ReachModel::uncertainty`] of a refit takes another plant's coefficients to be off by the
    /// residual variance over `ridge`, and its errors to be spread over near and far as this
    /// model's are until the samples know better (for ten degrees of freedom). How large they are
    /// the samples say: each is predicted by the others and this model, and the squared error
    /// compared with the expected one. With few samples much larger errors are expected than occur
    /// (the README has the figures).
    ///
    /// # Errors
    /// [`FitError::Prior`] for a `ridge` that is not a finite number of zero or above, or is so
    /// large that nothing else counts (above 1e100), and for a power that is not finite; otherwise
    /// as for [`ReachModel::fit`] (with a ridge of 1e-12 or above neither too few samples nor a
    /// lack of rank is an error).
    pub fn refit(
        &self,
        samples: &[ReachSample],
        ridge: f64,
        radius_power: f64,
    ) -> Result<Self, FitError> {
        ridge_strength(ridge, 0)?;
        if !radius_power.is_finite() {
            let what = format!("a refit needs a finite power, not {radius_power}");
            return Err(FitError::Prior { what });
        }
        let mut model = self.clone();
        let groups = self.groups(samples)?;
        for (i, group) in groups
            .iter()
            .enumerate()
            .filter(|(_, group)| !group.is_empty())
        {
            let count = group.len();
            if ridge == 0.0 && count < self.form.terms() {
                return Err(FitError::TooFewSamples {
                    place: self.place(i),
                    got: count,
                    needed: self.form.terms(),
                });
            }
            // By way of logarithms, and relative to the greatest: no power is too large to be
            // taken.
            let log_weight = |sample: &ReachSample| radius_power * sample.before.r.ln();
            let greatest = group
                .iter()
                .map(|(_, s)| log_weight(s))
                .fold(f64::NEG_INFINITY, f64::max);
            let relative = |sample: &ReachSample| (log_weight(sample) - greatest).exp();
            let mean = group.iter().map(|(_, s)| relative(s)).sum::<f64>() / count as f64;
            let weigh = |sample: &ReachSample| relative(sample) / mean;
            let mut rows = Rows::default();
            for (index, sample) in group {
                push(self.form, &mut rows, *index, sample, weigh(sample).sqrt())?;
            }
            if ridge > 0.0 {
                rows.pull(&self.pieces[i], &[], ridge_strength(ridge, count)?)?;
            }
            model.pieces[i] = rows.solve(&self.place(i), count)?;
            let (own, freedom) = model.noise_of(i, group, weigh);
            let hold = Hold::new(ridge_strength(ridge, count)?, &[], count);
            let scales = self.misfit(i, group, weigh, &model.pieces[i], &hold);
            // Of (y, r) and of what is fitted: r follows from Z alone, y from V above all.
            let of_outputs = match self.form {
                ReachForm::Linear => [&scales[0], &scales[1]],
                _ => [&scales[1], &scales[0]],
            };
            model.pieces[i].pool(&self.pieces[i], freedom, of_outputs);
            model.pieces[i].hold(&hold);
            model.noise[i] =
                std::array::from_fn(|k| own[k].pooled(&self.noise[i][k], freedom, &scales[k]));
        }
        if !samples.is_empty() {
            model.quality = model.judge(samples);
        }
        Ok(model)
    }

    /// By how much more, or less, than this model expects of piece `i` its refit errs in y and in
    /// r.
    ///
    /// Each sample is predicted by what the others and the prior say of it, `fit` without it.
    fn misfit(
        &self,
        i: usize,
        group: &[(usize, &ReachSample)],
        weight: impl Fn(&ReachSample) -> f64,
        fit: &Fit,
        hold: &Hold,
    ) -> [Misfit; 2] {
        let mut buffer = [0.0; 22];
        let mut misfits = [Misfit::default(); 2];
        for (_, s) in group {
            let terms = self
                .form
                .fill(&s.before, s.jt3_degrees, s.d2, s.d3, &mut buffer);
            let (from, to) = (self.form.outputs(&s.before), self.form.outputs(&s.after));
            let Some((left, leverage)) = fit.without(terms, weight(s), hold) else {
                continue;
            };
            let without = [0, 1].map(|k| {
                let own = to[k] - from[k] - fit.value(k, terms);
                to[k] - own / left
            });
            let Some((y, r)) = self.form.image(without) else {
                continue;
            };
            let after = Features {
                x: s.before.x,
                y,
                r,
            };
            let expected = self.variances(i, &s.before, &after, (s.d2, s.d3), leverage);
            misfits[0].add((y - s.after.y).powi(2) / expected[0]);
            misfits[1].add((r - s.after.r).powi(2) / expected[1]);
        }
        misfits
    }
}
