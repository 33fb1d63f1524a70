//! Seeded scenes for tests and benchmarks: shaded balls amid straight-edged distractors, with
//! noise.

use hough_heuristic::Circle;
use hough_heuristic::image::GrayImage;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

/// Content of a scene; the seed places it.
#[derive(Clone, Copy, Debug)]
pub struct Scene {
    pub width: u32,
    pub height: u32,
    pub balls: usize,
    /// Polygons and bars that are not round.
    pub distractors: usize,
    /// Standard deviation of the noise, gray levels.
    pub noise: f64,
    /// Range of the balls' radius, pixels.
    pub radius: (f64, f64),
    pub seed: u64,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            width: 768,
            height: 576,
            balls: 1,
            distractors: 0,
            noise: 2.0,
            radius: (20.0, 100.0),
            seed: 1,
        }
    }
}

impl Scene {
    /// The frame, and the true outlines of its balls.
    pub fn render(&self) -> (GrayImage, Vec<Circle>) {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(self.seed);
        let mut canvas = Canvas::new(self.width, self.height, &mut rng);
        let mut balls: Vec<Circle> = Vec::new();
        let mut tries = 0;
        while balls.len() < self.balls && tries < 10_000 {
            tries += 1;
            let shrink = 1.0 - f64::from(tries) / 12_000.0;
            let radius =
                self.radius.0 + (self.radius.1 - self.radius.0) * rng.random::<f64>() * shrink;
            let margin = radius + 2.0;
            let (w, h) = (f64::from(self.width), f64::from(self.height));
            if 2.0 * margin >= w.min(h) {
                continue;
            }
            let ball = Circle {
                x: rng.random_range(margin..w - margin),
                y: rng.random_range(margin..h - margin),
                radius,
            };
            let apart = |other: &Circle| {
                (ball.x - other.x).hypot(ball.y - other.y) > ball.radius + other.radius + 4.0
            };
            if balls.iter().all(apart) {
                balls.push(ball);
            }
        }
        for _ in 0..self.distractors {
            canvas.distractor(&balls, &mut rng);
        }
        for ball in &balls {
            canvas.ball(ball, &mut rng);
        }
        (canvas.develop(self.noise, &mut rng), balls)
    }
}

/// A picture in work.
pub(crate) struct Canvas {
    pub width: u32,
    pub height: u32,
    /// Gray levels, row by row.
    pub gray: Vec<f64>,
}

impl Canvas {
    fn new(width: u32, height: u32, rng: &mut Xoshiro256PlusPlus) -> Self {
        let base = rng.random_range(110.0..150.0);
        let (slope_x, slope_y) = (rng.random_range(-20.0..20.0), rng.random_range(-20.0..20.0));
        let gray = (0..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .map(|(x, y)| {
                base + slope_x * f64::from(x) / f64::from(width)
                    + slope_y * f64::from(y) / f64::from(height)
            })
            .collect();
        Self {
            width,
            height,
            gray,
        }
    }

    /// Paints where `inside` (signed distance to the border, pixels, positive inside) says, softly
    /// over one pixel.
    pub(crate) fn paint(
        &mut self,
        (left, top, right, bottom): (f64, f64, f64, f64),
        inside: impl Fn(f64, f64) -> f64,
        shade: impl Fn(f64, f64) -> f64,
    ) {
        let clamp = |value: f64, end: u32| value.clamp(0.0, f64::from(end)) as u32;
        for y in clamp(top - 2.0, self.height)..clamp(bottom + 3.0, self.height) {
            for x in clamp(left - 2.0, self.width)..clamp(right + 3.0, self.width) {
                let (px, py) = (f64::from(x), f64::from(y));
                let cover = (inside(px, py) + 0.5).clamp(0.0, 1.0);
                let gray = &mut self.gray[(y * self.width + x) as usize];
                *gray += cover * (shade(px, py) - *gray);
            }
        }
    }

    /// A matt ball, lit from the upper left, on average at least 35 gray levels off the background.
    fn ball(&mut self, ball: &Circle, rng: &mut Xoshiro256PlusPlus) {
        let &Circle { x, y, radius } = ball;
        let dark = rng.random_bool(0.5);
        let albedo = if dark {
            rng.random_range(20.0..70.0)
        } else {
            rng.random_range(205.0..250.0)
        };
        let box_ = (x - radius, y - radius, x + radius, y + radius);
        self.paint(
            box_,
            |px, py| radius - (px - x).hypot(py - y),
            |px, py| {
                let (nx, ny) = ((px - x) / radius, (py - y) / radius);
                albedo * (1.0 - 0.06 * (nx + ny))
            },
        );
    }

    /// A triangle, quadrilateral or bar of some gray level, clear of the balls.
    fn distractor(&mut self, balls: &[Circle], rng: &mut Xoshiro256PlusPlus) {
        let span = f64::from(self.width.min(self.height));
        let (cx, cy) = (
            rng.random_range(0.0..f64::from(self.width)),
            rng.random_range(0.0..f64::from(self.height)),
        );
        let corners = rng.random_range(3..=4);
        let turn = rng.random_range(0.0..std::f64::consts::TAU);
        let (long, wide) = (
            rng.random_range(0.04..0.2) * span,
            rng.random_range(0.02..0.12) * span,
        );
        let gray = rng.random_range(10.0..250.0);
        let polygon: Vec<(f64, f64)> = (0..corners)
            .map(|corner| {
                let angle = std::f64::consts::TAU * (f64::from(corner) + 0.5) / f64::from(corners);
                let (u, v) = (long * angle.cos(), wide * angle.sin());
                (
                    cx + u * turn.cos() - v * turn.sin(),
                    cy + u * turn.sin() + v * turn.cos(),
                )
            })
            .collect();
        let reach = long.max(wide);
        if balls
            .iter()
            .any(|ball| (ball.x - cx).hypot(ball.y - cy) < ball.radius + reach + 2.0)
        {
            return;
        }
        self.paint(
            (cx - reach, cy - reach, cx + reach, cy + reach),
            convex(&polygon),
            |_, _| gray,
        );
    }

    /// The picture in whole gray levels, with noise of this deviation.
    pub(crate) fn develop(self, noise: f64, rng: &mut Xoshiro256PlusPlus) -> GrayImage {
        let mut bytes = Vec::with_capacity(self.gray.len());
        for gray in self.gray {
            let (u, v): (f64, f64) = (rng.random(), rng.random());
            let normal = (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos();
            bytes.push((gray + noise * normal).round().clamp(0.0, 255.0) as u8);
        }
        GrayImage::from_raw(self.width, self.height, bytes).expect("one byte per pixel")
    }
}

/// Distance of a point inside a convex polygon, pixels; its corners turn from x to y.
pub(crate) fn convex(corners: &[(f64, f64)]) -> impl Fn(f64, f64) -> f64 {
    move |px, py| {
        corners
            .iter()
            .zip(corners.iter().cycle().skip(1))
            .map(|(a, b)| {
                let (ex, ey) = (b.0 - a.0, b.1 - a.1);
                (ex * (py - a.1) - ey * (px - a.0)) / ex.hypot(ey)
            })
            .fold(f64::INFINITY, f64::min)
    }
}

/// Returns `true` if centre and radius agree with the ball to `tolerance` pixels each.
pub fn same(found: &Circle, truth: &Circle, tolerance: f64) -> bool {
    (found.x - truth.x).hypot(found.y - truth.y) <= tolerance
        && (found.radius - truth.radius).abs() <= tolerance
}
