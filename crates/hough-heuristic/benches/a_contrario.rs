//! The a contrario detector on whole frames, edges included, and following a circle.

#![allow(missing_docs)]

#[path = "../scenes/contest.rs"]
mod contest;
#[path = "../scenes/scenes.rs"]
mod scenes;
#[path = "../scenes/staged.rs"]
mod staged;

use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use hough_heuristic::{AContrario, AContrarioConfig, CircleDetector};

fn frames(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("a contrario");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1));
    for round in contest::rounds()
        .into_iter()
        .filter(|round| !round.fixed_thresholds)
    {
        let (frame, balls) = round.scene.render();
        let mut detector = AContrario::new(AContrarioConfig::default()).expect("usable settings");
        group.bench_function(round.name, |bencher| {
            bencher.iter(|| detector.detect(&frame).expect("a usable frame").len());
        });
        if let [ball] = balls[..] {
            group.bench_function(format!("{}, followed", round.name), |bencher| {
                bencher.iter(|| detector.track(&frame, &ball, 10.0));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, frames);
criterion_main!(benches);
