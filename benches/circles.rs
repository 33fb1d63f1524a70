//! The circle detectors on the same frames, edges included: the a contrario detector, the paper's
//! heuristic, the randomized and the standard Hough transform.
//!
//! `cargo bench` from the workspace's root runs them; `cargo bench -- "1920x1080"` those of a size.

#![allow(missing_docs)]

use std::time::Duration;

use circle_scenes::contest::detector;
use circle_scenes::scene::Scene;
use circle_scenes::staged::TRANSFORMS;
use criterion::{
    BenchmarkGroup, Criterion, criterion_group, criterion_main, measurement::WallTime,
};
use hough_heuristic::{AContrario, AContrarioConfig, Canny, CircleDetector};

/// The standard transform takes seconds on frames that are wider.
const WIDEST_SHT: u32 = 768;

fn scenes() -> Vec<(&'static str, Scene)> {
    let scene = Scene {
        radius: (20.0, 140.0),
        ..Scene::default()
    };
    let small = Scene {
        width: 192,
        height: 144,
        radius: (10.0, 35.0),
        ..scene
    };
    let large = Scene {
        width: 1920,
        height: 1080,
        ..scene
    };
    let crowded = Scene {
        balls: 20,
        radius: (20.0, 60.0),
        ..scene
    };
    vec![
        ("192x144, 1 ball", small),
        ("768x576, 1 ball", scene),
        (
            "768x576, 20 distractors",
            Scene {
                distractors: 20,
                ..scene
            },
        ),
        (
            "768x576, noise 15",
            Scene {
                noise: 15.0,
                ..scene
            },
        ),
        ("768x576, 20 balls", crowded),
        ("1920x1080, 1 ball", large),
    ]
}

fn detectors(criterion: &mut Criterion) {
    for (name, scene) in scenes() {
        let (frame, balls) = scene.render();
        let mut group = criterion.benchmark_group(name);
        group
            .sample_size(10)
            .warm_up_time(Duration::from_millis(300))
            .measurement_time(Duration::from_secs(1));
        let mut run = |name: &str, detector: &mut dyn CircleDetector| {
            bench(&mut group, name, || {
                detector.detect(&frame).expect("a usable frame").len()
            });
        };
        let config = AContrarioConfig::default();
        let mut a_contrario = AContrario::new(config).expect("usable settings");
        run("a contrario", &mut a_contrario);
        for name in TRANSFORMS {
            if name != "SHT" || scene.width <= WIDEST_SHT {
                let canny = Canny::default();
                run(
                    name,
                    &mut *detector(name, &scene, canny).expect("usable settings"),
                );
            }
        }
        if let [ball] = balls[..] {
            bench(&mut group, "a contrario, tracking", || {
                a_contrario
                    .track(&frame, &ball, 10.0)
                    .map(usize::from)
                    .expect("a usable frame")
            });
        }
        group.finish();
    }
}

fn bench(group: &mut BenchmarkGroup<'_, WallTime>, name: &str, mut work: impl FnMut() -> usize) {
    group.bench_function(name, |bencher| bencher.iter(&mut work));
}

criterion_group!(benches, detectors);
criterion_main!(benches);
