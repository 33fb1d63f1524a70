//! The driver: its records, its end, its errors.

use std::ops::ControlFlow;

use qtable::{
    Action, EpsilonGreedy, Error, Policy, QLearning, QTable, Schedule, State, Status, Training,
    Until, check_env, evaluate, toys,
};
use rand::Rng;

use crate::support::{Settings, constant, odd, rng, step};

#[test]
fn the_learning_curve_counts_what_happened() {
    // Episodes of 3 steps that pay 1, 1 and 4, and end in success every other time.
    let mut environment = odd(|n| match n % 6 {
        3 => step(2, 4.0, Status::Terminated),
        0 => step(2, 4.0, Status::Truncated),
        _ => step(1, 1.0, Status::Continuing),
    });
    let settings = Settings {
        record_every: 12,
        ..Settings::new(30)
    };
    let mut training = settings
        .begin(&environment, QTable::new(3, 2).unwrap())
        .unwrap();
    let mut told = Vec::new();
    let stopped = training.run_with(
        &mut environment,
        Until::Actions(30),
        &mut rng(1),
        |record, _| {
            told.push(*record);
            ControlFlow::Continue(())
        },
    );
    assert_eq!(stopped, Ok(false));
    assert_eq!((training.actions(), training.episodes()), (30, 10));
    assert_eq!(told, training.curve());
    assert_eq!(
        told.iter().map(|record| record.actions).collect::<Vec<_>>(),
        [12, 24]
    );
    let table = training.table();
    let first = training.curve()[0];
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
    let settings = Settings {
        episode_limit: 5,
        ..Settings::new(20_000)
    };
    let trained = |environment: &mut dyn qtable::Environment| {
        settings.run(environment).unwrap().into_parts().0
    };
    let table = trained(&mut environment);
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
    assert!(trained(&mut ends).max(State(0)) < 5.0);
}

#[test]
fn faults_of_the_environment_are_named() {
    let settings = Settings::new(100);
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
        let error = settings.run(&mut faulty()).unwrap_err();
        assert!(is_it(&error), "{error}");
        let error = check_env(&mut faulty(), 100, 1).unwrap_err();
        assert!(is_it(&error), "{error}");
    }
    let mut outside = odd(|_| step(3, 0.0, Status::Continuing));
    let (state, states) = (State(3), 3);
    let refused = settings.run(&mut outside).unwrap_err();
    assert_eq!(refused, Error::StateOutOfRange { state, states });
    let small = settings.begin(&outside, QTable::new(2, 2).unwrap());
    assert!(matches!(
        small,
        Err(Error::ShapeMismatch {
            found_states: 3,
            states: 2,
            ..
        })
    ));
    let new = || Settings::new(100);
    for settings in [
        Settings {
            episode_limit: 0,
            ..new()
        },
        Settings {
            record_every: 0,
            ..new()
        },
        Settings {
            gamma: -0.1,
            ..new()
        },
        Settings {
            alpha: constant(2.0),
            ..new()
        },
        Settings {
            temperature: constant(0.0),
            ..new()
        },
    ] {
        let error = settings
            .run(&mut odd(|_| step(0, 0.0, Status::Continuing)))
            .unwrap_err();
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
fn a_choice_outside_the_table_is_refused() {
    let mut chain = toys::chain(4).unwrap();
    let learner = QLearning::new(constant(0.5), 0.9).unwrap();
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
    let learner = QLearning::new(constant(0.5), 0.9).unwrap();
    let policy = EpsilonGreedy::new(constant(0.3)).unwrap();
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
            |record, training| {
                assert_eq!(training.table().actions(), 2);
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
    let parts = training.into_parts();
    assert_eq!(parts.0.states(), 5);
}

#[test]
fn settings_changed_on_the_way_leave_the_counters_alone() {
    let mut chain = toys::chain(9).unwrap();
    let learner = QLearning::new(constant(0.5), 0.9).unwrap();
    let policy = EpsilonGreedy::new(constant(1.0)).unwrap();
    let table = QTable::new(9, 2).unwrap();
    let mut training = Training::new(&chain, table, learner, policy).unwrap();
    let mut rng = rng(3);
    training
        .run(&mut chain, Until::Actions(1_503), &mut rng)
        .unwrap();
    let (before, episodes) = (training.clone(), training.episodes());
    assert!(training.is_in_episode() && episodes > 3);
    let same = training.with_episode_limit(u64::MAX).unwrap();
    let same = same.with_record_every(1_000).unwrap();
    assert_eq!(same, before);
    training = same.with_episode_limit(20).unwrap();
    training = training.with_record_every(600).unwrap();
    assert_eq!((training.actions(), training.episodes()), (1_503, episodes));
    assert!(training.is_in_episode() && training.curve() == before.curve());
    training
        .run(&mut chain, Until::Actions(1_600), &mut rng)
        .unwrap();
    // 600 actions after the record at 1000.
    let record = training.curve().last().unwrap();
    assert_eq!((training.curve().len(), record.actions), (2, 1_600));
    let (limit, every) = (
        training.clone().with_episode_limit(0),
        training.with_record_every(0),
    );
    assert!(limit.is_err() && every.is_err());
}

#[test]
fn an_episode_given_up_is_not_counted() {
    let mut environment = odd(|_| step(1, 1.0, Status::Continuing));
    let table = QTable::new(3, 2).unwrap();
    let mut training = Settings::new(100).begin(&environment, table).unwrap();
    training
        .run(&mut environment, Until::Actions(7), &mut rng(0))
        .unwrap();
    assert!(training.is_in_episode());
    training.end_episode();
    assert_eq!((training.is_in_episode(), training.episodes()), (false, 0));
}

/// A policy that tells how often it was told that an episode begins.
#[derive(Default)]
struct Counting(u32);

impl Policy for Counting {
    fn choose(&mut self, _table: &QTable, _state: State, _rng: &mut dyn Rng) -> Action {
        Action(0)
    }
    fn begin_episode(&mut self) {
        self.0 += 1;
    }
}

#[test]
fn schedules_by_episode_see_every_episode() {
    // Episodes of three steps.
    let mut environment = odd(|n| match n % 3 {
        0 => step(2, 1.0, Status::Terminated),
        _ => step(1, 0.0, Status::Continuing),
    });
    let table = || QTable::new(3, 2).unwrap();
    let learner = QLearning::new(constant(0.5), 0.9).unwrap();
    let mut counted =
        Training::new(&environment, table(), learner.clone(), Counting::default()).unwrap();
    counted
        .run(&mut environment, Until::Episodes(5), &mut rng(0))
        .unwrap();
    assert_eq!(counted.policy().0, 5);

    let epsilon = Schedule::linear(1.0, 0.0, 10).unwrap().by_episode();
    let policy = EpsilonGreedy::new(epsilon).unwrap();
    let mut training = Training::new(&environment, table(), learner, policy).unwrap();
    for (episodes, epsilon) in [(1, 1.0), (2, 0.9), (6, 0.5), (11, 0.0), (20, 0.0)] {
        training
            .run(&mut environment, Until::Episodes(episodes), &mut rng(0))
            .unwrap();
        assert!((training.policy().epsilon() - epsilon).abs() < 1e-12);
    }
    *training.policy_mut() = EpsilonGreedy::new(constant(0.25)).unwrap();
    assert!((training.policy().epsilon() - 0.25).abs() < 1e-12);
}
