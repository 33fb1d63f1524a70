use hough_heuristic::{
    Acceptance, Canny, CircleDetector, ConfigError, EdgeDetector, Heuristic, HeuristicConfig,
};

use circle_scenes::scene::{Scene, same};

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
    for seed in 0..12 {
        let (frame, balls) = cluttered(seed).render();
        let found = detector.detect(&frame).unwrap().to_vec();
        edges.push(detector.stages().edges.pixels().len());
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
    let edges: Box<dyn EdgeDetector> = Box::new(Canny::default());
    let mut detector = Heuristic::new(HeuristicConfig::default(), edges).unwrap();
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
        let found = detector.detect(&frame).unwrap().to_vec();
        assert_eq!(found.len(), 1);
        assert!(
            same(&found[0].circle, &balls[0], 0.34),
            "{found:?} {balls:?}"
        );
        assert!(found[0].score > 0.9 && found[0].score <= 1.0);
    }
}

#[test]
fn unusable_settings_are_refused_with_their_values() {
    let with = |change: fn(&mut Acceptance)| {
        let mut config = HeuristicConfig::default();
        change(&mut config.accept);
        config
    };
    let no_draws = HeuristicConfig {
        iterations: 0,
        ..HeuristicConfig::default()
    };
    for (config, value) in [
        (no_draws, "iterations is 0"),
        (with(|accept| accept.theta = 1.5), "1.5"),
        (with(|accept| accept.theta = f64::NAN), "NaN"),
        (with(|accept| accept.max_radius = 14.0), "15..=14"),
        (with(|accept| accept.min_radius = -3.0), "-3"),
        (with(|accept| accept.max_radius = f64::INFINITY), "inf"),
        (with(|accept| accept.tolerance = 9.0), "9"),
        (with(|accept| accept.max_circles = 0), "max_circles is 0"),
        (with(|accept| accept.min_distance = -1.0), "-1"),
    ] {
        let error: ConfigError = Heuristic::with_canny(config).unwrap_err();
        assert!(error.to_string().contains(value), "{error}");
    }
}
