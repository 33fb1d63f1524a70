//! The heuristic against the randomized and the standard Hough transform, from simple scenes to
//! hard ones.
//!
//! The edges are found beforehand: only the circle search is timed.

#![allow(missing_docs)]

#[path = "../scenes/contest.rs"]
mod contest;
#[path = "../scenes/scenes.rs"]
mod scenes;
#[path = "../scenes/staged.rs"]
mod staged;

use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use hough_heuristic::EdgeDetector;

fn detectors(criterion: &mut Criterion) {
    for round in contest::rounds() {
        let (frame, _) = round.scene.render();
        let edges = round.canny().detect_edges(&frame).clone();
        let mut group = criterion.benchmark_group(round.name);
        group
            .sample_size(10)
            .warm_up_time(Duration::from_millis(300))
            .measurement_time(Duration::from_secs(1));
        for name in contest::DETECTORS {
            let mut detector =
                contest::detector(name, &round.scene, edges.clone()).expect("usable settings");
            group.bench_function(name, |bencher| {
                bencher.iter(|| detector.detect(&frame).expect("a usable frame").len());
            });
        }
        group.finish();
    }
}

criterion_group!(benches, detectors);
criterion_main!(benches);
