//! From light to gray levels: blur, vignetting, noise, gamma, eight bits.

use hough_heuristic::Vectorized;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{Rng, RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};

use crate::cell::camera::Camera;
use crate::render::blur::three_taps;
use crate::render::canvas::Canvas;
use crate::render::scene::Sensor;

const NOISES: usize = 1 << 16;
const LEVELS: usize = 4096;
/// 2^23.
const WHOLE: f32 = 8_388_608.0;

/// The sensor with its tables and row buffers.
#[derive(Clone, Debug)]
pub(super) struct Exposure {
    sensor: Sensor,
    /// Set if the light is blurred already.
    pub(super) blurred: bool,
    /// Standard normal numbers; every row of every frame starts at another place.
    noise: Vec<f32>,
    /// Gray level of a linear value, in steps of 1 / 4095.
    curve: Box<[u8; LEVELS]>,
    mixed: Vec<f32>,
    row: Vec<f32>,
    /// Squared tangent of the angle to the axis, column by column.
    columns: Vec<f32>,
    /// Vignetting factor of the pixels of the present row, and its change to the next row.
    gains: Vec<f32>,
    changes: Vec<f32>,
}

/// Rows between two with exact vignetting factors; those between are interpolated.
const GAIN_ROWS: usize = 8;

impl Exposure {
    pub(super) fn new<R: Rng + ?Sized>(sensor: Sensor, rng: &mut R) -> Self {
        let noise = (0..NOISES).map(|_| StandardNormal.sample(rng)).collect();
        let gamma = if sensor.gamma > 0.0 {
            sensor.gamma
        } else {
            1.0
        };
        let value = |i: usize| (i as f64 / (LEVELS - 1) as f64).powf(1.0 / gamma);
        let curve = Box::new(std::array::from_fn(|i| (255.0 * value(i)).round() as u8));
        Self {
            sensor,
            blurred: false,
            noise,
            curve,
            mixed: Vec::new(),
            row: Vec::new(),
            columns: Vec::new(),
            gains: Vec::new(),
            changes: Vec::new(),
        }
    }

    /// Turns the light of `canvas` into the gray levels of `out`; `frame` numbers the frame and
    /// with it the noise.
    pub(super) fn expose(
        &mut self,
        canvas: &Canvas,
        camera: &Camera,
        (seed, frame): (u64, u64),
        out: &mut [u8],
    ) {
        let seed = seed ^ frame.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        Exposing(self, canvas, camera, seed, out).widest();
    }
}

/// Arguments of [`Exposure::expose`].
struct Exposing<'a>(&'a mut Exposure, &'a Canvas, &'a Camera, u64, &'a mut [u8]);

impl Vectorized for Exposing<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self(state, canvas, camera, seed, out) = self;
        let (width, height) = (canvas.width, canvas.height);
        if width == 0 || height == 0 {
            return;
        }
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let s = state.sensor;
        let (principal, focal) = (camera.principal_point(), camera.focal_px());
        let (side, middle) = three_taps(if state.blurred { 0.0 } else { s.blur });
        let variance = |deviation: f64| ((deviation / 255.0) as f32).powi(2);
        let (read2, shot2) = (variance(s.read_noise), variance(s.shot_noise));
        let (exposure, bend) = (s.exposure as f32, s.vignetting as f32);
        state.mixed.resize(width + 2, 0.0);
        state.row.resize(width, 0.0);
        let tan2 = |at: usize, middle: f64| (((at as f64 - middle) / focal) as f32).powi(2);
        state.columns.clear();
        state
            .columns
            .extend((0..width).map(|x| tan2(x, principal.x)));
        state.gains.resize(width, 0.0);
        state.changes.resize(width, 0.0);
        let fall = |y: usize| 1.0 + tan2(y, principal.y);
        let gain = |fall: f32, tan2: f32| {
            let cos2 = 1.0 / (fall + tan2);
            exposure * (1.0 - bend * (1.0 - cos2 * cos2))
        };
        // Without gamma, gray levels need no table.
        let straight = s.gamma.to_bits() == 1.0_f64.to_bits();
        // A frame wider than the table of noise repeats it along the row.
        let run = width.min(NOISES / 2);
        for y in 0..height {
            let line = |k: usize| &canvas.light[k * width..(k + 1) * width];
            let (above, below) = (line(y.saturating_sub(1)), line((y + 1).min(height - 1)));
            let around = line(y).iter().zip(above).zip(below);
            for (m, ((here, a), b)) in state.mixed[1..=width].iter_mut().zip(around) {
                *m = middle * here + side * (a + b);
            }
            state.mixed[0] = state.mixed[1];
            state.mixed[width + 1] = state.mixed[width];
            if y % GAIN_ROWS == 0 {
                let (here, later) = (fall(y), fall(y + GAIN_ROWS));
                let gains = state.gains.iter_mut().zip(&mut state.changes);
                for ((now, change), tan2) in gains.zip(&state.columns) {
                    *now = gain(here, *tan2);
                    *change = (gain(later, *tan2) - *now) * (1.0 / GAIN_ROWS as f32);
                }
            }
            let start = rng.random_range(0..NOISES - run);
            let noise = &state.noise[start..start + run];
            for left in (0..width).step_by(run) {
                let length = run.min(width - left);
                let mixed = &state.mixed[left..left + length + 2];
                let (before, here, after) = (&mixed[..length], &mixed[1..=length], &mixed[2..]);
                let gains = state.gains[left..][..length].iter_mut();
                let gains = gains.zip(&state.changes[left..]);
                let lights = before.iter().zip(here).zip(after);
                let row = state.row[left..][..length].iter_mut().zip(noise);
                for (((value, noise), ((l, c), r)), (gain, change)) in row.zip(lights).zip(gains) {
                    let light = (middle * c + side * (l + r)) * *gain;
                    *gain += change;
                    let light = light + (read2 + shot2 * light.max(0.0)).sqrt() * noise;
                    // The sum with 2^23 rounds to a whole number and leaves it in the low bits.
                    *value = light.clamp(0.0, 1.0) * (LEVELS - 1) as f32 + WHOLE;
                }
            }
            let grays = out[y * width..(y + 1) * width].iter_mut().zip(&state.row);
            if straight {
                // Rounded like the table.
                const STEP: f32 = 255.0 / (LEVELS - 1) as f32;
                for (gray, value) in grays {
                    *gray = ((value - WHOLE) * STEP + WHOLE).to_bits() as u8;
                }
            } else {
                let curve = &state.curve;
                for (gray, value) in grays {
                    *gray = curve[value.to_bits() as usize & (LEVELS - 1)];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_gamma_gray_levels_are_those_of_the_table() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let sensor = Sensor {
            gamma: 1.0,
            blur: 0.0,
            vignetting: 0.0,
            exposure: 1.0,
            read_noise: 0.0,
            shot_noise: 0.0,
            ..Sensor::default()
        };
        let mut exposure = Exposure::new(sensor, &mut rng);
        let camera = Camera::paper().resized(LEVELS as u32, 1).expect("a size");
        let mut canvas = Canvas::new(LEVELS, 1);
        for (k, light) in canvas.light.iter_mut().enumerate() {
            *light = k as f32 / (LEVELS - 1) as f32;
        }
        let mut grays = vec![0; LEVELS];
        exposure.expose(&canvas, &camera, (5, 0), &mut grays);
        assert_eq!(grays, *exposure.curve);
    }

    #[test]
    fn wide_vectors_give_the_same_gray_levels() {
        let camera = Camera::paper().resized(203, 31).expect("a size");
        let mut canvas = Canvas::new(203, 31);
        for (k, light) in canvas.light.iter_mut().enumerate() {
            *light = 1.3 * (0.5 + 0.5 * (k as f32 * 0.37).sin());
        }
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let mut exposure = Exposure::new(Sensor::default(), &mut rng);
        let (mut wide, mut plain) = (vec![0; 203 * 31], vec![0; 203 * 31]);
        exposure.expose(&canvas, &camera, (5, 0), &mut wide);
        Exposing(&mut exposure, &canvas, &camera, 5, &mut plain).run();
        assert_eq!(wide, plain);
        assert!(wide.iter().max() > wide.iter().min());
    }
}
