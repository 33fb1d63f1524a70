//! The search and the measurement by the widest vectors give the bits that plain code gives. (The
//! proof has its test beside it.)

use image::{GrayImage, Luma};
use proptest::prelude::*;

use super::listed::SMOOTHING;
use super::polar::Ring;
use super::report::Measuring;
use super::*;
use crate::edges::Maxima;

/// A ball of some radius in noise, with bars across.
fn frame(ball: &Ring, noise: f32, seed: u64) -> GrayImage {
    GrayImage::from_fn(160, 120, |x, y| {
        let (dx, dy) = (x as f32 - ball.x, y as f32 - ball.y);
        let random = (seed.wrapping_mul(u64::from(2 * (160 * y + x) + 1)) >> 40) as f32
            / (1u64 << 24) as f32;
        let bar = if (x + 2 * y) % 47 < 9 { 40.0 } else { 0.0 };
        let gray = if (dx * dx + dy * dy).sqrt() < ball.r {
            60.0
        } else {
            150.0 + bar
        };
        Luma([(gray + noise * (2.0 * random - 1.0)).clamp(0.0, 255.0) as u8])
    })
}

fn balls() -> impl Strategy<Value = Ring> {
    (-5f32..165.0, -5f32..125.0, 6f32..50.0).prop_map(|(x, y, r)| Ring { x, y, r })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn wide_vectors_find_what_plain_code_finds(ball in balls(), noise in 0f32..40.0, seed: u64) {
        let frame = frame(&ball, noise, seed);
        let circle = UnitCircle::new();
        let outline = Outline::new(&circle);
        let pyramid = Pyramid { frame: &frame, sizes: &[] };
        let mut maxima = Maxima::new(SMOOTHING);
        let of = |wide: bool, maxima: &mut Maxima| {
            let (mut polar, mut proofs) = (Polar::default(), Vec::new());
            let (mut level, mut collected) = (Level::default(), Collected::default());
            let points = maxima.find(frame.as_raw(), 160, 40.0, None);
            level.fill(160, 120, points);
            collected.clear(CANDIDATES);
            let mut budget = Budget::new(&AContrarioConfig::default(), frame.len());
            budget.begin_size(true);
            let searching = Searching {
                search: Search {
                    circle: &circle,
                    outline: &outline,
                    radii: (4.0, 60.0),
                    most_radius: 60.0,
                    scale: 1.0,
                    seed,
                    mirror_slack: 0.35,
                },
                prover: &mut Prover {
                    pyramid,
                    circle: &circle,
                    polar: &mut polar,
                    noise,
                    tests: 5.0,
                    proofs: &mut proofs,
                },
                level: &mut level,
                collected: &mut collected,
                budget: &mut budget,
            };
            if wide { widest(searching) } else { searching.run() }
            format!("{collected:?} {proofs:?} {budget:?} {:?}", level.free)
        };
        prop_assert_eq!(of(true, &mut maxima), of(false, &mut maxima));
    }

    #[test]
    fn wide_vectors_measure_what_plain_code_measures(
        ball in balls(), off in (-2f32..2.0, -2f32..2.0, -1f32..1.0), noise in 0f32..40.0,
        seed: u64,
    ) {
        let frame = frame(&ball, noise, seed);
        let circle = UnitCircle::new();
        let proof = Proof {
            ring: Ring { x: ball.x + off.0, y: ball.y + off.1, r: ball.r + off.2 },
            ..Proof::default()
        };
        let mut polar = [Polar::default(), Polar::default()];
        let [wide, plain] = polar.each_mut().map(|polar| Measuring {
            pyramid: Pyramid { frame: &frame, sizes: &[] },
            proof: &proof,
            circle: &circle,
            polar,
            noise,
        });
        prop_assert_eq!(format!("{:?}", widest(wide)), format!("{:?}", plain.run()));
    }
}
