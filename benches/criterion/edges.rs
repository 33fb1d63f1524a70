//! The edge detectors on one frame of 768x576 pixels; with `--features imageproc` that of the crate
//! `imageproc` too.

#![allow(missing_docs)]

use circle_scenes::scene::Scene;
use criterion::{Criterion, criterion_group, criterion_main};
use hough_heuristic::{Canny, EdgeDetector};

fn edges(criterion: &mut Criterion) {
    let (mut cluttered, mut noisy) = (Scene::default(), Scene::default());
    cluttered.distractors = 20;
    noisy.noise = 30.0;
    let scenes = [
        ("1 ball", Scene::default()),
        ("20 distractors", cluttered),
        ("noise 30", noisy),
    ];
    let mut group = criterion.benchmark_group("edges");
    for (name, scene) in scenes {
        let (frame, _) = scene.render();
        let mut canny = Canny::default();
        group.bench_function(format!("Canny/{name}"), |bencher| {
            bencher.iter(|| canny.detect_edges(&frame).pixels().len());
        });
        #[cfg(feature = "imageproc")]
        {
            let mut imageproc =
                hough_heuristic::ImageprocCanny::new(30.0, 70.0).expect("usable thresholds");
            group.sample_size(10);
            group.bench_function(format!("imageproc/{name}"), |bencher| {
                bencher.iter(|| imageproc.detect_edges(&frame).pixels().len());
            });
        }
    }
    group.finish();
}

criterion_group!(benches, edges);
criterion_main!(benches);
