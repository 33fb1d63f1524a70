//! The drivers: what they report, when they stop, and what they refuse.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on should fail")]

mod odd;

use std::ops::ControlFlow;

use odd::{odd, rng, step, trained};
use qtable::{
    Action, EnvironmentFault, EpsilonGreedy, Error, Policy, QLearning, QTable, Schedule, State,
    Status, TrainConfig, Training, Until, check_env, evaluate, toys, train, train_in_blocks,
};
use rand::Rng;

#[test]
fn the_learning_curve_counts_what_happened() {
    // Episodes of 3 steps that pay 1, 1 and 4, and end in success every other time.
    let mut environment = odd(|n| match n % 6 {
        3 => step(2, 4.0, Status::Terminated),
        0 => step(2, 4.0, Status::Truncated),
        _ => step(1, 1.0, Status::Continuing),
    });
    let mut table = QTable::new(3, 2).unwrap();
    let config = TrainConfig {
        record_every: 12,
        ..TrainConfig::paper(30)
    };
    let mut told = Vec::new();
    let report = train(
        &mut environment,
        &mut table,
        &config,
        &mut rng(1),
        &mut |progress| {
            told.push((progress.actions, progress.of, progress.latest));
        },
    )
    .unwrap();
    assert_eq!(
        (report.actions, report.episodes, report.curve.len()),
        (30, 10, 3)
    );
    assert_eq!(
        told.iter().map(|t| (t.0, t.1)).collect::<Vec<_>>(),
        [(12, 30), (24, 30), (30, 30)]
    );
    assert_eq!(told.iter().map(|t| t.2).collect::<Vec<_>>(), report.curve);
    let first = report.curve[0];
    assert_eq!((first.actions, first.episodes), (12, 4));
    for (found, wanted) in [
        (first.success_share, 0.5),
        (first.mean_reward, 2.0),
        (first.mean_return, 6.0),
        (first.mean_steps, 3.0),
    ] {
        assert!((found.unwrap() - wanted).abs() < 1e-12, "{first:?}");
    }
    assert!(first.mean_td_error.unwrap() > 0.0);
    let visits: u32 = (0..3)
        .flat_map(|s| table.visit_row(State(s)).to_vec())
        .sum();
    assert_eq!(visits, 30);
}

#[test]
fn the_episode_limit_truncates_and_the_value_goes_on() {
    // One action forever, 1 a step: worth 1 / (1 - 0.9), whatever the limit.
    let mut environment = odd(|_| step(0, 1.0, Status::Continuing));
    let config = TrainConfig {
        episode_limit: 5,
        ..TrainConfig::paper(20_000)
    };
    let table = trained(&mut environment, &config).unwrap();
    assert!(
        (table.max(State(0)) - 10.0).abs() < 1e-3,
        "{}",
        table.max(State(0))
    );
    let mut ends = odd(|n| {
        step(
            0,
            1.0,
            if n % 5 == 0 {
                Status::Terminated
            } else {
                Status::Continuing
            },
        )
    });
    assert!(trained(&mut ends, &config).unwrap().max(State(0)) < 5.0);
}

#[test]
fn faults_of_the_environment_are_named() {
    let config = TrainConfig::paper(100);
    for reward in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let faulty = || odd(|n| step(1, if n == 7 { reward } else { 1.0 }, Status::Continuing));
        let is_it = |error: &Error| match error {
            Error::RewardNotFinite {
                state: State(1),
                reward: found,
                ..
            } => found.to_bits() == reward.to_bits(),
            _ => false,
        };
        let error = trained(&mut faulty(), &config).unwrap_err();
        assert!(is_it(&error), "{error}");
        let fault = check_env(&mut faulty(), 100, 1).unwrap_err();
        assert!(
            matches!(&fault, EnvironmentFault::Invalid { steps: 0, error } if is_it(error)),
            "{fault}"
        );
    }
    let mut outside = odd(|_| step(3, 0.0, Status::Continuing));
    assert_eq!(
        trained(&mut outside, &config).unwrap_err(),
        Error::StateOutOfRange {
            state: State(3),
            states: 3
        }
    );
    let mut small = QTable::new(2, 2).unwrap();
    let wrong = train(&mut outside, &mut small, &config, &mut rng(0), &mut |_| {}).unwrap_err();
    assert!(matches!(
        wrong,
        Error::ShapeMismatch {
            found_states: 3,
            states: 2,
            ..
        }
    ));
    for config in [
        TrainConfig {
            actions: 0,
            ..config.clone()
        },
        TrainConfig {
            episode_limit: 0,
            ..config.clone()
        },
        TrainConfig {
            record_every: 0,
            ..config.clone()
        },
        TrainConfig {
            gamma: -0.1,
            ..config.clone()
        },
        TrainConfig {
            alpha: Schedule::constant(2.0).unwrap(),
            ..config.clone()
        },
        TrainConfig {
            temperature: Schedule::constant(0.0).unwrap(),
            ..config.clone()
        },
    ] {
        let error = trained(&mut odd(|_| step(0, 0.0, Status::Continuing)), &config).unwrap_err();
        assert!(
            matches!(error, Error::Setting { .. } | Error::ScheduleRange { .. }),
            "{error}"
        );
    }
}

/// A policy that chooses what is not there.
struct Wild;

impl Policy for Wild {
    fn choose(&mut self, _table: &QTable, _state: State, _rng: &mut dyn Rng) -> Action {
        Action(9)
    }
}

#[test]
fn a_policy_that_chooses_outside_the_table_is_refused_before_the_environment_sees_it() {
    let mut chain = toys::chain(4).unwrap();
    let learner = QLearning::new(Schedule::constant(0.5).unwrap(), 0.9).unwrap();
    let mut training = Training::new(&chain, QTable::new(4, 2).unwrap(), learner, Wild).unwrap();
    let refused = training.run(&mut chain, Until::Actions(5), &mut rng(0));
    assert_eq!(
        refused,
        Err(Error::ActionOutOfRange {
            action: Action(9),
            actions: 2
        })
    );
    let table = QTable::new(4, 2).unwrap();
    assert!(evaluate(&mut chain, &table, &mut Wild, 1, 10, &mut rng(0)).is_err());
}

#[test]
fn a_run_stops_where_it_is_told() {
    let mut chain = toys::chain(5).unwrap();
    let learner = QLearning::new(Schedule::constant(0.5).unwrap(), 0.9).unwrap();
    let policy = EpsilonGreedy::new(Schedule::constant(0.3).unwrap()).unwrap();
    let table = QTable::new(5, 2).unwrap();
    let mut training = Training::new(&chain, table, learner, policy)
        .unwrap()
        .with_record_every(10)
        .unwrap();
    let mut rng = rng(3);
    training
        .run(&mut chain, Until::Episodes(7), &mut rng)
        .unwrap();
    assert_eq!((training.episodes(), training.is_in_episode()), (7, false));
    let so_far = training.actions();
    training
        .run(&mut chain, Until::Actions(so_far), &mut rng)
        .unwrap();
    assert_eq!(training.actions(), so_far);
    let stopped = training
        .run_with(
            &mut chain,
            Until::Actions(100_000),
            &mut rng,
            |record, table| {
                assert_eq!(table.actions(), 2);
                if record.actions >= so_far + 500 {
                    ControlFlow::Break(())
                } else {
                    ControlFlow::Continue(())
                }
            },
        )
        .unwrap();
    let reached = training.actions();
    assert!(
        stopped && reached.is_multiple_of(10) && (so_far + 500..so_far + 510).contains(&reached)
    );
    assert_eq!(training.curve().len() as u64, reached / 10);
    let more: Vec<_> = training
        .records(&mut chain, Until::Actions(reached + 45), &mut rng)
        .collect();
    assert_eq!((more.len(), training.actions()), (4, reached + 45));
    assert!(more.iter().all(Result::is_ok));
}

#[test]
fn settings_changed_on_the_way_leave_the_counters_alone() {
    let mut chain = toys::chain(9).unwrap();
    let learner = QLearning::new(Schedule::constant(0.5).unwrap(), 0.9).unwrap();
    let policy = EpsilonGreedy::new(Schedule::constant(1.0).unwrap()).unwrap();
    let table = QTable::new(9, 2).unwrap();
    let mut training = Training::new(&chain, table, learner, policy).unwrap();
    let mut rng = rng(3);
    training
        .run(&mut chain, Until::Actions(1_503), &mut rng)
        .unwrap();
    let (before, episodes) = (training.clone(), training.episodes());
    assert!(training.is_in_episode() && episodes > 3);
    let mut training = training
        .with_episode_limit(u64::MAX)
        .unwrap()
        .with_record_every(1_000)
        .unwrap();
    assert_eq!(training, before);
    training = training
        .with_episode_limit(20)
        .unwrap()
        .with_record_every(100)
        .unwrap();
    assert_eq!((training.actions(), training.episodes()), (1_503, episodes));
    assert!(training.is_in_episode() && training.curve() == before.curve());
    training
        .run(&mut chain, Until::Actions(1_600), &mut rng)
        .unwrap();
    let record = training.curve().last().unwrap();
    assert_eq!((training.curve().len(), record.actions), (2, 1_600));
    assert!(
        training.clone().with_episode_limit(0).is_err() && training.with_record_every(0).is_err()
    );
}

#[test]
fn more_blocks_than_actions_are_as_many_as_actions() {
    let run = |blocks| {
        let mut table = QTable::<f32>::filled(6, 2, 0.0).unwrap();
        let config = TrainConfig::paper(300);
        let chain = &mut toys::chain(6).unwrap();
        train_in_blocks(chain, &mut table, &config, blocks, &mut rng(4), &mut |_| {}).unwrap();
        table.to_csv()
    };
    assert_eq!(run(u64::MAX), run(300));
}

#[test]
fn plateaus_at_the_ends_of_a_range_are_trained_on() {
    for level in [1e-6, 1e6] {
        for temperature in [
            Schedule::linear(level, level, 1_000),
            Schedule::exponential(level, level, 1_000),
            Schedule::piecewise(&[(0, level), (999, level)]),
        ] {
            let config = TrainConfig {
                temperature: temperature.unwrap(),
                alpha: Schedule::linear(1.0, 1.0, 997).unwrap(),
                ..TrainConfig::paper(1_000)
            };
            let mut table = QTable::<f32>::filled(6, 2, 0.0).unwrap();
            let chain = &mut toys::chain(6).unwrap();
            train_in_blocks(chain, &mut table, &config, 1_000, &mut rng(4), &mut |_| {}).unwrap();
            assert!(trained(chain, &config).is_ok());
        }
    }
}
