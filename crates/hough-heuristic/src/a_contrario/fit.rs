//! Weighted least squares for a circle: how far it is to be moved and widened.

use super::polar::{LANES, Ring};

/// Sums for the least-squares fit of `residual = dr + ux dx + uy dy` over unit vectors `u`. Each
/// moment is kept as eight partial sums, one for each vector lane; [`step`](Self::step) adds them.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Moments([[f32; LANES]; 9]);

impl Moments {
    /// Adds eight residuals.
    #[inline(always)]
    pub(super) fn add(
        &mut self,
        ux: &[f32; LANES],
        uy: &[f32; LANES],
        residual: &[f32; LANES],
        weight: &[f32; LANES],
    ) {
        let [n, x, y, xx, xy, yy, d, dx, dy] = &mut self.0;
        for lane in 0..LANES {
            let (wx, wy) = (weight[lane] * ux[lane], weight[lane] * uy[lane]);
            n[lane] += weight[lane];
            x[lane] += wx;
            y[lane] += wy;
            xx[lane] += wx * ux[lane];
            xy[lane] += wx * uy[lane];
            yy[lane] += wy * uy[lane];
            d[lane] += weight[lane] * residual[lane];
            dx[lane] += wx * residual[lane];
            dy[lane] += wy * residual[lane];
        }
    }

    /// The step to the best circle; None if the directions do not determine it.
    #[inline(always)]
    pub(super) fn step(&self) -> Option<Ring> {
        let [n, ux, uy, uxx, uxy, uyy, d, dx, dy] = self.0.map(|sums| {
            let [a, b, c, d, e, f, g, h] = sums;
            ((a + e) + (c + g)) + ((b + f) + (d + h))
        });
        if n <= 0.0 {
            return None;
        }
        let (uxx, uxy, uyy) = (uxx - ux * ux / n, uxy - ux * uy / n, uyy - uy * uy / n);
        let (dx, dy) = (dx - ux * d / n, dy - uy * d / n);
        let determinant = uxx * uyy - uxy * uxy;
        if determinant < 1e-3 * n * n {
            return None;
        }
        let x = (dx * uyy - dy * uxy) / determinant;
        let y = (dy * uxx - dx * uxy) / determinant;
        Some(Ring {
            x,
            y,
            r: (d - ux * x - uy * y) / n,
        })
    }
}
