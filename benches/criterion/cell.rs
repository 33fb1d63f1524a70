//! Time of a rendered frame, and of features without one.
//!
//! Wall time: on a busy machine compare within one run. Frames: the laboratory from a search pose
//! and from a goal pose. Steps: a move of `JT2` and `JT3` with a check of the limits and the
//! features after it; and the same through [`SimulatedArm`] and [`FeatureCamera`].
#![allow(missing_docs)] // The macros of criterion.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use pipeline_sim::{
    Ball, Cell, Errors, FeatureCamera, Recipe, Renderer, Scene, SharedCell, SimulatedArm, Workspace,
};
use puma_val2::{JointDelta, Manipulator};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

fn frames(c: &mut Criterion) {
    let cell = Cell::paper(Ball::at(0.60, 0.15, -0.10));
    let search = Workspace::paper().search_poses()[3];
    let goal = cell
        .goal_pose(Cell::REACHING_JT5_DEGREES)
        .expect("within reach");
    let mut renderer = Renderer::new(&Scene::laboratory(), 1);
    let mut group = c.benchmark_group("frame");
    group.bench_function("laboratory, search pose", |b| {
        b.iter(|| renderer.render(&cell, black_box(&search)).len());
    });
    group.bench_function("laboratory, goal pose", |b| {
        b.iter(|| renderer.render(&cell, black_box(&goal)).len());
    });
    for name in ["clutter", "defocus", "interlaced", "distorted"] {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let recipe = Recipe::named(name).expect("a recipe");
        let drawn = recipe.draw((768, 576), &mut rng);
        let (mut renderer, snapshot) = drawn.expect("a frame of pixels");
        group.bench_function(name, |b| {
            b.iter(|| black_box(&snapshot).take(&mut renderer).len());
        });
    }
    group.finish();
}

fn steps(c: &mut Criterion) {
    let nominal = Cell::paper(Ball::at(0.60, 0.15, -0.10));
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
    let starts: Vec<_> = (0..256)
        .filter_map(|_| nominal.exploring_start(&mut rng))
        .collect();
    let moves: Vec<_> = (0..9)
        .map(|i| {
            JointDelta::from_degrees([
                0.0,
                1.5 * (f64::from(i) - 4.0),
                f64::from(i % 3) - 1.0,
                0.0,
                0.0,
                0.0,
            ])
        })
        .collect();
    let mut group = c.benchmark_group("step");
    let mut k = 0_usize;
    group.bench_function("features", |b| {
        b.iter(|| {
            k += 1;
            let (cell, joints) = &starts[k % starts.len()];
            let after = *joints + moves[k % 9];
            cell.within_limits(&after).then(|| cell.features(&after))
        });
    });
    let (cell, joints) = starts[0];
    let shared = SharedCell::new(cell);
    let noisy = Errors {
        feature_noise: 0.5,
        ..Errors::none()
    };
    shared.set_errors(&noisy).expect("sound noise");
    let mut arm = SimulatedArm::new(shared.clone(), joints).expect("within limits");
    let mut camera = FeatureCamera::new(shared, arm.pose(), 3);
    let mut sign = 1.0;
    group.bench_function("arm and feature camera", |b| {
        b.iter(|| {
            sign = -sign;
            arm.move_by(JointDelta::from_degrees([0.0, sign, -sign, 0.0, 0.0, 0.0]))
                .expect("within limits");
            camera.look()
        });
    });
    group.finish();
}

criterion_group!(benches, frames, steps);
criterion_main!(benches);
