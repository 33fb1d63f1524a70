//! Frames that wear out circle detectors: noise, dense texture, and patterns that are full of arcs
//! or of mirrored edges.

use std::f64::consts::TAU;

use hough_heuristic::image::{GrayImage, Luma};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

/// The patterns at this size, by name.
pub fn patterns(width: u32, height: u32) -> Vec<(String, GrayImage)> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    let mut frames = Vec::new();
    let mut paint = |name: String, gray: &mut dyn FnMut(f64, f64, f64) -> f64| {
        let frame = GrayImage::from_fn(width, height, |x, y| {
            Luma([gray(x.into(), y.into(), rng.random()).clamp(0.0, 255.0) as u8])
        });
        frames.push((name, frame));
    };
    let either = |bright: bool| if bright { 220.0 } else { 30.0 };
    let odd = |at: f64, length: f64| (at / length) as u32 % 2 == 1;
    paint("white-noise".into(), &mut |_, _, random| 255.0 * random);
    paint("black-and-white".into(), &mut |_, _, random| {
        either(random < 0.5)
    });
    paint("sparse-dots".into(), &mut |_, _, random| {
        either(random < 0.05)
    });
    for length in [4.0, 8.0, 16.0] {
        paint(format!("stripes-{length}"), &mut |x, _, _| {
            either(odd(x, length))
        });
        paint(format!("checkerboard-{length}"), &mut |x, y, _| {
            either(odd(x, length) != odd(y, length))
        });
    }
    for length in [12.0, 24.0, 48.0, 96.0] {
        let wave = |at: f64| (TAU * at / length).sin();
        paint(format!("slanted-waves-{length}"), &mut |x, y, _| {
            127.0 + 120.0 * wave(0.86 * x + 0.51 * y)
        });
        paint(format!("crossing-waves-{length}"), &mut |x, y, _| {
            127.0 + 63.0 * (wave(x) + wave(y))
        });
        paint(format!("concentric-rings-{length}"), &mut |x, y, _| {
            127.0 + 120.0 * wave((x - 0.4 * f64::from(width)).hypot(y - 0.45 * f64::from(height)))
        });
        let off = |at: f64| at % length - 0.5 * length;
        paint(format!("grid-of-discs-{length}"), &mut |x, y, random| {
            either(off(x).hypot(off(y)) < 0.36 * length) + 6.0 * random
        });
    }
    for length in [8.0, 16.0, 32.0] {
        let waves: Vec<[f64; 3]> = texture(length);
        paint(format!("texture-{length}"), &mut |x, y, _| {
            let sum: f64 = waves
                .iter()
                .map(|[u, v, phase]| (u * x + v * y + phase).sin())
                .sum();
            127.0 + 80.0 * sum * (2.0 / waves.len() as f64).sqrt()
        });
    }
    frames
}

/// Waves of about this length from all sides, whose sum is a texture.
fn texture(length: f64) -> Vec<[f64; 3]> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    (0..48)
        .map(|_| {
            let turn = rng.random_range(0.0..TAU);
            let rate = TAU / (length * rng.random_range(0.6..2.0));
            [
                rate * turn.cos(),
                rate * turn.sin(),
                rng.random_range(0.0..TAU),
            ]
        })
        .collect()
}
