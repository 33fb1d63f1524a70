//! The toy problems: Gymnasium's dynamics and the optima that are known of them.

use std::collections::BTreeSet;
use std::fmt::Write;

use qtable::*;

use crate::support::rng;

fn lake(map: &str, slippery: bool) -> ModelEnvironment {
    ModelEnvironment::frozen_lake(map, slippery).unwrap()
}

fn cliff() -> ModelEnvironment {
    ModelEnvironment::cliff_walking().unwrap()
}

fn taxi() -> ModelEnvironment {
    ModelEnvironment::taxi().unwrap()
}

/// First states, then every outcome in every state that can be met, one a line.
fn listing(toy: &ModelEnvironment) -> (usize, String) {
    let mut met: BTreeSet<usize> = toy.start().iter().map(|(state, _)| state.0).collect();
    let mut open: Vec<usize> = met.iter().copied().collect();
    let model = toy.model();
    while let Some(state) = open.pop() {
        for action in (0..model.actions()).map(Action) {
            for outcome in model.outcomes(State(state), action) {
                if !outcome.terminated && met.insert(outcome.next.0) {
                    open.push(outcome.next.0);
                }
            }
        }
    }
    let mut text = String::new();
    let starts = toy.start().iter();
    let starts: BTreeSet<_> = starts
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

fn blackjack() -> ModelEnvironment {
    ModelEnvironment::blackjack().unwrap()
}

/// The checksums are those of the same listing made from `env.unwrapped.P` and
/// `initial_state_distrib` of Gymnasium 1.4.0 in Python. Blackjack has neither: its listing comes
/// from `env.step` with every sequence of cards, in exact fractions.
#[test]
fn the_dynamics_are_those_of_gymnasium() {
    for (name, toy, states, checksum) in [
        ("lake 4x4, slippery", lake("4x4", true), 11, 0x25c0_77c7),
        ("lake 4x4", lake("4x4", false), 11, 0x66bb_0791),
        ("lake 8x8, slippery", lake("8x8", true), 53, 0x8cd0_74e3),
        ("lake 8x8", lake("8x8", false), 53, 0xaf0a_d373),
        ("cliff", cliff(), 37, 0x2193_c14e),
        ("taxi", taxi(), 400, 0xdaa0_12b8),
        ("blackjack", blackjack(), 290, 0x3782_c344),
    ] {
        let (met, text) = listing(&toy);
        let found = (met, crc32fast::hash(text.as_bytes()));
        assert_eq!(found, (states, checksum), "{name}");
    }
}

#[test]
fn the_optima_are_the_known_ones() {
    let optimum = |toy: &ModelEnvironment, gamma, limit| {
        let plan = toy.model().value_iteration(gamma, 1e-12).unwrap();
        toy.assess(&plan.table.greedy(), gamma, limit).unwrap()
    };
    for (map, value, ever) in [
        ("4x4", 0.542_025_932_000_5, 14.0 / 17.0),
        ("8x8", 0.414_640_361_799_99, 1.0),
    ] {
        let lake = lake(map, true);
        assert_near!(optimum(&lake, 0.99, 100_000).value, value, 1e-9);
        assert_near!(optimum(&lake, 1.0, 100_000).success, ever, 1e-6);
    }
    let lake = optimum(&lake("4x4", false), 0.9, 100);
    assert_near!(lake.steps, 6.0, 1e-12);
    assert_near!(lake.value, 0.9f64.powi(5), 1e-12);
    let cliff = optimum(&cliff(), 1.0, 100);
    assert_near!(cliff.total_reward, -13.0, 1e-12);
    assert_near!(cliff.success, 1.0, 1e-12);
    let taxi = optimum(&taxi(), 1.0, 200);
    assert_near!(taxi.success, 1.0, 1e-12);
    // Nothing but steps is paid for.
    assert_near!(taxi.total_reward, 20.0 - (taxi.steps - 1.0), 1e-9);
    assert_near!(taxi.total_reward, 7.93, 1e-9);
    for length in [2, 5, 30] {
        let chain = ModelEnvironment::chain(length).unwrap();
        let plan = chain.model().value_iteration(0.9, 1e-14).unwrap();
        for state in 0..length - 1 {
            let wanted = 0.9f64.powi((length - 2 - state) as i32);
            assert_near!(plan.table.max(State(state)), wanted, 1e-12);
        }
    }
}

/// Figure 5.2 of Sutton and Barto: the lowest sum at which to stick, for each card of the dealer
/// from the ace to the ten.
#[test]
fn the_optimum_of_blackjack_is_that_of_the_book() {
    let game = blackjack();
    let plan = game.model().value_iteration(1.0, 1e-12).unwrap().table;
    let found = game.assess(&plan.greedy(), 1.0, 100).unwrap();
    assert_near!(found.total_reward, -0.043_113_105_413_477, 1e-12);
    for (ace, wanted) in [
        [17, 13, 13, 12, 12, 12, 17, 17, 17, 17],
        [19, 18, 18, 18, 18, 18, 18, 18, 19, 19],
    ]
    .into_iter()
    .enumerate()
    {
        for (card, lowest) in (1..).zip(wanted) {
            for sum in 12..=21 {
                let best = plan.best(State((sum * 11 + card) * 2 + ace));
                assert_eq!(
                    best,
                    Action(usize::from(sum < lowest)),
                    "{sum} {card} {ace}"
                );
            }
        }
    }
}

#[test]
fn policy_iteration_finds_what_value_iteration_finds() {
    for toy in [lake("8x8", true), cliff(), taxi()] {
        let (model, gamma) = (toy.model(), 0.95);
        let by_value = model.value_iteration(gamma, 1e-11).unwrap().table;
        let by_policy = model.policy_iteration(gamma, 1e-11).unwrap().table;
        let values = model.evaluate(&by_policy.greedy(), gamma, 1e-11).unwrap();
        for (state, value) in values.into_iter().enumerate() {
            assert_near!(by_value.max(State(state)), value, 1e-8);
            assert_near!(by_policy.max(State(state)), value, 1e-8);
        }
    }
}

#[test]
fn impossible_toys_are_refused() {
    let lake = |map| ModelEnvironment::frozen_lake(map, false);
    assert_refused!(lake("SF G"), Error::WrongLength { .. });
    assert_refused!(lake(""), Error::Shape { .. });
    assert_refused!(lake("FG"), Error::Setting { .. });
    assert_refused!(lake("SF\nXG"), Error::MapLetter('X', 1, 0));
    assert_refused!(lake("Sé G"), Error::MapLetter('é', ..));
    let text = lake("16x16").unwrap_err().to_string();
    assert!(text.contains("give 4x4, 8x8"), "{text}");
    assert_refused!(ModelEnvironment::chain(1), Error::Setting { .. });
    assert_eq!(taxi().states(), 500);
}

#[test]
fn an_action_out_of_range_never_reads_another_state() {
    let lake = lake("4x4", true);
    for action in [4, 5, usize::MAX].map(Action) {
        assert!(!lake.allows(State(0), action));
        let read = std::panic::catch_unwind(|| lake.model().outcomes(State(0), action).len());
        assert!(read.is_err(), "{read:?}");
        let stepped = std::panic::catch_unwind(|| lake.clone().step(action, &mut rng(0)));
        assert!(stepped.is_err(), "{stepped:?}");
    }
    assert!(!lake.allows(State(16), Action(0)) && lake.allows(State(15), Action(3)));
    assert_eq!(lake.model().outcomes(State(15), Action(3)).len(), 1);
}
