//! Frames of every size and content, also those that no camera delivers.

use hough_heuristic::image::{GrayImage, Luma};
use hough_heuristic::{Acceptance, CannyConfig, Circle};
use proptest::prelude::*;

use crate::detectors::{ACCEPT, all_on};
use circle_scenes::staged::Staged;

/// Thresholds that noise does not raise, so that noise is full of edges.
const FIXED: CannyConfig = CannyConfig {
    low: 30.0,
    high: 70.0,
    sigma: 1.2,
    noise_factor: 0.0,
};

/// Black and white at random.
fn saturated_noise(width: u32, height: u32, seed: u32) -> GrayImage {
    let mut state = seed;
    GrayImage::from_fn(width, height, |_, _| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        Luma([if state >> 31 == 0 { 0 } else { 255 }])
    })
}

/// Counts the edge pixels that a detector searches.
fn edges_of(detector: &mut dyn Staged, frame: &GrayImage) -> usize {
    detector.detect(frame).unwrap();
    detector.stages().edges.pixels().len()
}

#[test]
fn every_small_size_and_every_flat_frame_passes() {
    let small = Acceptance {
        min_radius: 1.0,
        max_radius: 6.0,
        max_circles: 50,
        min_distance: 0.0,
        ..ACCEPT
    };
    for (name, mut detector) in all_on(small, FIXED) {
        for width in 0..9 {
            for height in 0..9 {
                let edges = edges_of(
                    &mut *detector,
                    &saturated_noise(width, height, width * 31 + height),
                );
                assert!(
                    edges > 0 || width < 6 || height < 6,
                    "{name} {width}x{height}"
                );
                for gray in [0, 255] {
                    let flat = GrayImage::from_pixel(width, height, Luma([gray]));
                    assert_eq!(
                        detector.detect(&flat).unwrap(),
                        [],
                        "{name} {width}x{height}"
                    );
                }
            }
        }
        let edges = edges_of(&mut *detector, &saturated_noise(120, 90, 7));
        assert!(edges > 1000, "{name}: only {edges} edge pixels");
        for (width, height) in [(1, 700), (700, 1), (2, 700), (3, 700), (700, 3)] {
            let frame = GrayImage::from_fn(width, height, |x, y| Luma([((x ^ y) * 85) as u8]));
            detector.detect(&frame).unwrap();
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn any_bytes_are_a_frame(
        bytes in proptest::collection::vec(any::<u8>(), 1..4000), width in 1u32..80,
        min in 1f64..20.0, span in 0f64..40.0,
    ) {
        let height = bytes.len() as u32 / width;
        let pixels = bytes[..(width * height) as usize].to_vec();
        let frame = GrayImage::from_raw(width, height, pixels).unwrap();
        let accept = Acceptance {
            min_radius: min,
            max_radius: min + span,
            max_circles: 40,
            theta: 0.3,
            ..ACCEPT
        };
        for (name, mut detector) in all_on(accept, FIXED) {
            let found = detector.detect(&frame).unwrap().to_vec();
            let edges = detector.stages().edges.pixels().len();
            let tiny = width < 12 || height < 12;
            prop_assert!(edges > 0 || tiny, "{}: no edges in {}x{}", name, width, height);
            for f in &found {
                let Circle { x, y, radius } = f.circle;
                prop_assert!(x.is_finite() && y.is_finite(), "{}", name);
                prop_assert!((min..=min + span).contains(&radius), "{}", name);
                prop_assert!(f.score > 0.3 && f.score <= 1.0, "{}", name);
            }
            prop_assert_eq!(detector.detect(&frame).unwrap(), found);
        }
    }
}
