//! Weighted least squares for an outline: how far it is to be moved, widened and made oval.

use super::polar::Oval;

/// Moments of `residual = dr + ux dx + uy dy + cos2 c + sin2 d` over unit vectors `u`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Moments {
    matrix: [[f64; N]; N],
    right: [f64; N],
}

const N: usize = 5;

impl Moments {
    #[inline]
    pub(super) fn add(&mut self, (ux, uy): (f32, f32), residual: f32, weight: f32) {
        let (x, y) = (f64::from(ux), f64::from(uy));
        let row = [1.0, x, y, x * x - y * y, 2.0 * x * y];
        let weight = f64::from(weight);
        for i in 0..N {
            let scaled = weight * row[i];
            self.right[i] += scaled * f64::from(residual);
            for j in 0..=i {
                self.matrix[i][j] += scaled * row[j];
            }
        }
    }

    /// The step, of a circle or of an oval; None if the directions do not determine it.
    pub(super) fn step(&self, oval: bool) -> Option<Oval> {
        let count = if oval { N } else { 3 };
        // Cholesky's decomposition.
        let mut lower = [[0.0; N]; N];
        for i in 0..count {
            for j in 0..=i {
                let sum: f64 = (0..j).map(|k| lower[i][k] * lower[j][k]).sum();
                let rest = self.matrix[i][j] - sum;
                if i == j {
                    if rest <= 2e-3 * self.matrix[0][0] {
                        return None;
                    }
                    lower[i][i] = rest.sqrt();
                } else {
                    lower[i][j] = rest / lower[j][j];
                }
            }
        }
        let mut x = self.right;
        for i in 0..count {
            let sum: f64 = (0..i).map(|k| lower[i][k] * x[k]).sum();
            x[i] = (x[i] - sum) / lower[i][i];
        }
        for i in (0..count).rev() {
            let sum: f64 = (i + 1..count).map(|k| lower[k][i] * x[k]).sum();
            x[i] = (x[i] - sum) / lower[i][i];
        }
        Some(Oval {
            r: x[0] as f32,
            x: x[1] as f32,
            y: x[2] as f32,
            cos2: if oval { x[3] as f32 } else { 0.0 },
            sin2: if oval { x[4] as f32 } else { 0.0 },
        })
    }
}
