//! Times of the kinematics, over a thousand poses each so that branches are not learned by heart.
#![allow(missing_docs, clippy::unwrap_used)]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use puma_val2::{ArmDynamics, Joints, PumaParams};
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

fn kinematics(c: &mut Criterion) {
    let arm = PumaParams::unimation();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(560);
    let joints: Vec<Joints> = (0..1000)
        .map(|_| {
            Joints(std::array::from_fn(|i| {
                random.random_range(arm.ranges[i].min..arm.ranges[i].max)
            }))
        })
        .collect();
    let poses: Vec<_> = joints.iter().map(|j| arm.forward(j)).collect();
    let mut group = c.benchmark_group("thousand poses");
    group.throughput(Throughput::Elements(1000));
    group.bench_function("forward", |b| {
        b.iter(|| {
            for j in &joints {
                black_box(arm.forward(black_box(j)));
            }
        });
    });
    group.bench_function("inverse, eight postures", |b| {
        b.iter(|| {
            for p in &poses {
                let _ = black_box(arm.inverse(black_box(p)));
            }
        });
    });
    group.bench_function("jacobian", |b| {
        b.iter(|| {
            for j in &joints {
                black_box(arm.jacobian(black_box(j)));
            }
        });
    });
    let dynamics = ArmDynamics::corke();
    group.bench_function("inverse dynamics", |b| {
        b.iter(|| {
            for j in &joints {
                black_box(dynamics.inverse(&arm, black_box(j), j.0, j.0));
            }
        });
    });
    group.finish();
}

criterion_group!(benches, kinematics);
criterion_main!(benches);
