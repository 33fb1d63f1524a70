//! Learning that goes on at work.

use grasp_agent::{Agent, CameraModel, EventKind, EventLog, Learned, OnlineLearning};

use crate::cell::{Fault, Shared, agent_of, config, learned};

fn some_runs(agent: &mut Agent<Learned>, log: &mut EventLog) {
    for run in 0..10 {
        let ball = [0.6, 0.03 * f64::from(run) - 0.15, -0.1];
        let cell = Shared::new(CameraModel::paper(), ball, Fault::None);
        cell.run(agent, log).unwrap();
    }
}

#[test]
fn learning_goes_on_within_the_limits_until_it_is_frozen() {
    let new = learned;
    let settings = OnlineLearning {
        temperature: 10.0,
        ..OnlineLearning::careful(5)
    };
    let mut agent = agent_of(new().learning(settings).unwrap());
    let mut log = EventLog::default();
    some_runs(&mut agent, &mut log);
    let moved = |event: &&grasp_agent::RunEvent<'_>| matches!(event.kind, EventKind::Moved(_));
    assert!(log.events.iter().filter(moved).count() > 100);
    assert!(
        log.events
            .iter()
            .filter(moved)
            .all(|event| config().limits.admit(&event.joints))
    );
    let learned = agent.into_controller();
    assert!(*learned.centering().table() != *new().centering().table());
    assert!(*learned.approaching().table() != *new().approaching().table());

    // The same seed learns the same.
    let mut again = agent_of(new().learning(settings).unwrap());
    some_runs(&mut again, &mut EventLog::default());
    assert!(again.controller().approaching() == learned.approaching());

    let before = learned.approaching().clone();
    let mut frozen = agent_of(learned.frozen());
    some_runs(&mut frozen, &mut EventLog::default());
    assert!(*frozen.controller().approaching() == before);
}

#[test]
fn a_loop_breaker_that_is_none_counts_as_0() {
    let learned = learned();
    for kappa in [f64::INFINITY, f64::NAN, -1.0] {
        assert_eq!(learned.clone().with_kappa(kappa, 7.0).kappa(), (0.0, 7.0));
    }
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let learned = learned();
    type Set = fn(&mut OnlineLearning, f64);
    let cases: [(&str, Set, [f64; 5]); 3] = [
        (
            "gamma",
            |s, v| s.gamma = v,
            [1.0, 1.5, -0.1, f64::NAN, f64::INFINITY],
        ),
        (
            "alpha",
            |s, v| s.alpha = v,
            [1.1, 2.0, -0.1, f64::NAN, f64::INFINITY],
        ),
        (
            "temperature",
            |s, v| s.temperature = v,
            [0.0, 1e7, -1.0, f64::NAN, f64::INFINITY],
        ),
    ];
    for (name, set, values) in cases {
        for value in values {
            let mut settings = OnlineLearning::careful(3);
            set(&mut settings, value);
            let refused = learned.clone().learning(settings).unwrap_err().to_string();
            assert!(refused.contains(name), "{value}: {refused}");
        }
    }
}
