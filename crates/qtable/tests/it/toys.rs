//! The toy problems: Gymnasium's dynamics and the optima that are known of them.

use std::collections::BTreeSet;
use std::fmt::Write;

use qtable::{Action, Environment, Error, ModelEnvironment, State, toys};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

/// First states, then every outcome in every state that can be met, one a line.
fn listing(toy: &ModelEnvironment) -> (usize, String) {
    let mut met: BTreeSet<usize> = toy.start().iter().map(|(state, _)| state.0).collect();
    let mut open: Vec<usize> = met.iter().copied().collect();
    let model = toy.model();
    while let Some(state) = open.pop() {
        for action in 0..model.actions() {
            for outcome in model.outcomes(State(state), Action(action)) {
                if !outcome.terminated && met.insert(outcome.next.0) {
                    open.push(outcome.next.0);
                }
            }
        }
    }
    let mut text = String::new();
    let starts: BTreeSet<_> = toy
        .start()
        .iter()
        .map(|(state, p)| (state.0, format!("{p:.6}")))
        .collect();
    for (state, p) in starts {
        writeln!(text, "start {state} {p}").unwrap();
    }
    for &state in &met {
        for action in 0..model.actions() {
            for outcome in model.outcomes(State(state), Action(action)) {
                let (p, next) = (outcome.probability, outcome.next.0);
                let (reward, ends) = (outcome.reward, u8::from(outcome.terminated));
                writeln!(text, "{state} {action} {p:.6} {next} {reward:.1} {ends}").unwrap();
            }
        }
    }
    (met.len(), text)
}

/// The checksums are those of the same listing made from `env.unwrapped.P` and
/// `initial_state_distrib` of Gymnasium 1.4.0 in Python.
#[test]
fn the_dynamics_are_those_of_gymnasium() {
    let lake = |map: &[&str], slippery| toys::frozen_lake(map, slippery).unwrap();
    for (name, toy, states, checksum) in [
        (
            "lake 4x4, slippery",
            lake(&toys::FROZEN_LAKE_4X4, true),
            11,
            0x25c0_77c7,
        ),
        (
            "lake 4x4",
            lake(&toys::FROZEN_LAKE_4X4, false),
            11,
            0x66bb_0791,
        ),
        (
            "lake 8x8, slippery",
            lake(&toys::FROZEN_LAKE_8X8, true),
            53,
            0x8cd0_74e3,
        ),
        (
            "lake 8x8",
            lake(&toys::FROZEN_LAKE_8X8, false),
            53,
            0xaf0a_d373,
        ),
        ("cliff", toys::cliff_walking().unwrap(), 37, 0x2193_c14e),
        ("taxi", toys::taxi().unwrap(), 400, 0xdaa0_12b8),
    ] {
        let (met, text) = listing(&toy);
        assert_eq!(
            (met, crc32fast::hash(text.as_bytes())),
            (states, checksum),
            "{name}"
        );
    }
}

#[test]
fn the_optima_are_the_known_ones() {
    let optimum = |toy: &ModelEnvironment, gamma, limit| {
        let plan = toy.model().value_iteration(gamma, 1e-12).unwrap();
        toy.assess(&plan.table.greedy(), gamma, limit).unwrap()
    };
    for (map, value, ever) in [
        (&toys::FROZEN_LAKE_4X4[..], 0.542_025_932_000_5, 14.0 / 17.0),
        (&toys::FROZEN_LAKE_8X8[..], 0.414_640_361_799_99, 1.0),
    ] {
        let lake = toys::frozen_lake(map, true).unwrap();
        assert!((optimum(&lake, 0.99, 100_000).value - value).abs() < 1e-9);
        assert!((optimum(&lake, 1.0, 100_000).success - ever).abs() < 1e-6);
    }
    let lake = optimum(
        &toys::frozen_lake(&toys::FROZEN_LAKE_4X4, false).unwrap(),
        0.9,
        100,
    );
    assert!((lake.steps - 6.0).abs() < 1e-12 && (lake.value - 0.9f64.powi(5)).abs() < 1e-12);
    let cliff = optimum(&toys::cliff_walking().unwrap(), 1.0, 100);
    assert!((cliff.total_reward + 13.0).abs() < 1e-12 && (cliff.success - 1.0).abs() < 1e-12);
    let taxi = optimum(&toys::taxi().unwrap(), 1.0, 200);
    assert!((taxi.success - 1.0).abs() < 1e-12);
    assert!(
        (taxi.total_reward - (20.0 - (taxi.steps - 1.0))).abs() < 1e-9,
        "nothing but steps is paid for"
    );
    assert!((taxi.total_reward - 7.93).abs() < 1e-9, "{taxi:?}");
    for length in [2, 5, 30] {
        let plan = toys::chain(length)
            .unwrap()
            .model()
            .value_iteration(0.9, 1e-14)
            .unwrap();
        for state in 0..length - 1 {
            let wanted = 0.9f64.powi((length - 2 - state) as i32);
            assert!((plan.table.max(State(state)) - wanted).abs() < 1e-12);
        }
    }
}

#[test]
fn policy_iteration_finds_what_value_iteration_finds() {
    for toy in [
        toys::frozen_lake(&toys::FROZEN_LAKE_8X8, true).unwrap(),
        toys::cliff_walking().unwrap(),
        toys::taxi().unwrap(),
    ] {
        let (model, gamma) = (toy.model(), 0.95);
        let by_value = model.value_iteration(gamma, 1e-11).unwrap();
        let by_policy = model.policy_iteration(gamma, 1e-11).unwrap();
        let values = model
            .evaluate(&by_policy.table.greedy(), gamma, 1e-11)
            .unwrap();
        for (state, value) in values.into_iter().enumerate() {
            assert!((by_value.table.max(State(state)) - value).abs() < 1e-8);
            assert!((by_policy.table.max(State(state)) - value).abs() < 1e-8);
        }
    }
}

#[test]
fn impossible_toys_are_refused() {
    assert!(matches!(
        toys::frozen_lake(&["SF", "G"], false),
        Err(Error::WrongLength { .. })
    ));
    assert!(matches!(
        toys::frozen_lake(&[], false),
        Err(Error::EmptyShape { .. })
    ));
    assert!(matches!(
        toys::frozen_lake(&["FG"], false),
        Err(Error::Setting { .. })
    ));
    assert_eq!(
        toys::frozen_lake(&["SF", "XG"], false),
        Err(Error::MapLetter {
            letter: 'X',
            row: 1,
            column: 0
        })
    );
    assert!(matches!(
        toys::frozen_lake(&["Sé", "G"], false),
        Err(Error::MapLetter { letter: 'é', .. })
    ));
    assert!(matches!(toys::chain(1), Err(Error::Setting { .. })));
    assert_eq!(toys::taxi().unwrap().states(), 500);
}

#[test]
fn an_action_out_of_range_never_reads_another_state() {
    let lake = toys::frozen_lake(&toys::FROZEN_LAKE_4X4, true).unwrap();
    for action in [4, 5, usize::MAX] {
        assert!(!lake.allows(State(0), Action(action)));
        let read =
            std::panic::catch_unwind(|| lake.model().outcomes(State(0), Action(action)).len());
        assert!(read.is_err(), "{read:?}");
        let stepped = std::panic::catch_unwind(|| {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(0);
            lake.clone().step(Action(action), &mut rng)
        });
        assert!(stepped.is_err(), "{stepped:?}");
    }
    assert!(!lake.allows(State(16), Action(0)));
    assert!(
        lake.allows(State(15), Action(3)) && lake.model().outcomes(State(15), Action(3)).len() == 1
    );
}
