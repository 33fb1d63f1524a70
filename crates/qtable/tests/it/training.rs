//! The driver: its records, its end, its errors.

use std::ops::ControlFlow;

use qtable::*;
use rand::Rng;

use crate::support::{Settings, constant, epsilon, odd, q_learning, rng, step, trained, zeros};

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
    let mut training = settings.begin(&environment, zeros(3, 2)).unwrap();
    let (mut told, until) = (Vec::new(), Until::Actions(30));
    let stopped = training.run_with(&mut environment, until, &mut rng(1), |record, _| {
        told.push(*record);
        ControlFlow::Continue(())
    });
    assert_eq!(stopped, Ok(false));
    assert_eq!((training.actions(), training.episodes()), (30, 10));
    assert_eq!(told, training.curve());
    let [first, second] = told[..] else {
        panic!("{told:?}");
    };
    assert_eq!((first.actions, first.episodes, second.actions), (12, 4, 24));
    for (found, wanted) in [
        (first.success_share, 0.5),
        (first.mean_reward, 2.0),
        (first.mean_return, 6.0),
        (first.mean_steps, 3.0),
    ] {
        assert_near!(found.unwrap(), wanted, 1e-12);
    }
    assert!(first.mean_td_error.unwrap() > 0.0);
    let visits = (0..3).flat_map(|s| training.table().visit_row(State(s)).to_vec());
    assert_eq!(visits.sum::<u32>(), 30);
}

#[test]
fn the_episode_limit_truncates_and_the_value_goes_on() {
    let settings = Settings {
        episode_limit: 5,
        ..Settings::new(20_000)
    };
    let value = |mut environment: &mut dyn Environment| {
        settings
            .run(&mut environment)
            .unwrap()
            .table()
            .max(State(0))
    };
    // One action forever, 1 a step: worth 1 / (1 - 0.9), whatever the limit.
    assert_near!(
        value(&mut odd(|_| step(0, 1.0, Status::Continuing))),
        10.0,
        1e-3
    );
    let mut ends = odd(|n| match n % 5 {
        0 => step(0, 1.0, Status::Terminated),
        _ => step(0, 1.0, Status::Continuing),
    });
    assert!(value(&mut ends) < 5.0);
}

#[test]
fn faults_of_the_environment_are_named() {
    let settings = Settings::new(100);
    for reward in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let faulty = || odd(|n| step(1, if n == 7 { reward } else { 1.0 }, Status::Continuing));
        let errors = [
            settings.run(&mut faulty()).unwrap_err(),
            check_env(&mut faulty(), 100, 1).unwrap_err(),
        ];
        for error in errors {
            let Error::NotFinite {
                what, state, value, ..
            } = error
            else {
                panic!("{error}");
            };
            assert_eq!((what, state), ("reward", State(1)));
            assert_eq!(value.to_bits(), reward.to_bits());
        }
    }
    let mut outside = odd(|_| step(3, 0.0, Status::Continuing));
    let refused = settings.run(&mut outside).unwrap_err();
    assert_eq!(refused.to_string(), "state 3 is outside 0..3");
    let small = settings.begin(&outside, zeros(2, 2)).unwrap_err();
    let text = "the environment has 3 states and 2 actions, but 2 and 2 are needed";
    assert_eq!(small.to_string(), text);
    let new = || Settings::new(100);
    let settings: [fn(&mut Settings); 5] = [
        |of| of.episode_limit = 0,
        |of| of.record_every = 0,
        |of| of.gamma = -0.1,
        |of| of.alpha = constant(2.0),
        |of| of.temperature = constant(0.0),
    ];
    for change in settings {
        let mut changed = new();
        change(&mut changed);
        let run = changed.run(&mut odd(|_| step(0, 0.0, Status::Continuing)));
        assert_refused!(run, Error::Setting { .. });
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
    let mut chain = ModelEnvironment::chain(4).unwrap();
    let learner = q_learning(0.5, 0.9);
    let mut training = Training::new(&chain, zeros(4, 2), learner, Wild).unwrap();
    let refused = training.run(&mut chain, Until::Actions(5), &mut rng(0));
    let wild = Error::OutOfRange {
        what: "action",
        index: 9,
        count: 2,
    };
    assert_eq!(refused, Err(wild.clone()));
    let tried = evaluate(&mut chain, &zeros(4, 2), &mut Wild, 1, 10, &mut rng(0));
    assert_eq!(tried, Err(wild));
}

#[test]
fn a_run_stops_where_it_is_told() {
    let mut chain = ModelEnvironment::chain(5).unwrap();
    let training = Training::new(&chain, zeros(5, 2), q_learning(0.5, 0.9), epsilon(0.3));
    let mut training = training.unwrap().with_record_every(10).unwrap();
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
    let until = Until::Actions(100_000);
    let stopped = training.run_with(&mut chain, until, &mut rng, |record, training| {
        assert_eq!(training.table().actions(), 2);
        match record.actions >= so_far + 500 {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    });
    let reached = training.actions();
    assert_eq!((stopped, reached % 10), (Ok(true), 0));
    assert!((so_far + 500..so_far + 510).contains(&reached));
    assert_eq!(training.curve().len() as u64, reached / 10);
    assert_eq!(training.into_parts().0.states(), 5);
}

#[test]
fn settings_changed_on_the_way_leave_the_counters_alone() {
    let mut chain = ModelEnvironment::chain(9).unwrap();
    let learner = q_learning(0.5, 0.9);
    let before = Training::new(&chain, zeros(9, 2), learner, epsilon(1.0));
    let (mut before, mut rng) = (before.unwrap(), rng(3));
    before
        .run(&mut chain, Until::Actions(1_503), &mut rng)
        .unwrap();
    assert!(before.is_in_episode() && before.episodes() > 3);
    let same = before.clone().with_episode_limit(u64::MAX).unwrap();
    let same = same.with_record_every(1_000).unwrap();
    assert_eq!(same, before);
    let changed = same.with_episode_limit(20).unwrap();
    let mut changed = changed.with_record_every(600).unwrap();
    let counters = |of: &Training<_, _>| (of.actions(), of.episodes(), of.is_in_episode());
    assert_eq!(counters(&changed), counters(&before));
    assert_eq!(changed.curve(), before.curve());
    changed
        .run(&mut chain, Until::Actions(1_600), &mut rng)
        .unwrap();
    // 600 actions after the record at 1000.
    let record = changed.curve().last().unwrap();
    assert_eq!((changed.curve().len(), record.actions), (2, 1_600));
    assert!(changed.clone().with_episode_limit(0).is_err());
    assert!(changed.with_record_every(0).is_err());
}

#[test]
fn an_episode_given_up_is_not_counted() {
    let mut environment = odd(|_| step(1, 1.0, Status::Continuing));
    let learner = q_learning(0.5, 0.9);
    let mut training = trained(&mut environment, zeros(3, 2), learner, Greedy, (60, 7, 0));
    assert!(training.is_in_episode());
    training.end_episode();
    assert_eq!((training.is_in_episode(), training.episodes()), (false, 0));
}

#[test]
fn schedules_by_episode_see_every_episode() {
    // Episodes of three steps.
    let mut environment = odd(|n| match n % 3 {
        0 => step(2, 1.0, Status::Terminated),
        _ => step(1, 0.0, Status::Continuing),
    });
    let falling = Schedule::linear(1.0, 0.0, 10).unwrap().by_episode();
    let policy = EpsilonGreedy::new(falling).unwrap();
    let learner = q_learning(0.5, 0.9);
    let mut training = Training::new(&environment, zeros(3, 2), learner, policy).unwrap();
    for (episodes, wanted) in [(1, 1.0), (2, 0.9), (6, 0.5), (11, 0.0), (20, 0.0)] {
        let until = Until::Episodes(episodes);
        training.run(&mut environment, until, &mut rng(0)).unwrap();
        assert_near!(training.policy().epsilon(), wanted, 1e-12);
    }
    *training.policy_mut() = epsilon(0.25);
    assert_near!(training.policy().epsilon(), 0.25, 1e-12);
}
