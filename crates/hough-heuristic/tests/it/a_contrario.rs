//! The detector whose score can be trusted: what holds for every detector, and what it promises
//! beyond.

use std::fmt::Write as _;
use std::path::Path;

use hough_heuristic::image::{GrayImage, Luma};
use hough_heuristic::{
    AContrario, AContrarioConfig, Circle, CircleDetector, ConfigError, detect_circles,
};
use proptest::prelude::*;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{Rng, SeedableRng};

use circle_scenes::patterns::patterns;
use circle_scenes::scene::{Scene, same};
use circle_scenes::simple::{Difficulty, Kind, ONE};

use crate::detectors::SCENE;

pub(crate) fn with(change: impl FnOnce(&mut AContrarioConfig)) -> AContrario {
    let mut config = AContrarioConfig {
        max_radius: Some(60.0),
        ..AContrarioConfig::default()
    };
    change(&mut config);
    AContrario::new(config).unwrap()
}

pub(crate) fn plain() -> AContrario {
    with(|_| ())
}

#[test]
fn one_call_finds_all_circles_and_nothing_else() {
    for seed in 0..8 {
        let (frame, balls) = Scene { seed, ..SCENE }.render();
        let (found, effort) = detect_circles(&frame, 8.0, 60.0).unwrap();
        assert!(!effort.ended_by_budget && !effort.ended_by_count);
        assert_eq!(found.len(), balls.len(), "seed {seed}: {found:?}");
        for ball in &balls {
            assert!(
                found.iter().any(|f| same(&f.circle, ball, 0.35)),
                "seed {seed}: {ball:?}"
            );
        }
    }
    let frame = GrayImage::new(100, 100);
    assert!(matches!(
        detect_circles(&frame, 3.0, 60.0),
        Err(ConfigError::OutOfRange { .. })
    ));
    assert!(matches!(
        detect_circles(&frame, 60.0, 8.0),
        Err(ConfigError::RadiusRange { .. })
    ));
}

#[test]
fn measurements_and_effort_are_those_of_the_last_frame() {
    let frames: Vec<GrayImage> = [
        (0, 240, 180),
        (1, 100, 90),
        (2, 320, 200),
        (3, 150, 200),
        (4, 40, 30),
    ]
    .map(|(seed, width, height)| {
        let radius = (9.0, 14.0);
        let scene = Scene {
            seed,
            width,
            height,
            radius,
            ..SCENE
        };
        scene.render().0
    })
    .into();
    let mut used = plain();
    for first in &frames {
        for second in &frames {
            used.detect(first).unwrap();
            let found = used.detect(second).unwrap().len();
            let mut fresh = plain();
            fresh.detect(second).unwrap();
            assert_eq!(used.measurements(), fresh.measurements());
            assert_eq!(used.measurements().len(), found);
            assert_eq!(used.effort(), fresh.effort());
        }
    }
}

#[test]
fn the_seed_decides_the_order_and_little_else() {
    let (frame, balls) = SCENE.render();
    for seed in [0, 1, 2, 99, u64::MAX] {
        let found = with(|config| config.seed = seed)
            .detect(&frame)
            .unwrap()
            .to_vec();
        assert_eq!(
            found,
            with(|config| config.seed = seed).detect(&frame).unwrap()
        );
        for ball in &balls {
            assert!(
                found.iter().any(|f| same(&f.circle, ball, 0.35)),
                "seed {seed}"
            );
        }
    }
}

/// Counts the balls of a kind of scene that are found to 2 px, and the other circles.
fn found_of(kind: &Kind, seed: u64, frames: u64) -> (usize, usize) {
    let mut detector = AContrario::new(AContrarioConfig::default()).unwrap();
    let (mut hits, mut others) = (0, 0);
    for number in 0..frames {
        let (frame, balls) = kind.render((768, 576), seed, number);
        let found = detector.detect(&frame).unwrap().to_vec();
        let is_found = |ball: &&Circle| found.iter().any(|one| same(&one.circle, ball, 2.0));
        let hit = balls.iter().filter(is_found).count();
        hits += hit;
        others += found.len() - hit;
    }
    (hits, others)
}

#[test]
fn balls_in_noise_are_found() {
    for (noise, least) in [(10.0, 11), (25.0, 11), (40.0, 10)] {
        let (hits, others) = found_of(&Kind { noise, ..ONE }, 21, 12);
        assert!(
            hits >= least && others <= 1,
            "noise {noise}: {hits} of 12, and {others}"
        );
    }
}

#[test]
fn balls_that_are_hidden_in_part_or_moved_are_found() {
    for (difficulty, seed, least) in [(Difficulty::Occluded, 1, 12), (Difficulty::Moving, 3, 14)] {
        let (hits, others) = found_of(&Kind { difficulty, ..ONE }, seed, 15);
        assert!(
            hits >= least && others <= 1,
            "{difficulty:?}: {hits} of 15, and {others}"
        );
    }
}

/// No row and no column meets such a disc at two opposite sides.
#[test]
fn discs_are_found_of_which_more_than_half_is_hidden_aslant() {
    for (dx, dy) in [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)] {
        let frame = GrayImage::from_fn(320, 240, |x, y| {
            let (x, y) = (f64::from(x) - 160.3, f64::from(y) - 118.7);
            let hidden = (x * dx + y * dy) * std::f64::consts::FRAC_1_SQRT_2 > -0.2 * 40.0;
            // A cover of the ground's level would make it a piece of a disc, cut off straight.
            Luma([if hidden {
                120
            } else if x.hypot(y) < 40.0 {
                40
            } else {
                200
            }])
        });
        let found = plain().detect(&frame).unwrap().to_vec();
        assert_eq!(found.len(), 1, "{dx} {dy}: {found:?}");
        let disc = Circle {
            x: 160.3,
            y: 118.7,
            radius: 40.0,
        };
        assert!(same(&found[0].circle, &disc, 1.0), "{dx} {dy}: {found:?}");
    }
}

#[test]
fn frames_of_any_size_pass() {
    let mut detector = with(|config| config.min_radius = Some(4.0));
    for width in (0..30).chain([79, 80, 81, 160, 163]) {
        for height in [0, 1, 2, 3, 11, 12, 13, 24, 80, 161] {
            for (w, h) in [(width, height), (height, width)] {
                let frame = GrayImage::from_fn(w, h, |x, y| Luma([(x * 37 + y * 91) as u8]));
                detector.detect(&frame).unwrap();
            }
        }
    }
}

#[cfg(feature = "parallel")]
#[test]
fn any_number_of_threads_finds_the_same() {
    let pool = |threads| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap()
    };
    for (width, height, noise) in [(1500, 1101, 2.0), (1101, 1500, 20.0)] {
        let scene = Scene {
            width,
            height,
            noise,
            balls: 6,
            radius: (20.0, 55.0),
            ..SCENE
        };
        let (frame, balls) = scene.render();
        let detector = || with(|config| config.max_radius = Some(130.0));
        let mut one = detector();
        pool(1).install(|| one.detect(&frame).unwrap());
        assert!(2 * one.measurements().len() > balls.len());
        for threads in [2, 3, 8] {
            let mut several = detector();
            pool(threads).install(|| several.detect(&frame).unwrap());
            assert_eq!(several.measurements(), one.measurements());
            assert_eq!(several.effort(), one.effort());
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn random_bytes_do_no_harm(
        width in 12u32..120, height in 12u32..120, seed: u64, levels in 1u8..=255,
    ) {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let frame = GrayImage::from_fn(width, height, |_, _| Luma([rng.next_u32() as u8 % levels]));
        let mut detector = with(|config| {
            config.min_radius = Some(4.0);
            config.min_score = 0.0;
        });
        for detection in detector.detect(&frame).unwrap() {
            prop_assert!((0.0..=1.0).contains(&detection.score));
            prop_assert!(detection.circle.x.is_finite() && detection.circle.y.is_finite());
            prop_assert!((4.0..=60.0).contains(&detection.circle.radius));
        }
        for measurement in detector.measurements() {
            prop_assert!(measurement.centre_error > 0.0 && measurement.radius_error > 0.0);
            prop_assert!((0.0..=1.0).contains(&measurement.axis_ratio));
        }
    }

    #[test]
    fn any_last_circle_can_be_followed(
        x in -1e3f64..1e3, y in -1e3f64..1e3, radius in -1e2f64..1e3, reach in -10f64..1e3,
    ) {
        let (frame, _) = SCENE.render();
        plain().track(&frame, &Circle { x, y, radius }, reach).unwrap();
    }
}

#[test]
fn no_pattern_takes_more_than_the_budget() {
    for (name, frame) in patterns(400, 300) {
        for draws_per_megapixel in [1_000, 20_000, 200_000] {
            let mut detector = with(|config| {
                config.min_radius = Some(8.0);
                config.max_radius = Some(140.0);
                config.draws_per_megapixel = draws_per_megapixel;
            });
            detector.detect(&frame).unwrap();
            let effort = detector.effort();
            // The frame counts as one of a quarter of a megapixel, and each circle adds its own.
            let draws = u64::from(draws_per_megapixel) / 4 + 50 * effort.proven;
            let looks = 4 * u64::from(draws_per_megapixel) + 8_000 * effort.proven;
            // What is begun on is finished: the partners of a point, the circle they make, and its
            // proofs.
            assert!(effort.draws <= draws + 6, "{name}: {effort:?}");
            assert!(effort.looks <= looks + 20_000, "{name}: {effort:?}");
            let within = effort.draws < draws && effort.looks < looks + 14_000;
            assert!(effort.ended_by_budget || within, "{name}: {effort:?}");
        }
    }
}

#[test]
fn an_empty_budget_is_refused_and_a_spent_one_is_reported() {
    let refused = |change: fn(&mut AContrarioConfig)| {
        let mut config = AContrarioConfig::default();
        change(&mut config);
        AContrario::new(config).unwrap_err()
    };
    for error in [
        refused(|config| config.draws_per_megapixel = 0),
        refused(|config| config.milliseconds_per_megapixel = Some(0.0)),
        refused(|config| config.milliseconds_per_megapixel = Some(f64::NAN)),
        refused(|config| config.min_radius = Some(3.9)),
        refused(|config| config.min_radius = Some(f64::NAN)),
        refused(|config| config.max_circles = 0),
        refused(|config| config.min_score = 1.1),
        refused(|config| config.contrast = 0.0),
        refused(|config| config.max_radius = Some(0.0)),
        refused(|config| config.min_distance = f64::NAN),
    ] {
        assert!(matches!(
            error,
            ConfigError::OutOfRange { .. } | ConfigError::RadiusRange { .. }
        ));
    }
    let (frame, balls) = SCENE.render();
    let mut hasty = with(|config| config.draws_per_megapixel = 1);
    hasty.detect(&frame).unwrap();
    assert!(hasty.effort().draws <= 1 + 50 * balls.len() as u64);
    assert!(hasty.effort().ended_by_budget);
    let mut late = with(|config| config.milliseconds_per_megapixel = Some(1e-6));
    assert_eq!(late.detect(&frame).unwrap(), []);
    let effort = late.effort();
    assert!(effort.ended_by_budget);
    assert_eq!(
        (effort.draws, effort.looks),
        (0, 0),
        "work after the deadline"
    );
    let (mut calm, mut ample) = (
        plain(),
        with(|config| config.milliseconds_per_megapixel = Some(1e6)),
    );
    let found = calm.detect(&frame).unwrap();
    assert_eq!(ample.detect(&frame).unwrap(), found);
    assert!(!calm.effort().ended_by_budget && !ample.effort().ended_by_budget);
}

#[test]
fn a_circle_is_followed_with_less_effort() {
    let scene = Scene {
        width: 400,
        height: 300,
        balls: 1,
        distractors: 8,
        ..SCENE
    };
    let (frame, balls) = scene.render();
    let ball = balls[0];
    let mut detector = plain();
    let found = detector.detect(&frame).unwrap().to_vec();
    let full = detector.effort();
    let one = found.iter().find(|f| same(&f.circle, &ball, 0.35)).unwrap();

    let moved = Circle {
        x: ball.x + 5.0,
        y: ball.y - 4.0,
        radius: ball.radius + 1.0,
    };
    assert!(detector.track(&frame, &moved, 10.0).unwrap());
    let followed = detector.measurements().to_vec();
    assert_eq!(followed.len(), 1);
    assert!(
        same(&followed[0].circle, &one.circle, 0.1),
        "{followed:?} {one:?}"
    );
    assert!(
        2 * detector.effort().looks < full.looks,
        "{:?} {full:?}",
        detector.effort()
    );

    // Too far away for the reach: the whole frame.
    let away = Circle {
        x: ball.x + 30.0,
        ..ball
    };
    assert!(!detector.track(&frame, &away, 10.0).unwrap());
    assert_eq!(detector.measurements().len(), found.len());
    for nowhere in [f64::NAN, f64::INFINITY, -1e9] {
        assert!(
            !detector
                .track(&frame, &Circle { x: nowhere, ..ball }, 10.0)
                .unwrap()
        );
        assert!(!detector.track(&frame, &ball, nowhere).unwrap());
    }
}

/// The detections of some scenes, as they were when last looked at; `REGENERATE=1` writes them
/// anew.
#[test]
fn detections_are_the_golden_ones() {
    let mut text = String::from("# scene: x y radius score, pixels\n");
    let scenes = [
        ("three balls", SCENE),
        (
            "noise",
            Scene {
                noise: 20.0,
                ..SCENE
            },
        ),
        (
            "many",
            Scene {
                width: 400,
                height: 300,
                balls: 9,
                distractors: 10,
                radius: (9.0, 40.0),
                ..SCENE
            },
        ),
    ];
    let mut frames: Vec<_> = scenes
        .iter()
        .map(|(name, scene)| ((*name).to_owned(), scene.render().0))
        .collect();
    let discs = |(name, _): &(String, GrayImage)| name == "grid-of-discs-24";
    frames.extend(patterns(200, 160).into_iter().filter(discs));
    for (name, frame) in &frames {
        let mut detector = with(|config| config.max_circles = 32);
        for found in detector.detect(frame).unwrap() {
            let Circle { x, y, radius } = found.circle;
            writeln!(text, "{name}: {x:.2} {y:.2} {radius:.2} {:.3}", found.score).unwrap();
        }
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/a_contrario.txt");
    if std::env::var_os("REGENERATE").is_some() {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, &text).unwrap();
    }
    let golden = std::fs::read_to_string(&path).unwrap();
    // A last digit may differ where a square root of the scenes was rounded otherwise.
    let numbers = |line: &str| -> Vec<f64> {
        let numbers = line.rsplit(": ").next().unwrap_or_default().split(' ');
        numbers.filter_map(|number| number.parse().ok()).collect()
    };
    assert_eq!(text.lines().count(), golden.lines().count(), "{text}");
    for (now, then) in text.lines().zip(golden.lines()).skip(1) {
        assert_eq!(now.split(": ").next(), then.split(": ").next());
        for (a, b) in numbers(now).into_iter().zip(numbers(then)) {
            assert!((a - b).abs() < 0.015, "{now} / {then}");
        }
    }
}
