//! Updates per second on the paper's 90 states by 81 actions, and the cost of files and plans.
//!
//! `cargo bench -p library-benches --features all --bench learning`. The comparison with other
//! crates, with all optimisation across crates, is in `benches/peers`.
#![allow(
    clippy::print_stdout,
    clippy::unwrap_used,
    missing_docs,
    reason = "a benchmark tells what it finds, and stops if it cannot go on"
)]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use qtable::{
    Action, Boltzmann, CachedBoltzmann, EpsilonGreedy, ModelEnvironment, Policy, QLearning, QTable,
    Schedule, State, Status, Step,
};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

const STATES: usize = 90;
const ACTIONS: usize = 81;
const UPDATES: u64 = 10_000;

#[inline(always)]
fn step(state: State, action: Action) -> Step {
    let mixed = (state.0 * ACTIONS + action.0).wrapping_mul(2_654_435_761) >> 7;
    let reward = if mixed & 63 == 0 { 1.0 } else { 0.0 };
    Step {
        observation: State(mixed % STATES),
        reward,
        status: Status::Continuing,
    }
}

fn constant(value: f64) -> Schedule {
    Schedule::constant(value).unwrap()
}

fn follow(c: &mut Criterion, name: &str, mut policy: impl Policy) {
    let mut table = QTable::new(STATES, ACTIONS).unwrap();
    let mut learner = QLearning::new(constant(0.1), 0.9).unwrap();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut state = State(0);
    let mut group = c.benchmark_group("updates");
    group.throughput(Throughput::Elements(UPDATES));
    group.bench_function(name, |b| {
        b.iter(|| {
            for _ in 0..UPDATES {
                let action = policy.choose(&table, state, &mut rng);
                let step = step(state, action);
                learner.update(&mut table, state, action, &step).unwrap();
                state = step.observation;
            }
            state
        });
    });
}

fn updates(c: &mut Criterion) {
    follow(
        c,
        "epsilon-greedy f64",
        EpsilonGreedy::new(constant(0.1)).unwrap(),
    );
    follow(
        c,
        "Boltzmann plain f64",
        Boltzmann::new(constant(1.0)).unwrap(),
    );

    let table = QTable::new(STATES, ACTIONS).unwrap();
    let mut cached = CachedBoltzmann::new(&table, 1.0).unwrap();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut state = State(0);
    let mut group = c.benchmark_group("updates");
    group.throughput(Throughput::Elements(UPDATES));
    group.bench_function("Boltzmann cached f32", |b| {
        b.iter(|| {
            for _ in 0..UPDATES {
                let action = cached.choose(state, &mut rng);
                let step = step(state, action);
                cached.update(state, action, &step, 0.1, 0.9).unwrap();
                state = step.observation;
            }
            state
        });
    });
}

fn rebuilding(c: &mut Criterion) {
    let table = QTable::new(STATES, ACTIONS).unwrap();
    let mut cached = CachedBoltzmann::new(&table, 1.0).unwrap();
    c.bench_function("change of the temperature, 90x81", |b| {
        b.iter(|| cached.set_temperature(black_box(1.5)).unwrap());
    });
}

fn files(c: &mut Criterion) {
    let mut table = QTable::new(540, ACTIONS).unwrap();
    for state in 0..540 {
        for action in 0..ACTIONS {
            let value = ((state * ACTIONS + action) as f64).sin() * 1000.0;
            table.set(State(state), Action(action), value).unwrap();
            for _ in 0..(state + action) % 600 {
                table.visit(State(state), Action(action)).unwrap();
            }
        }
    }
    let bytes = qtable::encode("table/1", &table).unwrap();
    println!("a table of 540x81 is {} bytes in a file", bytes.len());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("table.qt");
    c.bench_function("save 540x81, synced to disk", |b| {
        b.iter(|| qtable::save(&path, "table/1", &table).unwrap());
    });
    c.bench_function("load 540x81", |b| {
        b.iter(|| qtable::load::<QTable>(&path, "table/1").unwrap());
    });
    c.bench_function("encode 540x81", |b| {
        b.iter(|| qtable::encode("table/1", &table).unwrap());
    });
    c.bench_function("decode 540x81", |b| {
        b.iter(|| qtable::decode::<QTable>("table/1", &bytes).unwrap());
    });
}

fn planning(c: &mut Criterion) {
    let taxi = ModelEnvironment::taxi().unwrap();
    c.bench_function("value iteration, taxi", |b| {
        b.iter(|| taxi.model().value_iteration(0.99, 1e-10).unwrap());
    });
}

criterion_group!(benches, updates, rebuilding, files, planning);
criterion_main!(benches);
