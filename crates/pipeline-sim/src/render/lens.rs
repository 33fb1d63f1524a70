//! Distortion of the lens.

use hough_heuristic::Vectorized;
use nalgebra::{Point2, Vector2};

use crate::cell::camera::Camera;
use crate::render::canvas::Canvas;

/// Largest distance of the places at which a distortion is undone exactly: pixels, and parts of the
/// focal length.
const STEP: (f64, f64) = (16.0, 1.0 / 60.0);
/// Largest distance of the places in a row between which pixels are interpolated linearly: pixels,
/// and parts of the focal length.
const RUN: (f64, f64) = (WHOLE_RUN as f64, 1.0 / 250.0);
const WHOLE_RUN: usize = 4;

/// The map from a distorted frame to the ideal one it is taken from.
///
/// A distortion is undone exactly on a coarse grid. Cubic polynomials between its places give the
/// source of every fourth pixel of every row (of every pixel in small frames). The sources of the
/// other pixels are interpolated linearly. The result is within 0.005 pixels of the exact place for
/// lenses that move the corners by up to a tenth of the frame's width.
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
    /// Creates the map for a camera; `None` for a camera without distortion. The ideal
    /// (undistorted) frame is larger than the distorted one: less than three times as wide for a
    /// radial distortion that does not fold.
    pub(super) fn new(camera: &Camera) -> Option<Self> {
        if camera.distortion().is_none() {
            return None;
        }
        let (width, height) = camera.size();
        let (focal, principal) = (camera.focal_px(), camera.principal_point());
        let pixels = |(most, part): (f64, f64)| (part * focal).clamp(1.0, most);
        let step = pixels(STEP);
        let across = Nodes::new(width as usize, step);
        let down = Nodes::new(height as usize, step);
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
        let zero = Vector2::zeros();
        let low = grid.iter().fold(zero, |a: Vector2<f64>, p| a.inf(p));
        let high = grid.iter().fold(zero, |a: Vector2<f64>, p| a.sup(p));
        let (low, high) = (low.map(|v| v.floor() - 1.0), high.map(|v| v.ceil() + 2.0));
        let (w, h) = ((high.x - low.x + 1.0) as u32, (high.y - low.y + 1.0) as u32);
        let ideal = Camera::ideal(focal, principal - low, w, h);
        let run = pixels(RUN) as usize;
        let runs = (width as usize).div_ceil(run);
        let ends = (0..=runs).map(|k| (k * run).min(width as usize - 1));
        let shares: Vec<(usize, [f64; 4])> = ends.map(|x| across.shares(x)).collect();
        let columns = shares.len();
        let mut sources = vec![[0.0; 2]; columns * height as usize];
        let mut row = vec![[0.0; 2]; across.count];
        for (y, sources) in sources.chunks_exact_mut(columns).enumerate() {
            let (top, weights) = down.shares(y);
            let nodes = |k: usize| &grid[(top + k) * across.count..][..across.count];
            let four = nodes(0).iter().zip(nodes(1)).zip(nodes(2)).zip(nodes(3));
            for (place, (((a, b), c), d)) in row.iter_mut().zip(four) {
                let p = a * weights[0] + b * weights[1] + c * weights[2] + d * weights[3] - low;
                *place = [p.x, p.y];
            }
            Sources(&row, &shares, sources).widest();
        }
        Some(Self {
            camera: *camera,
            ideal,
            run,
            sources,
            columns,
        })
    }

    /// Returns `true` if this warp belongs to a camera.
    pub(super) fn is_for(&self, camera: &Camera) -> bool {
        self.camera == *camera
    }

    /// Takes every pixel of `out` from `ideal`.
    pub(super) fn apply(&self, ideal: &Canvas, out: &mut Canvas) {
        Applying(self, ideal, out).widest();
    }
}

/// Arguments of [`Warp::apply`].
struct Applying<'a>(&'a Warp, &'a Canvas, &'a mut Canvas);

impl Vectorized for Applying<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self(warp, ideal, out) = self;
        let (w, width) = (ideal.width, out.width);
        // Whole pixels and their 65536ths; no frame is so large that these do not fit.
        let fixed = |v: f32| (v * 65536.0) as i32;
        let part = |v: i32| (v & 0xffff) as f32 / 65536.0;
        let (mut x, mut y, mut places) =
            (vec![0_i32; width], vec![0_i32; width], vec![0_u32; width]);
        // Of each pixel the two above its place, and the two below.
        let (mut upper, mut lower) = (vec![[0.0_f32; 2]; width], vec![[0.0_f32; 2]; width]);
        let rows = out.light.chunks_exact_mut(width.max(1));
        for (row, sources) in rows.zip(warp.sources.chunks_exact(warp.columns)) {
            // The last place of a row is that of its last pixel.
            let last = (warp.columns - 2) * warp.run;
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
                if warp.run == WHOLE_RUN {
                    let runs = line.as_chunks_mut::<WHOLE_RUN>().0;
                    for (run, (from, to)) in runs.iter_mut().zip(ends) {
                        let at = fixed(from);
                        let step = fixed((to - from) * (1.0 / WHOLE_RUN as f32));
                        *run = [at, at + step, at + 2 * step, at + 3 * step];
                    }
                } else {
                    for (run, (from, to)) in line.chunks_mut(warp.run).zip(ends) {
                        let step = fixed((to - from) / warp.run as f32);
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

/// Writes the places that pixels of a row are taken from.
///
/// From the places at the nodes of the row, and the first of four nodes for each source with their
/// weights.
struct Sources<'a>(&'a [[f64; 2]], &'a [(usize, [f64; 4])], &'a mut [[f32; 2]]);

impl Vectorized for Sources<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self(row, shares, sources) = self;
        for (source, (left, w)) in sources.iter_mut().zip(shares) {
            let four = row.get(*left..).and_then(|row| row.first_chunk());
            let Some([n0, n1, n2, n3]) = four else {
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
        let outer = [-b * c * d / 6.0, a * b * c / 6.0];
        (
            first,
            [outer[0], a * c * d / 2.0, -a * b * d / 2.0, outer[1]],
        )
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
    fn pixels_are_taken_from_their_exact_places() {
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
}
