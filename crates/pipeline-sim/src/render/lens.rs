//! Distortion and defocus of the lens.

use hough_heuristic::{Vectorized, widest};
use nalgebra::{Point2, Vector2};

use crate::cell::camera::Camera;
use crate::render::canvas::Canvas;

/// Pixels, at most, from one place to the next at which a distortion is undone exactly; and parts
/// of the focal length.
const STEP: (f64, f64) = (16.0, 1.0 / 60.0);
/// Greatest distance of places between which pixels of a row are interpolated linearly.
const RUN: (f64, f64) = (WHOLE_RUN as f64, 1.0 / 250.0);
const WHOLE_RUN: usize = 4;

/// The map from a distorted frame to the ideal one it is taken from.
///
/// A distortion is undone exactly on a coarse grid. Between, cubic polynomials tell where every
/// fourth pixel of every row comes from (every one in small frames), and those that follow lie on a
/// straight line to the next: in all within .005 pixels of the exact place for lenses whose corners
/// move by up to a tenth of the frame's width.
#[derive(Clone, Debug)]
pub(super) struct Warp {
    camera: Camera,
    /// The ideal camera, large enough to hold all that the distorted frame shows.
    pub(super) ideal: Camera,
    /// Pixels from one of the sources to the next.
    run: usize,
    /// Source places of pixels 0, `run`, ... and the last, row after row.
    sources: Vec<[f32; 2]>,
    /// Number of sources in a row.
    columns: usize,
}

impl Warp {
    /// Returns `None` for a camera without distortion. Otherwise the ideal frame is larger, by less
    /// than a factor of three for a radial distortion that does not fold.
    pub(super) fn new(camera: &Camera) -> Option<Self> {
        if camera.distortion().is_none() {
            return None;
        }
        let (width, height) = camera.size();
        let (focal, principal) = (camera.focal_px(), camera.principal_point());
        let pixels = |(most, part): (f64, f64)| (part * focal).clamp(1.0, most);
        let step = pixels(STEP);
        let (across, down) = (
            Nodes::new(width as usize, step),
            Nodes::new(height as usize, step),
        );
        // The last answer is the start for the next.
        let mut last = (Point2::origin(), Point2::origin());
        let mut exact = |x: f64, y: f64| {
            let shown = Point2::from((Point2::new(x, y) - principal) / focal);
            let undone = camera.distortion().undistort_near(shown, last);
            last = (shown, undone.unwrap_or(last.1));
            principal.coords + last.1.coords * focal
        };
        let grid: Vec<Vector2<f64>> = (0..down.count)
            .flat_map(|j| (0..across.count).map(move |i| (i, j)))
            .map(|(i, j)| exact(across.place(i), down.place(j)))
            .collect();
        let low = grid
            .iter()
            .fold(Vector2::zeros(), |a: Vector2<f64>, p| a.inf(p));
        let high = grid
            .iter()
            .fold(Vector2::zeros(), |a: Vector2<f64>, p| a.sup(p));
        let (low, high) = (low.map(|v| v.floor() - 1.0), high.map(|v| v.ceil() + 2.0));
        let (w, h) = ((high.x - low.x + 1.0) as u32, (high.y - low.y + 1.0) as u32);
        let ideal = Camera::ideal(focal, principal - low, w, h);
        let run = pixels(RUN) as usize;
        let runs = (width as usize).div_ceil(run);
        let ends: Vec<usize> = (0..=runs)
            .map(|k| (k * run).min(width as usize - 1))
            .collect();
        let shares: Vec<(usize, [f64; 4])> = ends.iter().map(|x| across.shares(*x)).collect();
        let mut sources = vec![[0.0; 2]; ends.len() * height as usize];
        let mut row = vec![[0.0; 2]; across.count];
        for (y, sources) in sources.chunks_exact_mut(ends.len()).enumerate() {
            let (top, weights) = down.shares(y);
            let nodes = |k: usize| &grid[(top + k) * across.count..][..across.count];
            let four = nodes(0).iter().zip(nodes(1)).zip(nodes(2)).zip(nodes(3));
            for (place, (((a, b), c), d)) in row.iter_mut().zip(four) {
                let p = a * weights[0] + b * weights[1] + c * weights[2] + d * weights[3] - low;
                *place = [p.x, p.y];
            }
            widest(Sources {
                row: &row,
                shares: &shares,
                sources,
            });
        }
        Some(Self {
            camera: *camera,
            ideal,
            run,
            sources,
            columns: ends.len(),
        })
    }

    /// Returns `true` if this warp belongs to a camera.
    pub(super) fn is_for(&self, camera: &Camera) -> bool {
        self.camera == *camera
    }

    /// Takes every pixel of `out` from `ideal`.
    pub(super) fn apply(&self, ideal: &Canvas, out: &mut Canvas) {
        widest(Applying {
            warp: self,
            ideal,
            out,
        });
    }

    #[inline(always)]
    fn apply_rows(&self, ideal: &Canvas, out: &mut Canvas) {
        let (w, width) = (ideal.width, out.width);
        // Whole pixels and their 65536ths; no frame is so large that these do not fit.
        let fixed = |v: f32| (v * 65536.0) as i32;
        let part = |v: i32| (v & 0xffff) as f32 / 65536.0;
        let (mut x, mut y, mut places) =
            (vec![0_i32; width], vec![0_i32; width], vec![0_u32; width]);
        // Of each pixel the two above its place, and the two below.
        let (mut upper, mut lower) = (vec![[0.0_f32; 2]; width], vec![[0.0_f32; 2]; width]);
        let rows = out.light.chunks_exact_mut(width.max(1));
        for (row, sources) in rows.zip(self.sources.chunks_exact(self.columns)) {
            // The last place of a row is that of its last pixel.
            let last = (self.columns - 2) * self.run;
            if let Some(ends) = sources.windows(2).last() {
                let length = (width - 1 - last).max(1) as f32;
                let from = ends[0].map(fixed);
                let step = [0, 1].map(|c| fixed((ends[1][c] - ends[0][c]) / length));
                for ((x, y), i) in x[last..].iter_mut().zip(&mut y[last..]).zip(0..) {
                    (*x, *y) = (from[0] + i * step[0], from[1] + i * step[1]);
                }
            }
            for (c, line) in [&mut x[..last], &mut y[..last]].into_iter().enumerate() {
                let ends = sources.windows(2).map(|ends| (ends[0][c], ends[1][c]));
                if self.run == WHOLE_RUN {
                    for (run, (from, to)) in
                        line.as_chunks_mut::<WHOLE_RUN>().0.iter_mut().zip(ends)
                    {
                        let (at, step) =
                            (fixed(from), fixed((to - from) * (1.0 / WHOLE_RUN as f32)));
                        *run = [at, at + step, at + 2 * step, at + 3 * step];
                    }
                } else {
                    for (run, (from, to)) in line.chunks_mut(self.run).zip(ends) {
                        let step = fixed((to - from) / self.run as f32);
                        for (at, i) in run.iter_mut().zip(0..) {
                            *at = fixed(from) + i * step;
                        }
                    }
                }
            }
            for ((place, x), y) in places.iter_mut().zip(&x).zip(&y) {
                *place = (y >> 16) as u32 * w as u32 + (x >> 16) as u32;
            }
            for ((upper, lower), place) in upper.iter_mut().zip(&mut lower).zip(&places) {
                if let Some(four) = ideal.light.get(*place as usize..*place as usize + w + 2) {
                    *upper = [four[0], four[1]];
                    *lower = [four[w], four[w + 1]];
                }
            }
            let pairs = upper.iter().zip(&lower).zip(x.iter().zip(&y));
            for (light, (([a, b], [c, d]), (x, y))) in row.iter_mut().zip(pairs) {
                let (upper, lower) = (a + (b - a) * part(*x), c + (d - c) * part(*x));
                *light = upper + (lower - upper) * part(*y);
            }
        }
    }
}

/// Arguments of [`Warp::apply`].
struct Applying<'a> {
    warp: &'a Warp,
    ideal: &'a Canvas,
    out: &'a mut Canvas,
}

impl Vectorized for Applying<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.warp.apply_rows(self.ideal, self.out);
    }
}

/// Writes the places that pixels of a row are taken from.
struct Sources<'a> {
    /// Places at the nodes of the row.
    row: &'a [[f64; 2]],
    /// First of four nodes for each place, and their weights.
    shares: &'a [(usize, [f64; 4])],
    sources: &'a mut [[f32; 2]],
}

impl Vectorized for Sources<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (source, (left, w)) in self.sources.iter_mut().zip(self.shares) {
            let Some([n0, n1, n2, n3]) = self.row.get(*left..).and_then(|row| row.first_chunk())
            else {
                continue;
            };
            for c in 0..2 {
                source[c] = (n0[c] * w[0] + n1[c] * w[1] + n2[c] * w[2] + n3[c] * w[3]) as f32;
            }
        }
    }
}

/// Evenly spaced places from the first to the last of a number of pixels.
struct Nodes {
    /// Number of nodes, at least four.
    count: usize,
    spacing: f64,
}

impl Nodes {
    /// Creates nodes at most `step` apart.
    fn new(length: usize, step: f64) -> Self {
        let last = length.saturating_sub(1);
        let count = ((last as f64 / step).ceil() as usize).max(3) + 1;
        Self {
            count,
            spacing: last as f64 / (count - 1) as f64,
        }
    }

    fn place(&self, node: usize) -> f64 {
        node as f64 * self.spacing
    }

    /// Returns the first of the four nodes next to a pixel, and their weights in the cubic through
    /// them.
    fn shares(&self, pixel: usize) -> (usize, [f64; 4]) {
        if self.spacing <= 0.0 {
            return (0, [1.0, 0.0, 0.0, 0.0]);
        }
        let at = pixel as f64 / self.spacing;
        let first = (at.floor().max(1.0) as usize - 1).min(self.count - 4);
        let t = at - first as f64;
        let (a, b, c, d) = (t, t - 1.0, t - 2.0, t - 3.0);
        (
            first,
            [
                -b * c * d / 6.0,
                a * c * d / 2.0,
                -a * b * d / 2.0,
                a * b * c / 6.0,
            ],
        )
    }
}

/// Blurs `values`, rows of `width` pixels, with the sensor's three taps along each axis
/// ([`Sensor::blur`](crate::render::scene::Sensor::blur)). The fields of an interlaced frame are
/// blurred before they are woven.
pub(super) fn soften(values: &mut [f32], width: usize, sigma: f64, spare: &mut Vec<f32>) {
    let taps = three_taps(sigma);
    if values.is_empty() || taps.0 <= 0.0 {
        return;
    }
    // Two rows as they were, and a row with a pixel more at either end.
    spare.resize(spare.len().max(3 * width + 2), 0.0);
    widest(Softening {
        values,
        width,
        taps,
        spare,
    });
}

/// Arguments of [`soften`].
struct Softening<'a> {
    values: &'a mut [f32],
    width: usize,
    taps: (f32, f32),
    spare: &'a mut [f32],
}

impl Vectorized for Softening<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { values, width, .. } = self;
        let (side, middle) = self.taps;
        let height = values.len() / width;
        let (mut above, rest) = self.spare.split_at_mut(width);
        let (mut here, mixed) = rest.split_at_mut(width);
        let mixed = &mut mixed[..width + 2];
        here.copy_from_slice(&values[..width]);
        above.copy_from_slice(here);
        for y in 0..height {
            let below = &values[(y + 1).min(height - 1) * width..][..width];
            let rows = above.iter().zip(&*here).zip(below);
            for (m, ((a, c), b)) in mixed[1..=width].iter_mut().zip(rows) {
                *m = middle * c + side * (a + b);
            }
            std::mem::swap(&mut above, &mut here);
            here.copy_from_slice(below);
            mixed[0] = mixed[1];
            mixed[width + 1] = mixed[width];
            let sides = mixed.iter().zip(&mixed[2..]);
            let out = &mut values[y * width..][..width];
            for ((o, c), (l, r)) in out.iter_mut().zip(&mixed[1..]).zip(sides) {
                *o = middle * c + side * (l + r);
            }
        }
    }
}

/// Returns side and middle weight of the three-tap kernel of variance sigma², or the widest kernel
/// of three taps.
pub(super) fn three_taps(sigma: f64) -> (f32, f32) {
    let side = (0.5 * sigma * sigma).clamp(0.0, 0.333) as f32;
    (side, 1.0 - 2.0 * side)
}

/// Pixels that are blurred at a time, so that their sums stay in registers.
const BLOCK: usize = 32;

/// Blurs the whole canvas by a Gaussian of standard deviation `sigma` pixels.
pub(super) fn defocus(canvas: &mut Canvas, sigma: f64, spare: &mut Vec<f32>) {
    let reach = (2.5 * sigma).ceil().min(40.0) as usize;
    if sigma.is_nan() || sigma <= 0.0 || reach == 0 || canvas.light.is_empty() {
        return;
    }
    let mut kernel: Vec<f32> = (0..=reach)
        .map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp() as f32)
        .collect();
    let sum = kernel[0] + 2.0 * kernel[1..].iter().sum::<f32>();
    kernel.iter_mut().for_each(|k| *k /= sum);
    kernel[0] *= 0.5;
    let (w, h) = (canvas.width, canvas.height);
    let needed = w * h + w + 2 * reach;
    if spare.len() < needed {
        spare.resize(needed, 0.0);
    }
    let (mixed, padded) = spare[..needed].split_at_mut(w * h);
    for y in 0..h {
        let pairs = kernel.iter().enumerate().map(|(i, k)| {
            let (above, below) = (y.saturating_sub(i), (y + i).min(h - 1));
            (
                *k,
                &canvas.light[above * w..][..w],
                &canvas.light[below * w..][..w],
            )
        });
        weigh(&pairs, &mut mixed[y * w..][..w]);
    }
    for (row, out) in mixed.chunks_exact(w).zip(canvas.light.chunks_exact_mut(w)) {
        padded[..reach].fill(row[0]);
        padded[reach..reach + w].copy_from_slice(row);
        padded[reach + w..].fill(row[w - 1]);
        let pairs = kernel.iter().enumerate();
        let pairs = pairs.map(|(i, k)| (*k, &padded[reach - i..][..w], &padded[reach + i..][..w]));
        weigh(&pairs, out);
    }
}

/// Computes the sum of pairs of rows, each with its weight.
fn weigh<'a>(pairs: &(impl Iterator<Item = (f32, &'a [f32], &'a [f32])> + Clone), out: &mut [f32]) {
    widest(Weighing { pairs, out });
}

/// Arguments of [`weigh`].
struct Weighing<'a, P> {
    pairs: &'a P,
    out: &'a mut [f32],
}

impl<'a, P: Iterator<Item = (f32, &'a [f32], &'a [f32])> + Clone> Vectorized for Weighing<'_, P> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        weigh_blocks(self.pairs, self.out);
    }
}

#[inline(always)]
fn weigh_blocks<'a>(
    pairs: &(impl Iterator<Item = (f32, &'a [f32], &'a [f32])> + Clone),
    out: &mut [f32],
) {
    let mut at = 0;
    let mut blocks = out.chunks_exact_mut(BLOCK);
    for block in &mut blocks {
        let mut sums = [0.0_f32; BLOCK];
        for (k, a, b) in pairs.clone() {
            let (Some(a), Some(b)) = (
                a[at..].first_chunk::<BLOCK>(),
                b[at..].first_chunk::<BLOCK>(),
            ) else {
                continue;
            };
            for i in 0..BLOCK {
                sums[i] += k * (a[i] + b[i]);
            }
        }
        block.copy_from_slice(&sums);
        at += BLOCK;
    }
    for (i, value) in blocks.into_remainder().iter_mut().enumerate() {
        *value = pairs
            .clone()
            .map(|(k, a, b)| k * (a[at + i] + b[at + i]))
            .sum();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::distortion::Distortion;

    /// Returns the greatest error of the places that pixels are taken from.
    fn worst(camera: &Camera) -> f64 {
        let warp = Warp::new(camera).expect("distorts");
        let (width, height) = camera.size();
        let mut worst = 0.0_f64;
        for (x, y) in (0..height)
            .step_by(3)
            .flat_map(|y| (0..width).step_by(5).map(move |x| (x, y)))
        {
            let ray = camera
                .ray(Point2::new(f64::from(x), f64::from(y)))
                .expect("shown");
            let exact = warp.ideal.principal_point() + ray.xy() * camera.focal_px();
            let run = &warp.sources[y as usize * warp.columns + x as usize / warp.run..];
            let (from, to) = (run[0].map(f64::from), run[1].map(f64::from));
            let start = x as usize / warp.run * warp.run;
            let length = warp.run.min((width as usize - 1 - start).max(1));
            let part = (x as usize - start) as f64 / length as f64;
            let taken = Point2::new(
                from[0] + part * (to[0] - from[0]),
                from[1] + part * (to[1] - from[1]),
            );
            worst = worst.max((taken - exact).norm());
        }
        worst
    }

    #[test]
    fn every_pixel_is_taken_from_where_the_lens_has_it() {
        for (k1, k2) in [(-0.35, 0.08), (-0.1, 0.0), (0.6, 0.0)] {
            let lens = Distortion {
                k1,
                k2,
                ..Distortion::default()
            };
            let camera = Camera::paper()
                .with_distortion(lens)
                .expect("does not fold");
            let off = worst(&camera);
            assert!(off < 0.005, "{k1} {k2}: {off}");
            for (width, height) in [(769, 577), (192, 144), (62, 46), (8, 6), (5, 2), (1, 1)] {
                let small = camera.resized(width, height).expect("does not fold");
                let off = worst(&small);
                assert!(off < 0.005, "{k1} {k2} {width}x{height}: {off}");
                let warp = Warp::new(&small).expect("distorts");
                let (w, h) = warp.ideal.size();
                let mut ideal = Canvas::new(w as usize, h as usize);
                ideal.light.fill(0.5);
                let mut out = Canvas::new(width as usize, height as usize);
                warp.apply(&ideal, &mut out);
                assert!(
                    out.light.iter().all(|v| (v - 0.5).abs() < 1e-6),
                    "{width}x{height}"
                );
            }
        }
    }

    #[test]
    fn defocus_is_a_gaussian_cut_off_at_two_and_a_half_deviations() {
        // Neither side is a multiple of a block; the border is continued.
        let (w, h) = (53_usize, 41_usize);
        let mut state = 1_u32;
        let light: Vec<f32> = (0..w * h)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 8) as f32 / 16_777_216.0
            })
            .collect();
        for sigma in [0.6, 1.0, 2.3, 3.5] {
            let mut canvas = Canvas::new(w, h);
            canvas.light.copy_from_slice(&light);
            defocus(&mut canvas, sigma, &mut Vec::new());
            let reach = (2.5 * sigma).ceil() as i64;
            let weight = |d: i64| (-0.5 * (d as f64 / sigma).powi(2)).exp();
            let sum: f64 = (-reach..=reach).map(weight).sum();
            for (x, y) in [(0_i64, 0_i64), (26, 20), (52, 40), (50, 3), (15, 40)] {
                let at = |x: i64, y: i64| {
                    let (x, y) = (x.clamp(0, w as i64 - 1), y.clamp(0, h as i64 - 1));
                    f64::from(light[y as usize * w + x as usize])
                };
                let exact: f64 = (-reach..=reach)
                    .flat_map(|j| (-reach..=reach).map(move |i| (i, j)))
                    .map(|(i, j)| weight(i) * weight(j) * at(x + i, y + j))
                    .sum::<f64>()
                    / (sum * sum);
                let blurred = f64::from(canvas.light[y as usize * w + x as usize]);
                assert!(
                    (blurred - exact).abs() < 1e-5,
                    "{sigma} {x} {y}: {blurred} {exact}"
                );
            }
        }
    }
}
