//! The terms of the regression simulator of approaching.

use hough_heuristic::Features;

/// The terms of a [`ReachModel`](crate::ReachModel).
///
/// With d2, d3 the moves in degrees, a = d2 / 20, b = d3 / 16, Z = 33 / r, V = (y - 72) / r, E =
/// (`JT3` - 140) / 40 before the move. In the arm's plane (Z, V) is, up to a scale, the ball's
/// place as the camera sees it, and a move of the arm turns and shifts it rigidly; that is why the
/// `Rigid` forms, which fit the changes of Z and V, need far fewer terms than the image's own
/// coordinates would.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum ReachForm {
    /// Changes of y and r on 1, d2, d3: the paper's linear regression, per elbow interval.
    Linear,
    /// Changes of Z and V on 1, a, b, Za, Zb, Va, Vb, Ea.
    Rigid8,
    /// Changes of Z and V on 1, and a, b, a², ab, b² each times 1, Z, V, E, and E²a.
    Rigid22,
    /// Changes of Z and V on the twelve products that a rigid motion of a two-joint arm consists
    /// of. With c, s cosine and sine of d3 (index 3) and d2 + d3 (index 23), and e = `JT3`, they
    /// are (c23 minus 1) and s23 times Z and V; (c3 minus c23) and (s3 minus s23) times 1, cos e,
    /// sin e; 1 minus c3; s3. No further terms exist: the residual is the outline's slight
    /// ellipticity.
    RigidBody,
}

impl ReachForm {
    /// Returns the number of terms.
    pub(super) fn terms(self) -> usize {
        match self {
            Self::Linear => 3,
            Self::Rigid8 => 8,
            Self::Rigid22 => 22,
            Self::RigidBody => 12,
        }
    }

    /// Returns the names of the terms, in the order of [`ReachForm::fill`].
    pub(crate) fn term_names(self) -> &'static [&'static str] {
        match self {
            Self::Linear => &["the constant term", "the term d2", "the term d3"],
            Self::Rigid8 => &[
                "the constant term",
                "the term a",
                "the term b",
                "the term Za",
                "the term Zb",
                "the term Va",
                "the term Vb",
                "the term Ea",
            ],
            Self::Rigid22 => &[
                "the constant term",
                "the term a",
                "the term Za",
                "the term Va",
                "the term Ea",
                "the term b",
                "the term Zb",
                "the term Vb",
                "the term Eb",
                "the term a²",
                "the term Za²",
                "the term Va²",
                "the term Ea²",
                "the term ab",
                "the term Zab",
                "the term Vab",
                "the term Eab",
                "the term b²",
                "the term Zb²",
                "the term Vb²",
                "the term Eb²",
                "the term E²a",
            ],
            Self::RigidBody => &[
                "the term (c23 - 1) Z",
                "the term (c23 - 1) V",
                "the term s23 Z",
                "the term s23 V",
                "the term c3 - c23",
                "the term (c3 - c23) cos e",
                "the term (c3 - c23) sin e",
                "the term s3 - s23",
                "the term (s3 - s23) cos e",
                "the term (s3 - s23) sin e",
                "the term 1 - c3",
                "the term s3",
            ],
        }
    }

    /// Returns the names of the two fitted quantities.
    pub(crate) fn output_names(self) -> [&'static str; 2] {
        match self {
            Self::Linear => ["the change of y", "the change of r"],
            _ => ["the change of Z = 33 / r", "the change of V = (y - 72) / r"],
        }
    }

    /// Writes the terms and returns them as a slice of `buffer`.
    pub(crate) fn fill<'a>(
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
            Self::Rigid8 => {
                buffer[..8].copy_from_slice(&[1.0, a, b, z * a, z * b, v * a, v * b, e * a]);
            }
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
                let ((s3, c3), (s23, c23)) =
                    (d3.to_radians().sin_cos(), (d2 + d3).to_radians().sin_cos());
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

    /// Returns the two quantities that are fitted, from image features: (y, r), or (Z, V).
    pub(crate) fn outputs(self, features: &Features) -> [f64; 2] {
        match self {
            Self::Linear => [features.y, features.r],
            _ => [33.0 / features.r, (features.y - 72.0) / features.r],
        }
    }

    /// Returns (y, r) from the fitted quantities; `None` if they belong to no ball in front of the
    /// camera.
    pub(crate) fn image(self, outputs: [f64; 2]) -> Option<(f64, f64)> {
        match self {
            Self::Linear => Some((outputs[0], outputs[1])),
            _ => (outputs[0] > 0.0)
                .then(|| (72.0 + 33.0 * outputs[1] / outputs[0], 33.0 / outputs[0])),
        }
    }
}
