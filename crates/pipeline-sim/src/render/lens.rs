//! What the lens does to the light: distortion and defocus.

use nalgebra::Point2;

use crate::Camera;
use crate::render::canvas::Canvas;

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
        // From pixel to pixel the answer changes little: the last one is where to look for the next.
        let image = |x: u32, y: u32| (Point2::new(f64::from(x), f64::from(y)) - principal) / focal;
        let mut last = (Point2::origin(), Point2::origin());
        let sources = (0..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .map(|(x, y)| {
                let shown = Point2::from(image(x, y));
                let undone = camera.distortion().undistort_near(shown, last);
                last = (shown, undone.unwrap_or(last.1));
                let p = principal + last.1.coords * focal - low;
                let (i, j) = (p.x.floor(), p.y.floor());
                ((j as u32) * w + i as u32, (p.x - i) as f32, (p.y - j) as f32)
            })
            .collect();
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

/// Blurs the whole canvas as the sensor's own pass does ([`crate::Sensor::blur`]): three taps along each axis. For fields, which
/// must be blurred before they are woven.
pub(super) fn soften(canvas: &mut Canvas, sigma: f64, spare: &mut Vec<f32>) {
    let (side, middle) = three_taps(sigma);
    let (w, h) = (canvas.width, canvas.height);
    if w == 0 || h == 0 {
        return;
    }
    spare.clear();
    spare.extend_from_slice(&canvas.light);
    for y in 0..h {
        let line = |k: usize| &spare[k * w..(k + 1) * w];
        let (above, here, below) = (line(y.saturating_sub(1)), line(y), line((y + 1).min(h - 1)));
        let out = &mut canvas.light[y * w..(y + 1) * w];
        for (((o, a), c), b) in out.iter_mut().zip(above).zip(here).zip(below) {
            *o = middle * c + side * (a + b);
        }
        let mut left = out[0];
        for x in 0..w {
            let (here, right) = (out[x], out[(x + 1).min(w - 1)]);
            out[x] = middle * here + side * (left + right);
            left = here;
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
