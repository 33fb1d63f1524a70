//! Slowly varying light on the table, computed at few pixels and interpolated between them.

use hough_heuristic::Vectorized;
use nalgebra::{Matrix3, Vector3};

use crate::render::view::View;

/// Distance of the nodes along both axes, pixels.
const STEP: usize = 4;

/// Greatest difference of two nodes that count as alike, relative to their sum.
const ALIKE: f32 = 0.01;

/// A source of light on a plane.
pub(super) trait Lighting {
    /// Writes the light at places of the plane; `spare` holds twice as many numbers.
    /// Implementations are `#[inline(always)]`.
    fn shed(&self, x: &[f32], y: &[f32], light: &mut [f32], spare: &mut [f32]);
}

/// Light at every [`STEP`]th column of every [`STEP`]th row.
#[derive(Clone, Debug, Default)]
pub(super) struct LightGrid {
    columns: usize,
    values: Vec<f32>,
    row: Row,
}

/// Nodes of a row at which the light is computed.
#[derive(Clone, Debug, Default)]
struct Row {
    /// Columns of the nodes.
    wanted: Vec<u32>,
    /// Their places on the plane, 1 or 0 if the ray meets the plane or not, the light there, and
    /// scratch space.
    x: Vec<f32>,
    y: Vec<f32>,
    met: Vec<f32>,
    light: Vec<f32>,
    spare: Vec<f32>,
}

impl Row {
    /// Computes the light at the wanted nodes, pixels `step` apart from `start` on, and writes it
    /// to their places in `values`.
    #[inline(always)]
    fn work_out(
        &mut self,
        (start, step): (Vector3<f64>, Vector3<f64>),
        lighting: &impl Lighting,
        values: &mut [f32],
    ) {
        let n = self.wanted.len();
        let places = self.x[..n].iter_mut().zip(&mut self.y[..n]);
        for (((x, y), met), i) in places.zip(&mut self.met).zip(&self.wanted) {
            let i = f64::from(*i as i32);
            let z = start.z + step.z * i;
            let before = z > 0.0;
            let w = if before { 1.0 / z } else { 0.0 };
            *x = ((start.x + step.x * i) * w) as f32;
            *y = ((start.y + step.y * i) * w) as f32;
            *met = if before { 1.0 } else { 0.0 };
        }
        let light = &mut self.light[..n];
        lighting.shed(&self.x[..n], &self.y[..n], light, &mut self.spare[..2 * n]);
        for ((light, met), i) in light.iter().zip(&self.met).zip(&self.wanted) {
            values[*i as usize] = light * met;
        }
    }
}

impl LightGrid {
    /// Computes the light at the nodes whose rays meet the plane; the others are dark. Every second
    /// node along both axes is interpolated where its neighbours are alike.
    pub(super) fn lay(&mut self, view: &View, plane: &Matrix3<f64>, lighting: &impl Lighting) {
        Laying(self, (view.width, view.height), plane, lighting).widest();
    }

    /// Multiplies the pixels x0.. of row y by the light on them.
    pub(super) fn shine(&self, y: usize, x0: usize, row: &mut [f32]) {
        Shining(self, (y, x0), row).widest();
    }
}

/// Arguments of [`LightGrid::lay`].
struct Laying<'a, L>(&'a mut LightGrid, (usize, usize), &'a Matrix3<f64>, &'a L);

impl<L: Lighting> Vectorized for Laying<'_, L> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self(grid, (width, height), plane, lighting) = self;
        let nodes = |pixels: usize| pixels / (2 * STEP) * 2 + 3;
        let (columns, rows) = (nodes(width), nodes(height));
        grid.columns = columns;
        grid.values.resize(columns * rows, 0.0);
        let row = &mut grid.row;
        for list in [&mut row.x, &mut row.y, &mut row.met, &mut row.light] {
            list.resize(columns, 0.0);
        }
        row.spare.resize(2 * columns, 0.0);
        let step = plane.column(0) * STEP as f64;
        let line = |j: usize| (plane.column(2) + plane.column(1) * (j * STEP) as f64, step);
        for j in (0..rows).step_by(2) {
            row.wanted.clear();
            row.wanted.extend((0..columns as u32).step_by(2));
            row.work_out(
                line(j),
                lighting,
                &mut grid.values[j * columns..][..columns],
            );
        }
        let alike = |a: f32, b: f32| (a - b).abs() <= ALIKE * (a + b);
        for j in 0..rows {
            row.wanted.clear();
            let (before, rest) = grid.values.split_at_mut(j * columns);
            let (here, after) = rest.split_at_mut(columns);
            if j % 2 == 0 {
                for i in (1..columns).step_by(2) {
                    let (a, b) = (here[i - 1], here[i + 1]);
                    here[i] = 0.5 * (a + b);
                    if !alike(a, b) {
                        row.wanted.push(i as u32);
                    }
                }
            } else {
                let (above, below) = (&before[before.len() - columns..], &after[..columns]);
                for i in 0..columns {
                    let odd = i % 2;
                    let (a, b) = (above[i - odd], below[i + odd]);
                    let (c, d) = (above[i + odd], below[i - odd]);
                    let (down, up) = (0.5 * (a + b), 0.5 * (c + d));
                    here[i] = 0.5 * (down + up);
                    if !(alike(a, b) && alike(c, d) && alike(down, up)) {
                        row.wanted.push(i as u32);
                    }
                }
            }
            if !row.wanted.is_empty() {
                row.work_out(line(j), lighting, here);
            }
        }
    }
}

/// Arguments of [`LightGrid::shine`].
struct Shining<'a>(&'a LightGrid, (usize, usize), &'a mut [f32]);

impl Vectorized for Shining<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self(light, (y, x0), row) = self;
        let (j, fy) = (y / STEP, (y % STEP) as f32 / STEP as f32);
        let line = |j: usize| light.values.get(j * light.columns..(j + 1) * light.columns);
        let (Some(upper), Some(lower)) = (line(j), line(j + 1)) else {
            row.fill(0.0);
            return;
        };
        let at = |i: usize| upper[i] + (lower[i] - upper[i]) * fy;
        let (first, ahead) = (x0 / STEP, x0 % STEP);
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
            if let Some(whole) = part.first_chunk_mut::<STEP>() {
                shade(whole, from, slope);
            } else {
                shade(part, from, slope);
            }
            from = to;
        }
    }
}

/// Multiplies pixels by light that begins at `from` and changes by `slope` from one to the next.
#[inline(always)]
fn shade(pixels: &mut [f32], from: f32, slope: f32) {
    for (k, value) in pixels.iter_mut().enumerate() {
        *value *= from + slope * k as f32;
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};

    use super::*;
    use crate::cell::camera::Camera;

    /// A strip of shadow 12 mm wide along y, with a penumbra of 4 mm.
    struct Strip;

    fn strip(x: f32) -> f32 {
        ((x.abs() - 0.004) / 0.004).clamp(0.1, 1.0)
    }

    impl Lighting for Strip {
        #[inline(always)]
        fn shed(&self, x: &[f32], _: &[f32], light: &mut [f32], _: &mut [f32]) {
            light
                .iter_mut()
                .zip(x)
                .for_each(|(light, x)| *light = strip(*x));
        }
    }

    #[test]
    fn thin_shadow_has_straight_edges() {
        // Half a metre above the table, looking down, rolled by 25 degrees.
        let down =
            UnitQuaternion::from_euler_angles(std::f64::consts::PI, 0.0, 25.0_f64.to_radians());
        let pose = Isometry3::from_parts(Translation3::new(0.0, 0.0, 0.5), down);
        let view = View::new(&Camera::paper(), pose);
        let plane = view.plane(&Point3::origin(), &Vector3::x(), &Vector3::y());
        // The shadow is 24 pixels wide.
        let mut grid = LightGrid::default();
        grid.lay(&view, &plane, &Strip);
        let (mut worst, mut sum) = (0.0_f64, 0.0);
        for y in 0..view.height {
            // Rows need not begin at a node.
            let x0 = y % 7;
            let mut row = vec![1.0_f32; view.width - x0];
            grid.shine(y, x0, &mut row);
            for (x, value) in (x0..).zip(&row) {
                let p = plane * Vector3::new(x as f64, y as f64, 1.0);
                let error = f64::from((value - strip((p.x / p.z) as f32)).abs());
                worst = worst.max(error);
                sum += error;
            }
        }
        let mean = sum / (view.width * view.height) as f64;
        assert!(worst < 0.2 && mean < 0.003, "{worst} {mean}");
    }
}
