//! Ellipses as results of the a contrario detector.

use hough_heuristic::image::{GrayImage, Luma};
use hough_heuristic::{
    AContrario, AContrarioConfig, CircleDetector, Curve, Ellipse, MeasuredEllipse, Measurement,
    Region,
};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

fn detector(min_axis_ratio: f64) -> AContrario {
    AContrario::new(AContrarioConfig {
        min_axis_ratio,
        ..AContrarioConfig::default()
    })
    .unwrap()
}

/// The frame with about normal noise of this deviation.
fn noisy(mut frame: GrayImage, deviation: f64, seed: u64) -> GrayImage {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    for pixel in frame.iter_mut() {
        let sum: f64 = (0..3).map(|_| rng.random_range(-1.0..1.0)).sum();
        *pixel = (f64::from(*pixel) + deviation * sum).round() as u8;
    }
    frame
}

/// A frame with these ellipses, darker than the ground by `step`.
fn frame(ellipses: &[Ellipse], step: f64, noise: f64, seed: u64) -> GrayImage {
    let plain = GrayImage::from_fn(240, 200, |x, y| {
        let cover = |ellipse: &Ellipse| {
            let (x, y) = (f64::from(x), f64::from(y));
            let (sin, cos) = ellipse.angle.sin_cos();
            let (dx, dy) = (x - ellipse.x, y - ellipse.y);
            let u = (dx * cos + dy * sin) / ellipse.major;
            let v = (dy * cos - dx * sin) / ellipse.minor;
            let off = ellipse.distance(x, y).copysign(u.hypot(v) - 1.0);
            // An edge as wide as a lens makes it.
            (0.5 - 0.4 * off).clamp(0.0, 1.0)
        };
        let most = ellipses.iter().map(cover).fold(0.0, f64::max);
        Luma([(170.0 - step * most) as u8])
    });
    noisy(plain, noise, seed)
}

fn tilted(ratio: f64, angle: f64) -> Ellipse {
    Ellipse {
        x: 118.3,
        y: 101.6,
        major: 52.0,
        minor: 52.0 * ratio,
        angle,
    }
}

fn ellipses(measurements: &[Measurement]) -> Vec<MeasuredEllipse> {
    measurements
        .iter()
        .filter_map(|found| found.ellipse)
        .collect()
}

#[test]
fn ellipses_of_any_ratio_and_angle_are_measured() {
    let mut detector = detector(0.5);
    for (index, ratio) in [0.5, 0.6, 0.7, 0.85, 1.0].into_iter().enumerate() {
        for turn in 0..4 {
            let truth = tilted(ratio, f64::from(turn) * 0.8 - 1.5);
            let step = if turn % 2 == 0 { 90.0 } else { -70.0 };
            let frame = frame(&[truth], step, 10.0, 4 * index as u64 + turn as u64);
            detector.detect(&frame).unwrap();
            let found = ellipses(detector.measurements());
            assert_eq!(found.len(), 1, "{truth:?}: {found:?}");
            let (MeasuredEllipse { ellipse, .. }, measured) = (found[0], found[0]);
            let off = (ellipse.x - truth.x).hypot(ellipse.y - truth.y);
            assert!(
                off < 0.2 && off < 5.0 * measured.centre_error,
                "{truth:?}: {measured:?}"
            );
            for (axis, true_axis, error) in [
                (ellipse.major, truth.major, measured.major_error),
                (ellipse.minor, truth.minor, measured.minor_error),
            ] {
                let off = (axis - true_axis).abs();
                assert!(
                    off < 0.01 * true_axis && off < 4.0 * error,
                    "{truth:?}: {measured:?}"
                );
            }
            if ratio < 0.9 {
                let turned = (ellipse.angle - truth.angle).rem_euclid(std::f64::consts::PI);
                let off = turned.min(std::f64::consts::PI - turned);
                assert!(off < 4.0 * measured.angle_error, "{truth:?}: {measured:?}");
            }
        }
    }
}

#[test]
fn without_the_setting_ovals_are_not_reported() {
    let frame = frame(&[tilted(0.7, 0.4)], 90.0, 3.0, 5);
    let mut plain = detector(1.0);
    assert!(plain.detect(&frame).unwrap().is_empty());
    let mut strict = detector(0.8);
    assert!(strict.detect(&frame).unwrap().is_empty());
    let circle = frame_of_circle();
    plain.detect(&circle).unwrap();
    assert_eq!(plain.measurements()[0].ellipse, None);
}

fn frame_of_circle() -> GrayImage {
    frame(&[tilted(1.0, 0.0)], 90.0, 3.0, 6)
}

#[test]
fn circles_keep_their_score_beside_ellipses() {
    let frame = frame_of_circle();
    let (mut plain, mut both) = (detector(1.0), detector(0.5));
    let score = plain.detect(&frame).unwrap()[0].score;
    let found = both.detect(&frame).unwrap();
    assert_eq!(found.len(), 1);
    assert!(found[0].score >= score, "{} {score}", found[0].score);
}

#[test]
fn ellipses_of_regions_are_in_pixels_of_the_frame() {
    let small = |x, y| Ellipse {
        x,
        y,
        major: 22.0,
        minor: 14.0,
        angle: 0.6,
    };
    let frame = frame(&[small(60.0, 70.0), small(180.0, 130.0)], 90.0, 3.0, 7);
    let config = AContrarioConfig {
        min_axis_ratio: 0.5,
        max_radius: Some(30.0),
        ..AContrarioConfig::default()
    };
    let mut whole = AContrario::new(config.clone()).unwrap();
    assert_eq!(whole.detect(&frame).unwrap().len(), 2);
    let mut part = AContrario::new(AContrarioConfig {
        region: Some(Region {
            left: 160,
            top: 110,
            width: 40,
            height: 40,
        }),
        ..config
    })
    .unwrap();
    let circle = part.detect(&frame).unwrap()[0].circle;
    let is_there = |found: &[MeasuredEllipse]| {
        let [MeasuredEllipse { ellipse, .. }] = found else {
            panic!("{found:?}");
        };
        (ellipse.x - 180.0).hypot(ellipse.y - 130.0) < 0.3 && (ellipse.minor - 14.0).abs() < 0.3
    };
    assert!(is_there(&ellipses(part.measurements())));
    assert!(whole.track(&frame, &circle, 5.0).unwrap());
    assert!(is_there(&ellipses(whole.measurements())));
}

#[test]
fn boxes_and_triangles_are_no_ellipses() {
    let mut detector = detector(0.5);
    for seed in 0..8u64 {
        let turn = 0.4 * seed as f64;
        let (sin, cos) = turn.sin_cos();
        let plain = GrayImage::from_fn(240, 200, |x, y| {
            let (dx, dy) = (f64::from(x) - 120.0, f64::from(y) - 100.0);
            let (u, v) = (dx * cos + dy * sin, dy * cos - dx * sin);
            let off = if seed.is_multiple_of(2) {
                (u.abs() - 50.0).max(v.abs() - 30.0)
            } else {
                (-v - 25.0)
                    .max(0.866 * u + 0.5 * v - 30.0)
                    .max(-0.866 * u + 0.5 * v - 30.0)
            };
            Luma([(170.0 - 90.0 * (0.5 - 0.4 * off).clamp(0.0, 1.0)) as u8])
        });
        let found = detector.detect(&noisy(plain, 4.0, seed)).unwrap();
        assert!(found.is_empty(), "{turn}: {found:?}");
    }
}
