//! Slowly varying light on the table, worked out at few pixels and interpolated between them.

use hough_heuristic::{Vectorized, widest};
use nalgebra::Matrix3;

use crate::render::view::View;

/// Pixels, along both axes, between two at which the light is worked out.
const STEP: usize = 4;

/// Share of their sum by which two nodes may differ to be taken as alike.
const ALIKE: f32 = 0.01;

/// Light at every [`STEP`]th column of every [`STEP`]th row.
#[derive(Clone, Debug, Default)]
pub(super) struct LightGrid {
    columns: usize,
    values: Vec<f32>,
}

impl LightGrid {
    /// Works out `light` where the rays of the grid's pixels meet the plane; where they do not, it is dark. Between every second node along
    /// both axes that is done only where these differ.
    pub(super) fn lay(&mut self, view: &View, plane: &Matrix3<f64>, light: impl Fn(f64, f64) -> f32) {
        let nodes = |pixels: usize| pixels / (2 * STEP) * 2 + 3;
        let (columns, rows) = (nodes(view.width), nodes(view.height));
        self.columns = columns;
        self.values.clear();
        self.values.resize(columns * rows, 0.0);
        let (across, down) = (plane.column(0) * STEP as f64, plane.column(1) * STEP as f64);
        let exact = |i: usize, j: usize| {
            let p = plane.column(2) + across * i as f64 + down * j as f64;
            if p.z > 0.0 {
                let w = 1.0 / p.z;
                light(p.x * w, p.y * w)
            } else {
                0.0
            }
        };
        for j in (0..rows).step_by(2) {
            for i in (0..columns).step_by(2) {
                self.values[j * columns + i] = exact(i, j);
            }
        }
        let between = |a: f32, b: f32| ((a - b).abs() <= ALIKE * (a + b)).then_some(0.5 * (a + b));
        for j in 0..rows {
            let start = 1 - j % 2;
            for i in (start..columns).step_by(1 + start) {
                let at = |di: isize, dj: isize| {
                    let place = (j * columns + i).wrapping_add_signed(dj * columns as isize + di);
                    self.values[place]
                };
                let mean = match (i % 2, j % 2) {
                    (1, 0) => between(at(-1, 0), at(1, 0)),
                    (0, _) => between(at(0, -1), at(0, 1)),
                    _ => between(at(-1, -1), at(1, 1))
                        .zip(between(at(1, -1), at(-1, 1)))
                        .and_then(|(a, b)| between(a, b)),
                };
                self.values[j * columns + i] = mean.unwrap_or_else(|| exact(i, j));
            }
        }
    }

    /// Multiplies the pixels x0.. of row y by the light on them.
    pub(super) fn shine(&self, y: usize, x0: usize, row: &mut [f32]) {
        widest(Shining {
            light: self,
            start: (y, x0),
            row,
        });
    }

    #[inline(always)]
    fn shine_on(&self, (y, x0): (usize, usize), row: &mut [f32]) {
        let (j, fy) = (y / STEP, (y % STEP) as f32 / STEP as f32);
        let line = |j: usize| self.values.get(j * self.columns..(j + 1) * self.columns);
        let (Some(upper), Some(lower)) = (line(j), line(j + 1)) else {
            row.fill(0.0);
            return;
        };
        let at = |i: usize| upper[i] + (lower[i] - upper[i]) * fy;
        let (first, ahead) = (x0 / STEP, x0 % STEP);
        // Up to the first column of the grid, then from one to the next.
        let (before, rest) = row.split_at_mut(((STEP - ahead) % STEP).min(row.len()));
        let whole = first + usize::from(ahead > 0);
        let slope = |i: usize| (at(i + 1) - at(i)) / STEP as f32;
        for (k, value) in before.iter_mut().enumerate() {
            *value *= at(first) + slope(first) * (ahead + k) as f32;
        }
        let mut from = at(whole);
        let nodes = upper[whole + 1..].iter().zip(&lower[whole + 1..]);
        for (part, (upper, lower)) in rest.chunks_mut(STEP).zip(nodes) {
            let to = upper + (lower - upper) * fy;
            let slope = (to - from) / STEP as f32;
            if let Some(part) = part.first_chunk_mut::<STEP>() {
                for (k, value) in part.iter_mut().enumerate() {
                    *value *= from + slope * k as f32;
                }
            } else {
                for (k, value) in part.iter_mut().enumerate() {
                    *value *= from + slope * k as f32;
                }
            }
            from = to;
        }
    }
}

/// The work of [`LightGrid::shine`].
struct Shining<'a> {
    light: &'a LightGrid,
    start: (usize, usize),
    row: &'a mut [f32],
}

impl Vectorized for Shining<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.light.shine_on(self.start, self.row);
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

    use super::*;
    use crate::Camera;

    #[test]
    fn a_thin_shadow_has_straight_edges() {
        // Half a metre above the table, looking down, rolled by 25 degrees.
        let down = UnitQuaternion::from_euler_angles(std::f64::consts::PI, 0.0, 25.0_f64.to_radians());
        let pose = Isometry3::from_parts(Translation3::new(0.0, 0.0, 0.5), down);
        let view = View::new(&Camera::paper(), pose);
        let plane = view.plane(&Point3::origin(), &Vector3::x(), &Vector3::y());
        // A strip of shadow 12 mm wide, 24 pixels, with a penumbra of 4 mm.
        let light = |x: f64, _: f64| ((x.abs() - 0.004) / 0.004).clamp(0.1, 1.0) as f32;
        let mut grid = LightGrid::default();
        grid.lay(&view, &plane, light);
        let (mut worst, mut sum) = (0.0_f64, 0.0);
        for y in 0..view.height {
            // Rows need not begin at a node.
            let x0 = y % 7;
            let mut row = vec![1.0_f32; view.width - x0];
            grid.shine(y, x0, &mut row);
            for (x, value) in (x0..).zip(&row) {
                let p = plane * Vector3::new(x as f64, y as f64, 1.0);
                let error = f64::from((value - light(p.x / p.z, p.y / p.z)).abs());
                worst = worst.max(error);
                sum += error;
            }
        }
        let mean = sum / (view.width * view.height) as f64;
        assert!(worst < 0.2 && mean < 0.003, "{worst} {mean}");
    }
}
