//! Frames for comparing detectors show what their kind says.

use pipeline_sim::image::GrayImage;
use pipeline_sim::{
    BenchmarkKind, Camera, CameraError, Renderer, Round, Sensor, Sighting, Snapshot,
};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

fn drawn(kind: BenchmarkKind, size: (u32, u32), seed: u64) -> (Renderer, Snapshot) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let (scene, snapshot) = kind.draw(size, &mut rng).expect("a usable size");
    (Renderer::new(&scene, seed), snapshot)
}

/// The balls among the truth.
fn balls(renderer: &Renderer, snapshot: &Snapshot) -> Vec<Sighting> {
    let truth = snapshot.truth(renderer);
    assert!(
        truth
            .iter()
            .all(|s| matches!(s.what, Round::Target | Round::Ball))
    );
    truth
}

#[test]
fn every_kind_has_a_name_and_repeats_with_its_seed() {
    for kind in BenchmarkKind::ALL {
        assert_eq!(kind.to_string().parse::<BenchmarkKind>(), Ok(kind));
        let known = "nothing"
            .parse::<BenchmarkKind>()
            .expect_err("no such kind")
            .known;
        assert!(
            known.split(", ").any(|name| name == kind.to_string()),
            "{kind}"
        );
        let frame = |seed| -> GrayImage {
            let (mut renderer, snapshot) = drawn(kind, (192, 144), seed);
            snapshot.take(&mut renderer).clone()
        };
        assert!(frame(3) == frame(3), "{kind}");
        assert!(frame(3) != frame(4), "{kind}");
    }
}

#[test]
fn balls_are_as_many_as_large_and_as_visible_as_the_kind_says() {
    for size in [(192, 144), (768, 576), (1920, 1080)] {
        let scale = Camera::paper()
            .resized(size.0, size.1)
            .expect("a usable size")
            .focal_px()
            / Camera::paper().focal_px();
        for kind in BenchmarkKind::ALL {
            for seed in 0..if size.0 == 768 { 2 } else { 1 } {
                let (renderer, snapshot) = drawn(kind, size, seed);
                let balls = balls(&renderer, &snapshot);
                assert_eq!(balls.len(), kind.balls(), "{kind} {size:?} {seed}");
                for ball in &balls {
                    let radius = ball.ellipse.circle().radius / scale;
                    let most = if kind == BenchmarkKind::Many {
                        60.0
                    } else {
                        145.0
                    };
                    // In motion the truth is half a motion away from where the ball was put.
                    let slack = if kind == BenchmarkKind::MotionBlur {
                        0.5
                    } else {
                        1e-6
                    };
                    assert!(
                        (12.0 - slack..=most + slack).contains(&radius),
                        "{kind} {size:?} {seed}: {radius}"
                    );
                    assert!(
                        ball.ellipse.share_inside(size.0, size.1) >= 1.0,
                        "{kind} {size:?} {seed}"
                    );
                    let shown = if kind == BenchmarkKind::Occluded40 {
                        // The segment that 40 % of the circumference cut off.
                        let angle = 0.4 * std::f64::consts::PI;
                        1.0 - (angle - angle.sin() * angle.cos()) / std::f64::consts::PI
                    } else {
                        1.0
                    };
                    assert!(
                        (ball.visible - shown).abs() < 0.04,
                        "{kind} {size:?} {seed}: {} {radius}",
                        ball.visible
                    );
                }
            }
        }
    }
}

#[test]
fn radii_are_spread_over_the_whole_range() {
    let mut radii: Vec<f64> = (0..60)
        .map(|seed| {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            let drawn = BenchmarkKind::Clean.draw((192, 144), &mut rng);
            let Snapshot { cell, joints, .. } = drawn.expect("a usable size").1;
            4.0 * cell.outline(&joints).expect("in view").circle().radius
        })
        .collect();
    radii.sort_by(f64::total_cmp);
    // The median of an even spread on a logarithmic scale is the geometric mean of the ends.
    let middle = (12.0_f64 * 145.0).sqrt();
    assert!(radii[0] < 16.0 && radii[59] > 110.0, "{radii:?}");
    assert!((0.7..1.4).contains(&(radii[30] / middle)), "{}", radii[30]);
}

#[test]
fn noise_is_as_strong_as_the_name_says() {
    for (kind, expected) in [
        (BenchmarkKind::Clean, Sensor::default().read_noise),
        (BenchmarkKind::Noise10, 10.0),
        (BenchmarkKind::Noise25, 25.0),
        (BenchmarkKind::Noise40, 40.0),
        (BenchmarkKind::DistractorsNoise10, 10.0),
        (BenchmarkKind::DistractorsNoise25, 25.0),
    ] {
        let (mut renderer, snapshot) = drawn(kind, (768, 576), 5);
        let (a, b) = (
            snapshot.take(&mut renderer).clone(),
            snapshot.take(&mut renderer).clone(),
        );
        // Where the noise is not cut off at black or white.
        let differences: Vec<f64> = a
            .iter()
            .zip(b.iter())
            .map(|(p, q)| (f64::from(*p) + f64::from(*q), f64::from(*p) - f64::from(*q)))
            .filter(|(sum, _)| (160.0..320.0).contains(sum))
            .map(|(_, difference)| difference)
            .collect();
        let variance =
            differences.iter().map(|d| d * d).sum::<f64>() / differences.len() as f64 / 2.0;
        let deviation = variance.sqrt();
        let shot = if kind == BenchmarkKind::Clean {
            1.3
        } else {
            0.0
        };
        assert!(
            (deviation - expected - shot).abs() < 0.12 * expected + 0.6,
            "{kind}: {deviation}, {} pixels",
            differences.len()
        );
    }
}

#[test]
fn in_motion_the_ball_moves_by_four_to_twelve_pixels() {
    for seed in 0..20 {
        let (_, snapshot) = drawn(BenchmarkKind::MotionBlur, (768, 576), seed);
        let place = |seconds| {
            let (cell, joints) = snapshot.moment(seconds);
            cell.outline(&joints).expect("in view").centre
        };
        let moved = (place(snapshot.shot.exposure) - place(0.0)).norm();
        assert!((3.99..12.01).contains(&moved), "{seed}: {moved}");
        assert!(snapshot.shot.moments as f64 >= moved / 2.0);
    }
}

#[test]
fn a_frame_without_pixels_is_refused() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    for size in [(0, 576), (768, 0)] {
        let refused = BenchmarkKind::Clean.draw(size, &mut rng);
        assert!(
            matches!(refused, Err(CameraError::NotPositive { .. })),
            "{size:?}"
        );
    }
    // However small the frame, there is one.
    assert!(BenchmarkKind::Many.draw((1, 1), &mut rng).is_ok());
}

#[test]
fn frames_of_any_shape_are_drawn_and_rendered() {
    for kind in [BenchmarkKind::Clean, BenchmarkKind::Textured] {
        for size in [(100, 576), (16, 2000), (2000, 16)] {
            let (mut renderer, snapshot) = drawn(kind, size, 1);
            assert_eq!(snapshot.take(&mut renderer).dimensions(), size);
        }
    }
}
