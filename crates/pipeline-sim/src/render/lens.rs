//! What the lens does to the light: distortion and defocus.

use nalgebra::{Point2, Vector2};

use crate::Camera;
use crate::render::canvas::{Area, Canvas};

/// Pixels from one place to the next at which a distortion is undone exactly.
const CELL: usize = 4;
/// How far from its exact place a pixel between them may be taken, pixels.
const STRAIGHT: f64 = 0.005;

/// The map from a distorted frame to the ideal one it is taken from.
#[derive(Clone, Debug)]
pub(super) struct Warp {
    camera: Camera,
    /// The ideal camera, large enough to hold all that the distorted frame shows.
    pub(super) ideal: Camera,
    /// For each pixel: position of the upper left of four source pixels, and the shares of its right and lower neighbours.
    sources: Vec<(u32, f32, f32)>,
}

impl Warp {
    /// `None` for a camera without distortion. For any other the ideal frame is larger, but not endless: a radial distortion of three terms that does
    /// not fold squeezes by less than three.
    pub(super) fn new(camera: &Camera) -> Option<Self> {
        if camera.distortion().is_none() {
            return None;
        }
        let (width, height) = camera.size();
        let (focal, principal) = (camera.focal_px(), camera.principal_point());
        let ideal = |x: u32, y: u32| {
            let ray = camera.ray(Point2::new(f64::from(x), f64::from(y)));
            principal + ray.xy() * focal
        };
        let border = (0..width)
            .flat_map(|x| [(x, 0), (x, height - 1)])
            .chain((0..height).flat_map(|y| [(0, y), (width - 1, y)]));
        let (mut low, mut high) = (Point2::new(0.0_f64, 0.0), Point2::new(0.0_f64, 0.0));
        for (x, y) in border {
            let p = ideal(x, y);
            (low, high) = (low.inf(&p), high.sup(&p));
        }
        let (low, high) = (low.map(|v| v.floor() - 1.0), high.map(|v| v.ceil() + 2.0));
        let (w, h) = ((high.x - low.x + 1.0) as u32, (high.y - low.y + 1.0) as u32);
        let large = Camera::ideal(focal, Point2::from(principal - low), w, h);
        // From place to place the answer changes little: the last one is where to look for the next.
        let mut last = (Point2::origin(), Point2::origin());
        let mut exact = |x: u32, y: u32| {
            let shown = Point2::from((Point2::new(f64::from(x), f64::from(y)) - principal) / focal);
            let undone = camera.distortion().undistort_near(shown, last);
            last = (shown, undone.unwrap_or(last.1));
            principal + last.1.coords * focal - low
        };
        let mut sources = vec![(0, 0.0, 0.0); width as usize * height as usize];
        let mut put = |x: u32, y: u32, p: Vector2<f64>| {
            let (i, j) = (p.x.floor(), p.y.floor());
            sources[y as usize * width as usize + x as usize] =
                ((j as u32) * w + i as u32, (p.x - i) as f32, (p.y - j) as f32);
        };
        let nodes = |length: u32| -> Vec<u32> {
            let inner = (0..length.saturating_sub(1)).step_by(CELL);
            inner.chain([length.saturating_sub(1)]).collect()
        };
        let (columns, rows) = (nodes(width), nodes(height));
        let mut upper: Vec<Vector2<f64>> = columns.iter().map(|x| exact(*x, 0)).collect();
        for (j, &top) in rows.iter().enumerate() {
            let bottom = *rows.get(j + 1).unwrap_or(&top);
            let lower: Vec<Vector2<f64>> = columns.iter().map(|x| exact(*x, bottom)).collect();
            for (i, &left) in columns.iter().enumerate() {
                let next = (i + 1).min(columns.len() - 1);
                let right = columns[next];
                let between = |x: u32, y: u32| {
                    let fx = f64::from(x - left) / f64::from((right - left).max(1));
                    let fy = f64::from(y - top) / f64::from((bottom - top).max(1));
                    let (a, b) = (upper[i].lerp(&upper[next], fx), lower[i].lerp(&lower[next], fx));
                    a.lerp(&b, fy)
                };
                // What is between bends most in the middle.
                let (x, y) = ((left + right) / 2, (top + bottom) / 2);
                let straight = (exact(x, y) - between(x, y)).norm() < STRAIGHT;
                for y in top..bottom.max(top + 1) {
                    for x in left..right.max(left + 1) {
                        put(x, y, if straight { between(x, y) } else { exact(x, y) });
                    }
                }
            }
            upper = lower;
        }
        Some(Self {
            camera: *camera,
            ideal: large,
            sources,
        })
    }

    /// Whether this warp belongs to a camera.
    pub(super) fn is_for(&self, camera: &Camera) -> bool {
        self.camera == *camera
    }

    /// Takes every pixel of `out` from `ideal`.
    pub(super) fn apply(&self, ideal: &Canvas, out: &mut Canvas) {
        let w = ideal.width;
        for (light, (at, fx, fy)) in out.light.iter_mut().zip(&self.sources) {
            let at = *at as usize;
            let (a, b) = (ideal.light[at], ideal.light[at + 1]);
            let (c, d) = (ideal.light[at + w], ideal.light[at + w + 1]);
            let (upper, lower) = (a + (b - a) * fx, c + (d - c) * fx);
            *light = upper + (lower - upper) * fy;
        }
    }
}

/// Blurs an area of a canvas as the sensor's own pass does ([`crate::Sensor::blur`]): three taps along each axis. For fields, which
/// must be blurred before they are woven.
pub(super) fn soften(canvas: &mut Canvas, area: Area, sigma: f64, spare: &mut Vec<f32>) {
    let (side, middle) = three_taps(sigma);
    if area.is_empty() || side <= 0.0 {
        return;
    }
    let width = canvas.width;
    let (w, h) = (area.right - area.left, area.bottom - area.top);
    // The area as it was, and a row with a pixel more at either end.
    spare.clear();
    spare.resize(w * h + w + 2, 0.0);
    let (before, mixed) = spare.split_at_mut(w * h);
    for values in [&mut canvas.light, &mut canvas.cover] {
        if values.is_empty() {
            continue;
        }
        let place = |y: usize| (area.top + y) * width + area.left;
        for (y, copy) in before.chunks_exact_mut(w).enumerate() {
            copy.copy_from_slice(&values[place(y)..][..w]);
        }
        for y in 0..h {
            let line = |k: usize| &before[k * w..][..w];
            let (above, here, below) = (line(y.saturating_sub(1)), line(y), line((y + 1).min(h - 1)));
            for (((m, a), c), b) in mixed[1..=w].iter_mut().zip(above).zip(here).zip(below) {
                *m = middle * c + side * (a + b);
            }
            mixed[0] = mixed[1];
            mixed[w + 1] = mixed[w];
            let sides = mixed.iter().zip(&mixed[2..]);
            let out = &mut values[place(y)..][..w];
            for ((o, c), (l, r)) in out.iter_mut().zip(&mixed[1..]).zip(sides) {
                *o = middle * c + side * (l + r);
            }
        }
    }
}

/// Side and middle weight of the three-tap kernel whose variance is sigma², up to the widest that three taps give.
pub(super) fn three_taps(sigma: f64) -> (f32, f32) {
    let side = (0.5 * sigma * sigma).clamp(0.0, 0.333) as f32;
    (side, 1.0 - 2.0 * side)
}

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
    let (w, h) = (canvas.width, canvas.height);
    spare.clear();
    spare.resize(w * h, 0.0);
    for y in 0..h {
        let out = &mut spare[y * w..(y + 1) * w];
        for (i, k) in kernel.iter().enumerate() {
            let (above, below) = (y.saturating_sub(i), (y + i).min(h - 1));
            let (p, q) = (&canvas.light[above * w..][..w], &canvas.light[below * w..][..w]);
            let k = if i == 0 { 0.5 * k } else { *k };
            for ((o, a), b) in out.iter_mut().zip(p).zip(q) {
                *o += k * (a + b);
            }
        }
    }
    let mut padded = vec![0.0_f32; w + 2 * reach];
    for y in 0..h {
        let row = &spare[y * w..(y + 1) * w];
        padded[..reach].fill(row[0]);
        padded[reach..reach + w].copy_from_slice(row);
        padded[reach + w..].fill(row[w - 1]);
        let out = &mut canvas.light[y * w..(y + 1) * w];
        out.fill(0.0);
        for (i, k) in kernel.iter().enumerate() {
            let (p, q) = (&padded[reach - i..][..w], &padded[reach + i..][..w]);
            let k = if i == 0 { 0.5 * k } else { *k };
            for ((o, a), b) in out.iter_mut().zip(p).zip(q) {
                *o += k * (a + b);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Distortion;

    #[test]
    fn every_pixel_is_taken_from_where_the_lens_has_it() {
        for (k1, k2) in [(-0.35, 0.08), (-0.1, 0.0), (0.6, 0.0)] {
            let lens = Distortion {
                k1,
                k2,
                ..Distortion::default()
            };
            let camera = Camera::paper().with_distortion(lens).expect("does not fold");
            let warp = Warp::new(&camera).expect("distorts");
            let (width, height) = camera.size();
            let mut worst = 0.0_f64;
            for (x, y) in (0..height)
                .step_by(3)
                .flat_map(|y| (0..width).step_by(5).map(move |x| (x, y)))
            {
                let ray = camera.ray(Point2::new(f64::from(x), f64::from(y)));
                let exact = warp.ideal.principal_point() + ray.xy() * camera.focal_px();
                let (at, fx, fy) = warp.sources[(y * width + x) as usize];
                let (i, j) = (at % warp.ideal.size().0, at / warp.ideal.size().0);
                let taken = Point2::new(f64::from(i) + f64::from(fx), f64::from(j) + f64::from(fy));
                worst = worst.max((taken - exact).norm());
            }
            assert!(worst < 0.01, "{k1} {k2}: {worst}");
        }
    }
}
