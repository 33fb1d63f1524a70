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

fn scenes() -> [(&'static str, Scene); 6] {
    let scene = Scene {
        radius: (20.0, 140.0),
        ..Scene::default()
    };
    let sized = |width, height, radius| Scene {
        width,
        height,
        radius,
        ..scene
    };
    let (mut crowded, mut cluttered, mut noisy) = (scene, scene, scene);
    (crowded.balls, crowded.radius) = (20, (20.0, 60.0));
    cluttered.distractors = 20;
    noisy.noise = 15.0;
    [
        ("192x144, 1 ball", sized(192, 144, (10.0, 35.0))),
        ("768x576, 1 ball", scene),
        ("768x576, 20 distractors", cluttered),
        ("768x576, noise 15", noisy),
        ("768x576, 20 balls", crowded),
        ("1920x1080, 1 ball", sized(1920, 1080, scene.radius)),
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
