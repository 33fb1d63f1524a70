//! Distance of Q-learning from the known optimum of the larger and the random toys.

use qtable::{
    Comparison, EpsilonGreedy, ModelEnvironment, QLearning, QTable, Schedule, Training, Until, toys,
};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

const GAMMA: f64 = 0.99;

/// The learned policy beside the optimal one, and the value that the table gives the first state.
fn learned(
    toy: &ModelEnvironment,
    alpha: &Schedule,
    (epsilon, start): (f64, f64),
    actions: u64,
    seed: u64,
) -> (Comparison, f64) {
    let learner = QLearning::new(alpha.clone(), GAMMA).unwrap();
    let policy = EpsilonGreedy::new(Schedule::constant(epsilon).unwrap()).unwrap();
    let table = QTable::filled(toy.model().states(), toy.model().actions(), start).unwrap();
    let mut training = Training::new(toy, table, learner, policy)
        .unwrap()
        .with_episode_limit(200)
        .unwrap();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    training
        .run(&mut toy.clone(), Until::Actions(actions), &mut rng)
        .unwrap();
    let believed = training.table().max(toy.start()[0].0);
    let both = toy.compare(training.table(), GAMMA, 10_000).unwrap();
    (both, believed)
}

/// From every one of the 300 first states the policy is optimal: 13.07 steps on average, and a
/// value of 6.3275.
#[test]
fn the_taxi_is_driven_by_the_shortest_ways() {
    let taxi = toys::taxi().unwrap();
    for seed in 0..1 {
        let alpha = Schedule::constant(0.5).unwrap();
        let (both, _) = learned(&taxi, &alpha, (0.3, 0.0), 3_000_000, seed);
        assert!(
            (both.learned.success - 1.0).abs() < 1e-12,
            "seed {seed}: {both:?}"
        );
        assert!((both.optimal.value - 6.327_464).abs() < 1e-5, "{both:?}");
        assert!(
            (both.learned.value - both.optimal.value).abs() < 1e-9,
            "seed {seed}: {both:?}"
        );
    }
}

/// 14 steps, whose value is 0.99^13. The start is optimistic, because at random the goal is all but
/// never met.
#[test]
fn the_large_lake_is_crossed_in_14_steps() {
    let lake = toys::frozen_lake(&toys::FROZEN_LAKE_8X8, false).unwrap();
    for seed in 0..1 {
        let alpha = Schedule::constant(0.5).unwrap();
        let (both, believed) = learned(&lake, &alpha, (0.1, 1.0), 200_000, seed);
        assert!(
            (both.learned.steps - 14.0).abs() < 1e-9,
            "seed {seed}: {both:?}"
        );
        assert!(
            (both.learned.success - 1.0).abs() < 1e-12,
            "seed {seed}: {both:?}"
        );
        assert!(
            (believed / both.optimal.value - 1.0).abs() < 1e-6,
            "seed {seed}: {believed} {both:?}"
        );
    }
}

/// On the small lake the policy is the optimal one and the table believes in its value to 2 %; on
/// the large one the policy is worth 99.7 % of the optimum or more after two million actions, and
/// the belief is 2.5 % too high.
#[test]
fn slippery_lakes_are_crossed_as_well_as_can_be() {
    let alpha = Schedule::inverse_visits(1.0, 30.0).unwrap();
    for (map, how, actions, short, off) in [
        (
            &toys::FROZEN_LAKE_4X4[..],
            (0.5, 0.0),
            1_000_000,
            1e-6,
            0.03,
        ),
        (
            &toys::FROZEN_LAKE_8X8[..],
            (0.3, 1.0),
            2_000_000,
            0.005,
            0.04,
        ),
    ] {
        let lake = toys::frozen_lake(map, true).unwrap();
        for seed in 0..1 {
            let (both, believed) = learned(&lake, &alpha, how, actions, seed);
            let (found, best) = (both.learned.value, both.optimal.value);
            assert!(
                found > (1.0 - short) * best,
                "seed {seed}: worth {found} of {best}"
            );
            assert!(
                (believed / best - 1.0).abs() < off,
                "seed {seed}: believes in {believed} where {best} is true"
            );
        }
    }
}
