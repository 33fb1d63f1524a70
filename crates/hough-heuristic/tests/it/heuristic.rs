use hough_heuristic::image::{GrayImage, Luma};
use hough_heuristic::{
    Canny, CircleDetector, ConfigError, EdgeDetector, Heuristic, HeuristicConfig, Region, Sampling,
};

use crate::scenes::{Scene, same};

/// A small ball amid a few thousand edge pixels of clutter.
fn cluttered(seed: u64) -> Scene {
    Scene {
        distractors: 25,
        radius: (28.0, 28.0),
        seed,
        ..Scene::default()
    }
}

#[test]
fn a_small_ball_in_clutter_is_found_reliably() {
    let mut detector = Heuristic::with_canny(HeuristicConfig::default()).unwrap();
    let mut edges = Vec::new();
    for seed in 0..30 {
        let (frame, balls) = cluttered(seed).render();
        let found = detector.detect(&frame);
        edges.push(detector.edges().pixels().len());
        assert!(
            found.iter().any(|f| same(&f.circle, &balls[0], 1.0)),
            "seed {seed}: {found:?} {:?}",
            balls[0]
        );
    }
    let mean = edges.iter().sum::<usize>() / edges.len();
    assert!(
        (3000..6500).contains(&mean),
        "the scenes have {mean} edge pixels"
    );
}

#[test]
fn balls_of_every_radius_are_found_to_a_third_of_a_pixel() {
    let mut detector = Heuristic::with_canny(HeuristicConfig::default()).unwrap();
    for (seed, radius) in [20.0, 23.7, 40.0, 77.7, 132.0, 200.0, 280.0]
        .into_iter()
        .enumerate()
    {
        let scene = Scene {
            radius: (radius, radius),
            distractors: 5,
            seed: seed as u64,
            ..Scene::default()
        };
        let (frame, balls) = scene.render();
        let found = detector.detect(&frame);
        assert_eq!(found.len(), 1);
        assert!(
            same(&found[0].circle, &balls[0], 0.34),
            "{found:?} {balls:?}"
        );
        assert!(found[0].score > 0.9 && found[0].score <= 1.0);
    }
}

#[test]
fn several_balls_come_best_first() {
    let scene = Scene {
        balls: 6,
        radius: (20.0, 60.0),
        ..Scene::default()
    };
    let (frame, balls) = scene.render();
    let config = HeuristicConfig {
        max_radius: 80.0,
        max_circles: 32,
        ..HeuristicConfig::default()
    };
    let found = Heuristic::with_canny(config).unwrap().detect(&frame);
    assert_eq!(found.len(), 6, "{found:?}");
    for ball in &balls {
        assert!(found.iter().any(|f| same(&f.circle, ball, 0.5)), "{ball:?}");
    }
    assert!(found.windows(2).all(|pair| pair[0].score >= pair[1].score));
}

#[test]
fn only_centres_in_the_region_are_reported() {
    let scene = Scene {
        balls: 6,
        radius: (20.0, 60.0),
        ..Scene::default()
    };
    let (frame, balls) = scene.render();
    let region = Region::in_frame((0, 0), (384, 576), frame.dimensions()).unwrap();
    let config = HeuristicConfig {
        region: Some(region),
        max_circles: 9,
        ..HeuristicConfig::default()
    };
    let found = Heuristic::with_canny(config).unwrap().detect(&frame);
    assert_eq!(
        found.len(),
        balls.iter().filter(|ball| region.holds(ball)).count()
    );
    assert!(found.iter().all(|f| region.holds(&f.circle)));
}

#[test]
fn frame_and_configuration_alone_decide() {
    let frames: Vec<_> = (0..3).map(|seed| cluttered(seed).render().0).collect();
    for sampling in [Sampling::Near, Sampling::Anywhere] {
        let config = HeuristicConfig {
            sampling,
            max_circles: 4,
            ..HeuristicConfig::default()
        };
        let fresh =
            |frame: &GrayImage| Heuristic::with_canny(config.clone()).unwrap().detect(frame);
        let mut used = Heuristic::with_canny(config.clone()).unwrap();
        for index in [0, 1, 0, 2, 1] {
            assert_eq!(used.detect(&frames[index]), fresh(&frames[index]));
        }
        assert_eq!(used.detect(&GrayImage::new(0, 0)), []);
        assert_eq!(used.edges().pixels(), []);
        assert_eq!(used.detect(&frames[2]), fresh(&frames[2]));
    }
}

#[test]
fn frames_without_circles_give_none() {
    let edges: Box<dyn EdgeDetector> = Box::new(Canny::default());
    let mut detector = Heuristic::new(HeuristicConfig::default(), edges).unwrap();
    for (width, height) in [
        (0, 0),
        (1, 1),
        (1, 500),
        (500, 1),
        (2, 2),
        (3, 3),
        (768, 576),
    ] {
        for grey in [0, 255] {
            let frame = GrayImage::from_pixel(width, height, Luma([grey]));
            assert_eq!(detector.detect(&frame), []);
        }
    }
}

#[test]
fn unusable_settings_are_refused_with_their_values() {
    let default = HeuristicConfig::default;
    for (config, value) in [
        (
            HeuristicConfig {
                theta: 1.5,
                ..default()
            },
            "1.5",
        ),
        (
            HeuristicConfig {
                theta: f64::NAN,
                ..default()
            },
            "NaN",
        ),
        (
            HeuristicConfig {
                iterations: 0,
                ..default()
            },
            "iterations is 0",
        ),
        (
            HeuristicConfig {
                min_radius: 50.0,
                max_radius: 40.0,
                ..default()
            },
            "50..=40",
        ),
        (
            HeuristicConfig {
                min_radius: -3.0,
                ..default()
            },
            "-3",
        ),
        (
            HeuristicConfig {
                max_radius: f64::INFINITY,
                ..default()
            },
            "inf",
        ),
        (
            HeuristicConfig {
                tolerance: 9.0,
                ..default()
            },
            "9",
        ),
        (
            HeuristicConfig {
                max_circles: 0,
                ..default()
            },
            "max_circles is 0",
        ),
        (
            HeuristicConfig {
                min_distance: -1.0,
                ..default()
            },
            "-1",
        ),
    ] {
        let error: ConfigError = Heuristic::with_canny(config).unwrap_err();
        assert!(error.to_string().contains(value), "{error}");
    }
}
