//! The counts of docs/TUNING.md: circles at the limits of the a contrario detector that are found,
//! of 40 each.
//!
//! cargo run --release -p circle-benches --example limits

#![allow(clippy::print_stdout, reason = "what an example is for")]

use std::f64::consts::{PI, TAU};

use circle_scenes::scene::same;
use hough_heuristic::image::{GrayImage, Luma, imageops};
use hough_heuristic::{AContrario, AContrarioConfig, Circle, CircleDetector};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

const FRAMES: u64 = 40;
const WIDTH: u32 = 320;
const HEIGHT: u32 = 240;

/// A thing that is hard to see; the share is that of the outline, or of the dashes.
#[derive(Clone, Copy)]
enum Thing {
    BehindPlate { share: f64 },
    CutByFrame { share: f64 },
    Small { radius: f64 },
    Dashed { dashes: f64, share: f64 },
}

impl Thing {
    /// The circle of frame `seed`, and the frame.
    fn draw(self, seed: u64) -> (Circle, GrayImage) {
        let rng = &mut Xoshiro256PlusPlus::seed_from_u64(seed);
        let (w, h) = (f64::from(WIDTH), f64::from(HEIGHT));
        let radius = match self {
            Self::Small { radius } => radius,
            Self::Dashed { .. } => rng.random_range(40.0..60.0),
            _ => rng.random_range(30.0..55.0),
        };
        let x = match self {
            // The border cuts off all but the share of the outline.
            Self::CutByFrame { share } => radius * (PI * (1.0 - share)).cos() - 0.5,
            _ => 0.5 * w + rng.random_range(-20.0..20.0),
        };
        let y = 0.5 * h + rng.random_range(-20.0..20.0);
        let turn = rng.random_range(0.0..TAU);
        let sign = 1.0 - 2.0 * (seed % 2) as f64;
        let soft = |inside: f64| (inside + 0.5).clamp(0.0, 1.0);
        let mut frame = GrayImage::from_fn(WIDTH, HEIGHT, |column, row| {
            let (dx, dy) = (f64::from(column) - x, f64::from(row) - y);
            let from_centre = dx.hypot(dy);
            let mut gray = 128.0 - 60.0 * sign;
            match self {
                Self::Dashed { dashes, share } => {
                    let dash = ((dy.atan2(dx) + turn) / TAU).rem_euclid(1.0) * dashes;
                    let drawn = f64::from(u8::from(dash.fract() < share));
                    gray += 120.0 * sign * drawn * soft(1.5 - (from_centre - radius).abs());
                }
                _ => gray += 120.0 * sign * soft(radius - from_centre),
            }
            if let Self::BehindPlate { share } = self {
                let (u, v) = (
                    dx * turn.cos() + dy * turn.sin(),
                    dy * turn.cos() - dx * turn.sin(),
                );
                let edge = radius * (PI * (1.0 - share)).cos();
                let plate = (u - edge).min(1.3 * radius - v.abs());
                gray += soft(plate) * (128.0 + 20.0 * sign - gray);
            }
            Luma([gray as u8])
        });
        frame = imageops::blur(&frame, 0.8);
        for pixel in frame.iter_mut() {
            let (u, v): (f64, f64) = (rng.random(), rng.random());
            let noise = 2.0 * (-2.0 * (1.0 - u).ln()).sqrt() * (TAU * v).cos();
            *pixel = (f64::from(*pixel) + noise).round() as u8;
        }
        (Circle { x, y, radius }, frame)
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let count = |thing: Thing, min_radius: f64| -> Result<usize, Box<dyn std::error::Error>> {
        let mut detector = AContrario::new(AContrarioConfig {
            min_radius: Some(min_radius),
            ..AContrarioConfig::default()
        })?;
        let mut hits = 0;
        for seed in 0..FRAMES {
            let (truth, frame) = thing.draw(seed);
            let found = detector.detect(&frame)?;
            hits += usize::from(found.iter().any(|found| same(&found.circle, &truth, 2.0)));
        }
        Ok(hits)
    };
    for share in [0.5, 0.4, 0.33, 0.25] {
        println!(
            "behind a plate, {share} visible: {}",
            count(Thing::BehindPlate { share }, 8.0)?
        );
    }
    for share in [0.5, 0.4] {
        println!(
            "cut by the frame, {share} visible: {}",
            count(Thing::CutByFrame { share }, 8.0)?
        );
    }
    for radius in [5.0, 4.5, 4.0, 3.0] {
        println!(
            "radius {radius}, min_radius 4: {}",
            count(Thing::Small { radius }, 4.0)?
        );
    }
    for dashes in [12.0, 24.0] {
        for share in [0.8, 0.7, 0.6, 0.5] {
            let found = count(Thing::Dashed { dashes, share }, 8.0)?;
            println!("{dashes} dashes, {share} drawn: {found}");
        }
    }
    Ok(())
}
