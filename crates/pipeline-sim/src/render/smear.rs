//! A layer in motion: drawn once, in the middle of the exposure, and averaged along the way that
//! every pixel's content takes.

use hough_heuristic::{Vectorized, widest};
use nalgebra::{Matrix3, Point2, Vector2, Vector3};

use crate::render::canvas::{Area, Canvas};

/// Side of the squares of pixels that are taken to move alike.
const SQUARE: usize = 16;
/// Numbers that are worked on at once.
const LANES: usize = 8;
/// Motion of less than this is none, pixels.
const STILL: f64 = 0.01;

/// Where, in the layer as drawn, the content of a frame's pixels is to be found: when the shutter
/// of a field opens and when it closes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sweep {
    pub(super) opened: Matrix3<f64>,
    pub(super) closed: Matrix3<f64>,
}

/// Where a map has a pixel.
#[inline(always)]
pub(super) fn mapped(map: &Matrix3<f64>, p: Point2<f64>) -> Point2<f64> {
    let q = map * Vector3::new(p.x, p.y, 1.0);
    Point2::new(q.x / q.z, q.y / q.z)
}

/// The affine map that takes `from` nearest to `to` (least squares); `None` for fewer than three
/// points, or points in a line.
pub(super) fn affine(from: &[Point2<f64>], to: &[Point2<f64>]) -> Option<Matrix3<f64>> {
    let n = from.len().min(to.len()) as f64;
    let mean = |points: &[Point2<f64>]| points.iter().map(|p| p.coords).sum::<Vector2<f64>>() / n;
    let (a, b) = (mean(from), mean(to));
    let (mut spread, mut cross) = (nalgebra::Matrix2::zeros(), nalgebra::Matrix2::zeros());
    for (p, q) in from.iter().zip(to) {
        let (p, q) = (p.coords - a, q.coords - b);
        spread += p * p.transpose();
        cross += q * p.transpose();
    }
    let linear = cross * spread.try_inverse()?;
    let shift = b - linear * a;
    let map = Matrix3::new(
        linear.m11, linear.m12, shift.x, linear.m21, linear.m22, shift.y, 0.0, 0.0, 1.0,
    );
    map.iter().all(|v| v.is_finite()).then_some(map)
}

/// The shares that pixels of a layer have in a pixel of the frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Smear {
    /// Distance in the layer's buffer, and share.
    taps: Vec<(isize, f32)>,
}

impl Smear {
    /// Lays `layer` in motion over `out`: row y of `out` moves as `sweeps[y % sweeps.len()]` says.
    /// Where the layer has no coverage of its own it replaces what is below.
    ///
    /// The layer is larger than `out` by `margin` pixels on every side; `area` is what of `out` may
    /// be reached. Within a square of 16 pixels all move as its middle does, on a straight line;
    /// along the line the average is exact, for a layer that is linear between its pixels along
    /// both axes.
    pub(super) fn lay(
        &mut self,
        layer: &Canvas,
        sweeps: &[Sweep],
        margin: usize,
        area: Area,
        out: &mut Canvas,
    ) {
        widest(Laying {
            smear: self,
            layer,
            sweeps,
            margin,
            area,
            out,
        });
    }

    #[inline(always)]
    fn lay_squares(
        &mut self,
        layer: &Canvas,
        sweeps: &[Sweep],
        margin: usize,
        area: Area,
        out: &mut Canvas,
    ) {
        for top in (area.top..area.bottom).step_by(SQUARE) {
            for left in (area.left..area.right).step_by(SQUARE) {
                let square = Area {
                    left,
                    right: (left + SQUARE).min(area.right),
                    top,
                    bottom: (top + SQUARE).min(area.bottom),
                };
                let middle = Point2::new(
                    0.5 * (square.left + square.right - 1) as f64,
                    0.5 * (square.top + square.bottom - 1) as f64,
                );
                for (field, sweep) in sweeps.iter().enumerate() {
                    let (a, b) = (
                        mapped(&sweep.opened, middle) - middle,
                        mapped(&sweep.closed, middle) - middle,
                    );
                    self.aim(a, b, layer.width as isize);
                    let first =
                        (0..sweeps.len()).find(|k| (square.top + k) % sweeps.len() == field);
                    let start = square.top + first.unwrap_or(0);
                    for y in (start..square.bottom).step_by(sweeps.len()) {
                        self.row(layer, margin, y, (square.left, square.right), out);
                    }
                }
            }
        }
    }

    /// Works out the shares of the pixels along the line from `a` to `b`, in pixels of the layer
    /// from the pixel itself.
    #[inline(always)]
    fn aim(&mut self, a: Vector2<f64>, b: Vector2<f64>, width: isize) {
        self.taps.clear();
        let across = (b.x - a.x).abs() >= (b.y - a.y).abs();
        // Along the longer axis, pixel by pixel; along the other, between two.
        let (mut from, mut to) = if across { (a, b) } else { (a.yx(), b.yx()) };
        if from.x > to.x {
            std::mem::swap(&mut from, &mut to);
        }
        let (along, beside) = if across { (1, width) } else { (width, 1) };
        let length = to.x - from.x;
        let slope = if length > STILL {
            (to.y - from.y) / length
        } else {
            0.0
        };
        let mut put = |k: f64, share: f64| {
            if share < 1e-4 {
                return;
            }
            let other = from.y + (k.clamp(from.x, to.x) - from.x) * slope;
            let (low, part) = (other.floor(), other - other.floor());
            let at = k as isize * along + low as isize * beside;
            for (offset, share) in [(at, share * (1.0 - part)), (at + beside, share * part)] {
                if share > 1e-4 {
                    self.taps.push((offset, share as f32));
                }
            }
        };
        if length <= STILL {
            let low = from.x.floor();
            put(low, 1.0 - (from.x - low));
            put(low + 1.0, from.x - low);
            return;
        }
        let (first, last) = (from.x.floor() as isize, to.x.ceil() as isize);
        for k in first..=last {
            let k = k as f64;
            put(
                k,
                (tent_integral(to.x - k) - tent_integral(from.x - k)) / length,
            );
        }
    }

    /// Writes columns left..right of a row.
    #[inline(always)]
    fn row(
        &self,
        layer: &Canvas,
        margin: usize,
        y: usize,
        (left, right): (usize, usize),
        out: &mut Canvas,
    ) {
        let base = ((y + margin) * layer.width + left + margin) as isize;
        let n = right - left;
        let target = &mut out.light[y * out.width + left..y * out.width + right];
        let light = self.gather(&layer.light, base);
        if layer.cover.is_empty() {
            match target.first_chunk_mut() {
                Some(whole) if n == SQUARE => *whole = light,
                _ => target.copy_from_slice(&light[..n]),
            }
            return;
        }
        let cover = self.gather(&layer.cover, base);
        for ((value, light), cover) in target.iter_mut().zip(&light).zip(&cover) {
            *value = *value * (1.0 - cover) + light;
        }
    }

    /// The weighted sums of a square's row of pixels; what lies outside of the layer counts as 0.
    #[inline(always)]
    fn gather(&self, from: &[f32], base: isize) -> [f32; SQUARE] {
        let mut sums = [[0.0_f32; LANES]; SQUARE / LANES];
        for (offset, share) in &self.taps {
            let at = base + offset;
            let values = usize::try_from(at)
                .ok()
                .and_then(|at| from.get(at..)?.first_chunk());
            let values: &[f32; SQUARE] = match values {
                Some(values) => values,
                None => &beyond(from, at),
            };
            for (sums, values) in sums.iter_mut().zip(values.as_chunks().0) {
                let values: &[f32; LANES] = values;
                for i in 0..LANES {
                    sums[i] += share * values[i];
                }
            }
        }
        std::array::from_fn(|i| sums[i / LANES][i % LANES])
    }
}

/// The work of [`Smear::lay`].
struct Laying<'a> {
    smear: &'a mut Smear,
    layer: &'a Canvas,
    sweeps: &'a [Sweep],
    margin: usize,
    area: Area,
    out: &'a mut Canvas,
}

impl Vectorized for Laying<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.smear
            .lay_squares(self.layer, self.sweeps, self.margin, self.area, self.out);
    }
}

/// Pixels of which some are outside of the layer.
#[cold]
fn beyond(from: &[f32], at: isize) -> [f32; SQUARE] {
    std::array::from_fn(|i| {
        let at = usize::try_from(at + i as isize).ok();
        at.and_then(|at| from.get(at)).copied().unwrap_or(0.0)
    })
}

/// The integral of the hat of width 2 and height 1 about 0, from far left to `x`.
#[inline(always)]
fn tent_integral(x: f64) -> f64 {
    let x = x.clamp(-1.0, 1.0);
    if x < 0.0 {
        0.5 * (1.0 + x) * (1.0 + x)
    } else {
        1.0 - 0.5 * (1.0 - x) * (1.0 - x)
    }
}
