//! From light to grey levels: blur, vignetting, noise, gamma, eight bits.

use rand::rngs::Xoshiro256PlusPlus;
use rand::{Rng, RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};

use crate::Sensor;
use crate::render::canvas::Canvas;
use crate::render::view::View;

const NOISES: usize = 1 << 16;
const LEVELS: usize = 4096;

/// The sensor with its tables and row buffers.
#[derive(Clone, Debug)]
pub(super) struct Exposure {
    sensor: Sensor,
    /// Standard normal numbers; every row of every frame starts at another place.
    noise: Vec<f32>,
    /// Grey level of a linear value, in steps of 1 / 4095.
    curve: Vec<u8>,
    mixed: Vec<f32>,
    row: Vec<f32>,
}

impl Exposure {
    pub(super) fn new<R: Rng + ?Sized>(sensor: Sensor, rng: &mut R) -> Self {
        let noise = (0..NOISES).map(|_| StandardNormal.sample(rng)).collect();
        let exponent = 1.0 / if sensor.gamma > 0.0 { sensor.gamma } else { 1.0 };
        let curve = (0..LEVELS)
            .map(|i| (255.0 * (i as f64 / (LEVELS - 1) as f64).powf(exponent)).round() as u8)
            .collect();
        Self {
            sensor,
            noise,
            curve,
            mixed: Vec::new(),
            row: Vec::new(),
        }
    }

    /// Turns the light of `canvas` into the grey levels of `out`; `frame` numbers the frame and with it the noise.
    pub(super) fn expose(&mut self, canvas: &Canvas, view: &View, seed: u64, frame: u64, out: &mut [u8]) {
        let (width, height) = (canvas.width, canvas.height);
        if width == 0 || height == 0 {
            return;
        }
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed ^ frame.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let s = self.sensor;
        let (side, middle) = kernel(s.blur);
        let (read, shot) = ((s.read_noise / 255.0) as f32, (s.shot_noise / 255.0) as f32);
        let exposure = s.exposure as f32;
        let bend = s.vignetting as f32;
        let inverse_focal = (1.0 / view.focal) as f32;
        self.mixed.resize(width + 2, 0.0);
        self.row.resize(width, 0.0);
        for y in 0..height {
            let line = |k: usize| &canvas.light[k * width..(k + 1) * width];
            let (above, here, below) = (line(y.saturating_sub(1)), line(y), line((y + 1).min(height - 1)));
            for (((m, a), h), b) in self.mixed[1..=width].iter_mut().zip(above).zip(here).zip(below) {
                *m = middle * h + side * (a + b);
            }
            self.mixed[0] = self.mixed[1];
            self.mixed[width + 1] = self.mixed[width];
            let start = rng.random_range(0..NOISES - width.min(NOISES - 1));
            let noise = self.noise[start..].iter().chain(std::iter::repeat(&0.0));
            let yn = (y as f32 - view.principal.y as f32) * inverse_focal;
            let first = -(view.principal.x as f32) * inverse_focal;
            let fall = yn * yn;
            if width < NOISES {
                let noise = &self.noise[start..start + width];
                let blurred = self.mixed.windows(3);
                for (((x, value), w), n) in self.row.iter_mut().enumerate().zip(blurred).zip(noise) {
                    let light = middle * w[1] + side * (w[0] + w[2]);
                    let xn = first + x as f32 * inverse_focal;
                    let cos2 = 1.0 / (1.0 + xn * xn + fall);
                    let light = light * exposure * (1.0 - bend * (1.0 - cos2 * cos2));
                    let light = light + (read + shot * light.max(0.0).sqrt()) * n;
                    *value = (light.clamp(0.0, 1.0)) * (LEVELS - 1) as f32 + 0.5;
                }
            } else {
                for ((value, m), n) in self.row.iter_mut().zip(&self.mixed[1..=width]).zip(noise) {
                    let light = m * exposure + read * n;
                    *value = (light.clamp(0.0, 1.0)) * (LEVELS - 1) as f32 + 0.5;
                }
            }
            let curve = &self.curve[..LEVELS];
            for (grey, value) in out[y * width..(y + 1) * width].iter_mut().zip(&self.row) {
                *grey = curve[(*value as i32 as usize).min(LEVELS - 1)];
            }
        }
    }
}

/// Side and middle weight of the three-tap kernel whose variance is sigma², up to the widest that three taps give.
fn kernel(sigma: f64) -> (f32, f32) {
    let side = (0.5 * sigma * sigma).clamp(0.0, 0.333) as f32;
    (side, 1.0 - 2.0 * side)
}
