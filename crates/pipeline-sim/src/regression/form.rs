//! The terms of the regression simulators.

use hough_heuristic::Features;

/// The quantities that a [`MoveModel`](crate::MoveModel) predicts, and the terms that each of them
/// is a linear combination of.
///
/// With d1, d2, d3 the moves of `JT1`, `JT2`, `JT3` in degrees, a = d2 / 20, b = d3 / 16, Z =
/// 33 / r, V = (y - 72) / r, E = (`JT3` - 140) / 40 before the move. In the arm's plane (Z, V) is,
/// up to a scale, the ball's place as the camera sees it, and a move of the arm turns and shifts it
/// rigidly; that is why the `Rigid` forms, which fit the changes of Z and V, need far fewer terms
/// than the image's own coordinates would.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum MoveForm {
    /// Centering: change of x from the terms 1, d1 and r d1. A near ball moves farther in the
    /// image.
    Centering,
    /// Centering: change of x from the terms 1 and d1, the paper's linear regression. It leaves a
    /// fifth of the variance unexplained.
    CenteringLinear,
    /// Approaching: changes of y and r from the terms 1, d2 and d3, the paper's linear regression,
    /// per elbow interval.
    Linear,
    /// Approaching: changes of Z and V from the terms 1, a, b, Za, Zb, Va, Vb, Ea.
    Rigid8,
    /// Approaching: changes of Z and V from 22 terms: 1; each of a, b, a², ab, b² times each of 1,
    /// Z, V, E; E²a.
    #[default]
    Rigid22,
    /// Approaching: changes of Z and V from the twelve terms that a rigid motion of a two-joint arm
    /// consists of. With c, s cosine and sine of d3 (index 3) and d2 + d3 (index 23), and e =
    /// `JT3`, they are (c23 minus 1) and s23 times Z and V; (c3 minus c23) and (s3 minus s23) times
    /// 1, cos e, sin e; 1 minus c3; s3. No further terms exist: the residual is the outline's
    /// slight ellipticity.
    RigidBody,
}

/// Greatest number of terms.
pub(super) const MOST_TERMS: usize = 22;

impl MoveForm {
    /// Returns the number of terms.
    pub(super) fn terms(self) -> usize {
        self.term_names().split(", ").count()
    }

    fn term_names(self) -> &'static str {
        match self {
            Self::Centering => "1, d1, r d1",
            Self::CenteringLinear => "1, d1",
            Self::Linear => "1, d2, d3",
            Self::Rigid8 => "1, a, b, Za, Zb, Va, Vb, Ea",
            Self::Rigid22 => {
                "1, a, Za, Va, Ea, b, Zb, Vb, Eb, a², Za², Va², Ea², ab, Zab, Vab, Eab, b², Zb², \
                 Vb², Eb², E²a"
            }
            Self::RigidBody => {
                "(c23 - 1) Z, (c23 - 1) V, s23 Z, s23 V, c3 - c23, (c3 - c23) cos e, \
                 (c3 - c23) sin e, s3 - s23, (s3 - s23) cos e, (s3 - s23) sin e, 1 - c3, s3"
            }
        }
    }

    /// Returns the outputs in the image whose accuracy is judged.
    pub(super) fn outputs(self) -> &'static [&'static str] {
        match self {
            Self::Centering | Self::CenteringLinear => &["dx"],
            _ => &["dy", "dr"],
        }
    }

    /// Returns the name of an entry of a row: the terms, then the changes fitted.
    pub(super) fn entry_name(self, entry: usize) -> String {
        if let Some(term) = self.term_names().split(", ").nth(entry) {
            return format!("the term {term}");
        }
        let output = entry - self.terms();
        let fitted = match self {
            Self::Centering | Self::CenteringLinear => "x",
            Self::Linear => ["y", "r"][output],
            _ => ["Z = 33 / r", "V = (y - 72) / r"][output],
        };
        format!("the change of {fitted}")
    }

    /// Returns the size of a term at the longest moves of the paper's lists: the unit of a ridge.
    pub(super) fn scale(self, term: usize) -> f64 {
        match self {
            Self::Centering | Self::CenteringLinear => [1.0, 5.0, 5.0 * 33.0][term],
            _ => 1.0,
        }
    }

    /// Writes the terms for moves of the first three joints, degrees, and returns them as a slice
    /// of `buffer`.
    pub(super) fn fill<'a>(
        self,
        before: &Features,
        jt3_degrees: f64,
        [d1, d2, d3]: [f64; 3],
        buffer: &'a mut [f64; MOST_TERMS],
    ) -> &'a [f64] {
        let (a, b) = (d2 / 20.0, d3 / 16.0);
        let [z, v] = plane(before);
        let e = (jt3_degrees - 140.0) / 40.0;
        let mut put = |terms: &[f64]| {
            buffer[..terms.len()].copy_from_slice(terms);
            terms.len()
        };
        let count = match self {
            Self::Centering => put(&[1.0, d1, before.r * d1]),
            Self::CenteringLinear => put(&[1.0, d1]),
            Self::Linear => put(&[1.0, d2, d3]),
            Self::Rigid8 => put(&[1.0, a, b, z * a, z * b, v * a, v * b, e * a]),
            Self::Rigid22 => {
                buffer[0] = 1.0;
                for (i, moved) in [a, b, a * a, a * b, b * b].into_iter().enumerate() {
                    for (j, place) in [1.0, z, v, e].into_iter().enumerate() {
                        buffer[1 + 4 * i + j] = moved * place;
                    }
                }
                buffer[21] = e * e * a;
                MOST_TERMS
            }
            Self::RigidBody => {
                let ((s3, c3), (s23, c23)) =
                    (d3.to_radians().sin_cos(), (d2 + d3).to_radians().sin_cos());
                let (sin, cos) = jt3_degrees.to_radians().sin_cos();
                let (turned, c, s) = (c23 - 1.0, c3 - c23, s3 - s23);
                let of_place = [turned * z, turned * v, s23 * z, s23 * v];
                buffer[..4].copy_from_slice(&of_place);
                let of_elbow = [c, c * cos, c * sin, s, s * cos, s * sin, 1.0 - c3, s3];
                buffer[4..12].copy_from_slice(&of_elbow);
                12
            }
        };
        &buffer[..count]
    }

    /// Returns the quantities that are fitted: x alone, (y, r), or (Z, V).
    pub(super) fn fitted(self, features: &Features) -> [f64; 2] {
        match self {
            Self::Centering | Self::CenteringLinear => [features.x, 0.0],
            Self::Linear => [features.y, features.r],
            _ => plane(features),
        }
    }

    /// Returns `before` with the fitted quantities replaced; `None` if they belong to no ball in
    /// front of the camera.
    pub(super) fn image(self, before: &Features, fitted: [f64; 2]) -> Option<Features> {
        let [p, q] = fitted;
        match self {
            Self::Centering | Self::CenteringLinear => Some(Features { x: p, ..*before }),
            Self::Linear => Some(Features {
                y: p,
                r: q,
                ..*before
            }),
            _ => (p > 0.0).then(|| Features {
                y: 72.0 + 33.0 * q / p,
                r: 33.0 / p,
                ..*before
            }),
        }
    }
}

/// Returns the ball's place (Z, V) in the arm's plane.
fn plane(features: &Features) -> [f64; 2] {
    [33.0 / features.r, (features.y - 72.0) / features.r]
}
