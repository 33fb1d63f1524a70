//! Seeded scenes with one difficulty each, on which detectors are compared: bright matt balls
//! before a plain ground.
//!
//! Lengths are for frames of 768x576 pixels and scale with the size; noise is in gray levels and
//! does not.

use std::f64::consts::{PI, TAU};

use hough_heuristic::Circle;
use hough_heuristic::image::GrayImage;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

use crate::scene::{Canvas, convex};

/// Content of a kind of scene.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    pub name: &'static str,
    pub balls: usize,
    /// Rectangles, bars and triangles behind the balls.
    pub distractors: usize,
    /// Standard deviation of the noise, gray levels.
    pub noise: f64,
    pub difficulty: Difficulty,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Difficulty {
    None,
    /// A plate hides 40 % of the outline.
    Occluded,
    /// The camera moves 4 to 9 pixels.
    Moving,
    /// The ball is darker than the ground.
    Dark,
}

pub const KINDS: [Kind; 14] = [
    ONE,
    kind("distractors", 1, 5, 2.0),
    Kind {
        difficulty: Difficulty::Occluded,
        ..kind("occluded-40", 1, 0, 2.0)
    },
    kind("noise-10", 1, 0, 10.0),
    kind("noise-25", 1, 0, 25.0),
    kind("noise-40", 1, 0, 40.0),
    kind("many", 20, 0, 2.0),
    Kind {
        difficulty: Difficulty::Moving,
        ..kind("motion-blur", 1, 0, 2.0)
    },
    Kind {
        difficulty: Difficulty::Dark,
        ..kind("dark-ball", 1, 0, 2.0)
    },
    kind("empty", 0, 0, 2.0),
    kind("empty-noise-25", 0, 0, 25.0),
    kind("empty-distractors", 0, 5, 2.0),
    kind("distractors-noise-10", 1, 5, 10.0),
    kind("distractors-noise-25", 1, 5, 25.0),
];

/// One ball and nothing else.
pub const ONE: Kind = kind("clean", 1, 0, 2.0);

const fn kind(name: &'static str, balls: usize, distractors: usize, noise: f64) -> Kind {
    Kind {
        name,
        balls,
        distractors,
        noise,
        difficulty: Difficulty::None,
    }
}

/// Smallest radius, pixels of a frame of 768x576; half as much at least at any size.
const LEAST_RADIUS: f64 = 12.0;
/// Largest radius of a ball that is alone, and of one among many.
const MOST_ALONE: f64 = 145.0;
const MOST_OF_MANY: f64 = 40.0;
/// Deviation of the Gaussian that a lens makes of a point, pixels.
const LENS: f64 = 0.7;

impl Kind {
    /// Frame `number` of this kind, of at least 32x32 pixels, and the true outlines of its balls;
    /// no two seeds or kinds share frames.
    pub fn render(
        &self,
        (width, height): (u32, u32),
        seed: u64,
        number: u64,
    ) -> (GrayImage, Vec<Circle>) {
        // FNV-1a over name, seed and number.
        let words = seed.to_le_bytes().into_iter().chain(number.to_le_bytes());
        let hash = self
            .name
            .bytes()
            .chain(words)
            .fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
                (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
            });
        let mut painter = Painter {
            scale: (f64::from(width) / 768.0).min(f64::from(height) / 576.0),
            rng: Xoshiro256PlusPlus::seed_from_u64(hash),
            canvas: Canvas {
                width,
                height,
                gray: vec![0.0; width as usize * height as usize],
            },
        };
        painter.ground();
        for _ in 0..self.distractors {
            painter.distractor();
        }
        let balls = painter.place(self.balls);
        for ball in &balls {
            painter.ball(ball, self.difficulty == Difficulty::Dark);
            if self.difficulty == Difficulty::Occluded {
                painter.plate_before(ball);
            }
        }
        painter.canvas.blur(LENS);
        if self.difficulty == Difficulty::Moving {
            painter.shake();
        }
        (painter.canvas.develop(self.noise, &mut painter.rng), balls)
    }
}

struct Painter {
    canvas: Canvas,
    /// Pixels for each pixel of a frame of 768x576.
    scale: f64,
    rng: Xoshiro256PlusPlus,
}

impl Painter {
    /// A dark ground that brightens a little to one side.
    fn ground(&mut self) {
        let base = self.rng.random_range(30.0..110.0);
        let (x, y) = (
            self.rng.random_range(-12.0..12.0),
            self.rng.random_range(-12.0..12.0),
        );
        let (width, height) = (self.canvas.width as usize, self.canvas.height as usize);
        for (index, gray) in self.canvas.gray.iter_mut().enumerate() {
            let along = |at: usize, length: usize| 2.0 * at as f64 / (length - 1) as f64 - 1.0;
            *gray = base + x * along(index % width, width) + y * along(index / width, height);
        }
    }

    fn anywhere(&mut self) -> (f64, f64) {
        (
            self.rng.random_range(0.0..f64::from(self.canvas.width)),
            self.rng.random_range(0.0..f64::from(self.canvas.height)),
        )
    }

    /// A rectangle, a bar across the frame or a triangle.
    fn distractor(&mut self) {
        let gray = self.rng.random_range(20.0..230.0);
        let (x, y) = self.anywhere();
        let corners = match self.rng.random_range(0..3) {
            0 => {
                let mut side = || 0.5 * self.scale * self.rng.random_range(20.0..160.0);
                let (long, wide) = (side(), side());
                rectangle((x, y), self.rng.random_range(0.0..0.5 * PI), long, wide)
            }
            1 => {
                let (u, v) = self.anywhere();
                let wide = 0.5 * self.scale * self.rng.random_range(2.0..8.0);
                let middle = (0.5 * (x + u), 0.5 * (y + v));
                rectangle(
                    middle,
                    (v - y).atan2(u - x),
                    0.5 * (u - x).hypot(v - y),
                    wide,
                )
            }
            _ => {
                let mut off = || self.scale * self.rng.random_range(-80.0..80.0);
                (0..3).map(|_| (x + off(), y + off())).collect()
            }
        };
        self.canvas.polygon(corners, gray);
    }

    /// Places for balls: inside of the frame and clear of one another.
    fn place(&mut self, count: usize) -> Vec<Circle> {
        let gap = 3.0 * self.scale.max(1.0);
        let most = if count > 1 { MOST_OF_MANY } else { MOST_ALONE };
        let least = LEAST_RADIUS * self.scale.max(0.5);
        let mut balls: Vec<Circle> = Vec::new();
        for _ in 0..5000 {
            if balls.len() == count {
                break;
            }
            let radius = self
                .rng
                .random_range(least..(most * self.scale).max(least + 1.0));
            let mut between = |length: u32| {
                let (low, high) = (radius + gap, f64::from(length) - 1.0 - radius - gap);
                if low < high {
                    self.rng.random_range(low..high)
                } else {
                    0.5 * f64::from(length)
                }
            };
            let (x, y) = (between(self.canvas.width), between(self.canvas.height));
            let apart =
                |other: &Circle| (x - other.x).hypot(y - other.y) > radius + other.radius + gap;
            if balls.iter().all(apart) {
                balls.push(Circle { x, y, radius });
            }
        }
        balls
    }

    /// A matt ball, lit from the upper left before it.
    fn ball(&mut self, ball: &Circle, dark: bool) {
        let &Circle { x, y, radius } = ball;
        let (bright, shade) = if dark {
            (self.rng.random_range(5.0..15.0), 0.2)
        } else {
            (
                self.rng.random_range(190.0..245.0),
                self.rng.random_range(0.3..0.6),
            )
        };
        self.canvas.paint(
            (x - radius, y - radius, x + radius, y + radius),
            |px, py| radius - (px - x).hypot(py - y),
            |px, py| {
                let (nx, ny) = ((px - x) / radius, (py - y) / radius);
                let nz = (1.0 - nx * nx - ny * ny).max(0.0).sqrt();
                let light = (0.76 * nz - 0.4 * nx - 0.5 * ny).clamp(0.0, 1.0);
                bright * (1.0 - shade + shade * light)
            },
        );
    }

    /// A plate whose straight edge cuts off 40 % of the outline.
    fn plate_before(&mut self, ball: &Circle) {
        let turn = self.rng.random_range(0.0..TAU);
        let gray = self.rng.random_range(20.0..160.0);
        let reach = 1.2 * ball.radius;
        let away = ball.radius * (0.4 * PI).cos() + 0.5 * reach;
        let middle = (ball.x + away * turn.cos(), ball.y + away * turn.sin());
        self.canvas
            .polygon(rectangle(middle, turn, 0.5 * reach, reach), gray);
    }

    /// Moves the camera while the shutter is open.
    fn shake(&mut self) {
        let length = self.scale * self.rng.random_range(4.0..9.0);
        let turn = self.rng.random_range(0.0..PI);
        let steps = (2.0 * length).ceil() as usize;
        let canvas = &self.canvas;
        let mut smeared = vec![0.0; canvas.gray.len()];
        for step in 0..=steps {
            let along = length * (step as f64 / steps as f64 - 0.5);
            let (dx, dy) = (along * turn.cos(), along * turn.sin());
            let mut at = smeared.iter_mut();
            for y in 0..canvas.height {
                for x in 0..canvas.width {
                    let sum = at.next().expect("as many as pixels");
                    *sum += canvas.at(f64::from(x) + dx, f64::from(y) + dy) / (steps + 1) as f64;
                }
            }
        }
        self.canvas.gray = smeared;
    }
}

/// The corners of a rectangle, from its centre, the direction of its length, and half of its length
/// and width.
fn rectangle((x, y): (f64, f64), turn: f64, long: f64, wide: f64) -> Vec<(f64, f64)> {
    let (cos, sin) = (turn.cos(), turn.sin());
    [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        .map(|(u, v)| {
            (
                x + u * long * cos - v * wide * sin,
                y + u * long * sin + v * wide * cos,
            )
        })
        .to_vec()
}

impl Canvas {
    /// Fills a convex polygon.
    fn polygon(&mut self, mut corners: Vec<(f64, f64)>, gray: f64) {
        let turn = |a: &(f64, f64), b: &(f64, f64)| a.0 * b.1 - a.1 * b.0;
        let area: f64 = corners
            .iter()
            .zip(corners.iter().cycle().skip(1))
            .map(|(a, b)| turn(a, b))
            .sum();
        if area < 0.0 {
            corners.reverse();
        }
        let ends = |of: fn(&(f64, f64)) -> f64| {
            let values = || corners.iter().map(of);
            (
                values().fold(f64::INFINITY, f64::min),
                values().fold(f64::NEG_INFINITY, f64::max),
            )
        };
        let ((left, right), (top, bottom)) = (ends(|corner| corner.0), ends(|corner| corner.1));
        self.paint((left, top, right, bottom), convex(&corners), |_, _| gray);
    }

    /// The gray level between pixels; beyond the border that of the border.
    fn at(&self, x: f64, y: f64) -> f64 {
        let (x, y) = (
            x.clamp(0.0, f64::from(self.width - 1)),
            y.clamp(0.0, f64::from(self.height - 1)),
        );
        let (column, row) = (
            (x as usize).min(self.width as usize - 2),
            (y as usize).min(self.height as usize - 2),
        );
        let (fx, fy) = (x - column as f64, y - row as f64);
        let pixel = |x: usize, y: usize| self.gray[y * self.width as usize + x];
        let line = |y: usize| pixel(column, y) + (pixel(column + 1, y) - pixel(column, y)) * fx;
        line(row) + (line(row + 1) - line(row)) * fy
    }

    /// Smooths by a Gaussian of this deviation, pixels.
    fn blur(&mut self, deviation: f64) {
        let reach = (4.0 * deviation).ceil() as i32;
        let weights: Vec<f64> = (-reach..=reach)
            .map(|k| (-0.5 * (f64::from(k) / deviation).powi(2)).exp())
            .collect();
        let sum: f64 = weights.iter().sum();
        for (dx, dy) in [(1, 0), (0, 1)] {
            let mut smooth = Vec::with_capacity(self.gray.len());
            for y in 0..self.height as i32 {
                for x in 0..self.width as i32 {
                    let taps = (-reach..=reach).zip(&weights).map(|(k, weight)| {
                        let column = (x + k * dx).clamp(0, self.width as i32 - 1);
                        let row = (y + k * dy).clamp(0, self.height as i32 - 1);
                        weight * self.gray[(row * self.width as i32 + column) as usize]
                    });
                    smooth.push(taps.sum::<f64>() / sum);
                }
            }
            self.gray = smooth;
        }
    }
}
