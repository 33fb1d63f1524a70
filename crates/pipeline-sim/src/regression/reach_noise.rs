//! How far observations lie from a regression simulator's predictions, and how that depends on
//! where the ball is.

use hough_heuristic::Features;

use crate::regression::reach_form::ReachForm;

/// By how much each of the two causes of an error shows in one feature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Shares {
    /// Variance of the feature for noise of variance 1 on every observed feature.
    pub(crate) observed: f64,
    /// Variance of the feature for what the form leaves out, on a scale of its own.
    pub(crate) fitted: f64,
}

impl ReachForm {
    /// The shares for y and for r of a move by `d2` and `d3` degrees that leads from `before` to
    /// `after`.
    pub(crate) fn shares(
        self,
        before: &Features,
        after: &Features,
        d2: f64,
        d3: f64,
    ) -> [Shares; 2] {
        // What a form leaves out is, of the terms that turn (Z, V), those of the next higher order
        // in the move.
        let moved = (d2 / 20.0).powi(2) + (d3 / 16.0).powi(2);
        let left_out = match self {
            // All that its coefficients stand for grows with r, that of r with its square.
            Self::Linear => {
                let near = (before.r / 33.0).powi(2);
                return [near, near * near].map(|near| Shares {
                    observed: 1.0,
                    fitted: moved * near,
                });
            }
            Self::Rigid8 => moved.powi(2),
            Self::Rigid22 => moved.powi(3),
            Self::RigidBody => moved,
        };
        // With r = 33 / Z and y = 72 + r V, noise of `before` is carried along in Z and V; that of
        // `after` comes on top.
        let nearer = after.r / before.r;
        let (v0, v1) = ((before.y - 72.0) / before.r, (after.y - 72.0) / after.r);
        let r_of_z = after.r * after.r / 33.0;
        [
            Shares {
                observed: 1.0 + nearer.powi(2) * (1.0 + (v1 * nearer - v0).powi(2)),
                fitted: left_out * (after.r.powi(2) + (v1 * r_of_z).powi(2)),
            },
            Shares {
                observed: 1.0 + nearer.powi(4),
                fitted: left_out * r_of_z.powi(2),
            },
        ]
    }
}

/// Rounds of weighing in [`Noise::of`].
const ROUNDS: usize = 6;

/// The noise of one feature.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Noise {
    /// Standard deviation of all residuals, feature units.
    pub(crate) residual: f64,
    /// Variance of the noise of observed features, units².
    pub(crate) observed: f64,
    /// Strength of what the form cannot express, on the scale of its share.
    pub(crate) fitted: f64,
}

/// Degrees of freedom for which a prior says how errors depend on where the ball is.
const SHAPE_FREEDOM: f64 = 10.0;

/// Degrees of freedom for which a prior says how large they are.
const SCALE_FREEDOM: f64 = 1.0;

/// By how much more than expected a refit errs, from squared errors over the variances that its
/// prior expects.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Misfit {
    sum: f64,
    count: f64,
}

impl Misfit {
    /// One more squared error over its variance.
    pub(crate) fn add(&mut self, ratio: f64) {
        if ratio.is_finite() {
            self.sum += ratio;
            self.count += 1.0;
        }
    }

    /// What the prior's variances are multiplied by.
    fn scale(&self) -> f64 {
        (SCALE_FREEDOM + self.sum) / (SCALE_FREEDOM + self.count)
    }
}

/// By how much the middle 95 % of Student's distribution are wider than those of the normal one: a
/// variance found from few errors is itself uncertain, here from those of `samples` and of the
/// prior. (Cornish and Fisher's expansion.)
pub(crate) fn widening(samples: usize) -> f64 {
    let n = SCALE_FREEDOM + samples as f64;
    1.0 + 1.2107 / n + 1.4408 / (n * n) + 1.3401 / (n * n * n)
}

/// A variance found with `freedom` degrees of freedom (one, if less), together with that of a
/// prior.
pub(crate) fn pooled(variance: f64, prior: f64, freedom: f64, misfit: &Misfit) -> f64 {
    let sum = variance * freedom.max(1.0);
    (sum + SHAPE_FREEDOM * prior * misfit.scale()) / (SHAPE_FREEDOM + freedom.max(0.0))
}

impl Noise {
    /// From squared residuals with their shares, `left` being the ratio of the degrees of freedom
    /// that are left to the samples.
    pub(crate) fn of(residuals: &[(Shares, f64)], left: f64) -> Self {
        let n = residuals.len() as f64;
        if residuals.is_empty() {
            return Self::default();
        }
        // Squared residuals on both shares, relative to the first, by least squares, neither below
        // zero; then again and again with each weighed as a squared residual of the variance found
        // deserves, or the greatest would decide alone.
        let relative: Vec<(f64, f64)> = residuals
            .iter()
            .map(|(shares, squared)| (shares.fitted / shares.observed, squared / shares.observed))
            .collect();
        let total = residuals
            .iter()
            .map(|(_, squared)| squared / n)
            .sum::<f64>();
        let least = 1e-3 * relative.iter().map(|(_, squared)| squared / n).sum::<f64>();
        let (mut observed, mut fitted) = (1.0, 0.0);
        for _ in 0..ROUNDS {
            let (mut w, mut sq, mut q, mut eq, mut e) = (0.0, 0.0, 0.0, 0.0, 0.0);
            for (ratio, squared) in &relative {
                let weight = (observed + fitted * ratio).max(least).powi(-2);
                w += weight;
                sq += weight * ratio * ratio;
                q += weight * ratio;
                eq += weight * ratio * squared;
                e += weight * squared;
            }
            let determinant = w * sq - q * q;
            let even = (e / w, 0.0);
            (observed, fitted) = if determinant > 1e-12 * w * sq {
                (
                    (e * sq - eq * q) / determinant,
                    (w * eq - e * q) / determinant,
                )
            } else {
                even
            };
            if fitted < 0.0 || !observed.is_finite() || !fitted.is_finite() {
                (observed, fitted) = even;
            } else if observed < 0.0 {
                (observed, fitted) = (0.0, eq / sq);
            }
        }
        Self {
            residual: (total / left).sqrt(),
            observed: observed / left,
            fitted: fitted / left,
        }
    }

    /// This noise, found with `freedom` degrees of freedom, together with that of a prior.
    pub(crate) fn pooled(self, prior: &Self, freedom: f64, misfit: &Misfit) -> Self {
        Self {
            residual: pooled(
                self.residual.powi(2),
                prior.residual.powi(2),
                freedom,
                misfit,
            )
            .sqrt(),
            observed: pooled(self.observed, prior.observed, freedom, misfit),
            fitted: pooled(self.fitted, prior.fitted, freedom, misfit),
        }
    }

    /// Variance of the feature where the shares are these.
    pub(crate) fn variance(&self, shares: Shares) -> f64 {
        self.observed * shares.observed + self.fitted * shares.fitted
    }

    /// Whether all of it is finite and not below zero.
    pub(crate) fn is_sound(&self) -> bool {
        [self.residual, self.observed, self.fitted]
            .iter()
            .all(|v| v.is_finite() && *v >= 0.0)
    }
}
