//! Slowly varying light on the table, worked out at few pixels and interpolated between them.

use nalgebra::{Matrix3, Vector3};

use crate::render::bodies::STRIDE;
use crate::render::view::View;

/// Rows between two rows at which the light is worked out.
const ROWS: usize = 4;

/// Light at every [`STRIDE`]th column of every [`ROWS`]th row.
#[derive(Clone, Debug, Default)]
pub(super) struct LightGrid {
    columns: usize,
    values: Vec<f32>,
}

impl LightGrid {
    /// Works out `light` where the rays of the grid's pixels meet the plane; where they do not, it is dark.
    pub(super) fn lay(&mut self, view: &View, plane: &Matrix3<f64>, light: impl Fn(f64, f64) -> f32) {
        self.columns = view.width / STRIDE + 2;
        let rows = view.height / ROWS + 2;
        self.values.clear();
        for j in 0..rows {
            let base = plane * Vector3::new(0.0, (j * ROWS) as f64, 1.0);
            let step = plane.column(0) * STRIDE as f64;
            self.values.extend((0..self.columns).map(|i| {
                let p = base + step * i as f64;
                if p.z > 0.0 {
                    light(p.x / p.z, p.y / p.z)
                } else {
                    0.0
                }
            }));
        }
    }

    /// The light at a pixel.
    pub(super) fn at(&self, x: usize, y: usize) -> f32 {
        let (i, fx) = (x / STRIDE, (x % STRIDE) as f32 / STRIDE as f32);
        let (j, fy) = (y / ROWS, (y % ROWS) as f32 / ROWS as f32);
        let k = j * self.columns + i;
        let Some(upper) = self.values.get(k..k + 2) else {
            return 0.0;
        };
        let Some(lower) = self.values.get(k + self.columns..k + self.columns + 2) else {
            return 0.0;
        };
        let (a, b) = (
            upper[0] + (upper[1] - upper[0]) * fx,
            lower[0] + (lower[1] - lower[0]) * fx,
        );
        a + (b - a) * fy
    }
}
