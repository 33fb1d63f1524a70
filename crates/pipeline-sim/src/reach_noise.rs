//! How far observations lie from a regression simulator's predictions, and how that depends on where the ball is.

use hough_heuristic::Features;

use crate::ReachForm;

/// By how much each of the two causes of an error shows in one feature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Shares {
    /// Variance of the feature for noise of variance 1 on every observed feature.
    pub(crate) observed: f64,
    /// Variance of the feature for what the form leaves out, on a scale of its own.
    pub(crate) fitted: f64,
}

impl ReachForm {
    /// The shares for y and for r of a move by `d2` and `d3` degrees that leads from `before` to `after`.
    pub(crate) fn shares(self, before: &Features, after: &Features, d2: f64, d3: f64) -> [Shares; 2] {
        // What a form leaves out is, of the terms that turn (Z, V), those of the next higher order in the move.
        let moved = (d2 / 20.0).powi(2) + (d3 / 16.0).powi(2);
        let left_out = match self {
            Self::Linear => {
                let even = Shares {
                    observed: 1.0,
                    fitted: 0.0,
                };
                return [even, even];
            }
            Self::Rigid8 => moved.powi(2),
            Self::Rigid22 => moved.powi(3),
            Self::RigidBody => moved,
        };
        // With r = 33 / Z and y = 72 + r V, noise of `before` is carried along in Z and V; that of `after` comes on top.
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

impl Noise {
    /// From squared residuals with their shares, `left` being the ratio of the degrees of freedom that are left to the samples.
    pub(crate) fn of(residuals: &[(Shares, f64)], left: f64) -> Self {
        let n = residuals.len() as f64;
        if residuals.is_empty() {
            return Self::default();
        }
        // Squared residuals on both shares, relative to the first, by least squares, neither below zero.
        let (mut sq, mut q, mut eq, mut e, mut total) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (shares, squared) in residuals {
            let (ratio, relative) = (shares.fitted / shares.observed, squared / shares.observed);
            sq += ratio * ratio / n;
            q += ratio / n;
            eq += ratio * relative / n;
            e += relative / n;
            total += squared / n;
        }
        let determinant = sq - q * q;
        let (observed, fitted) = if determinant > 1e-12 * sq {
            ((e * sq - eq * q) / determinant, (eq - e * q) / determinant)
        } else {
            (e, 0.0)
        };
        let (observed, fitted) = if fitted < 0.0 {
            (e, 0.0)
        } else if observed < 0.0 {
            (0.0, eq / sq)
        } else {
            (observed, fitted)
        };
        Self {
            residual: (total / left).sqrt(),
            observed: observed / left,
            fitted: fitted / left,
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
