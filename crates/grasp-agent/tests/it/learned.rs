//! Learning that goes on at work.

use grasp_agent::qtable::QTable;
use grasp_agent::{
    Agent, Behaviour, BehaviourError, BehaviourSpec, CameraModel, EventKind, EventLog, Learned,
    OnlineLearning,
};

use crate::cell::{Fault, Shared, config};

fn blank(spec: BehaviourSpec) -> Behaviour {
    let table = QTable::new(spec.states(), spec.actions()).unwrap();
    Behaviour::new(spec, table).unwrap()
}

fn some_runs(agent: &mut Agent<Learned>, log: &mut EventLog) {
    for run in 0..10 {
        let ball = [0.6, 0.03 * f64::from(run) - 0.15, -0.1];
        let cell = Shared::new(CameraModel::paper(), ball, Fault::None);
        cell.run(agent, log).unwrap();
    }
}

#[test]
fn learning_goes_on_within_the_limits_until_it_is_frozen() {
    let new = || {
        Learned::new(
            blank(BehaviourSpec::centering()),
            blank(BehaviourSpec::approaching()),
        )
    };
    let settings = OnlineLearning::new(0.9, 0.1, 10.0, 5).unwrap();
    let mut agent = Agent::with_controller(config(), new().learning(settings)).unwrap();
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
    let mut again = Agent::with_controller(config(), new().learning(settings)).unwrap();
    some_runs(&mut again, &mut EventLog::default());
    assert!(again.controller().approaching() == learned.approaching());

    let before = learned.approaching().clone();
    let mut frozen = Agent::with_controller(config(), learned.frozen()).unwrap();
    some_runs(&mut frozen, &mut EventLog::default());
    assert!(*frozen.controller().approaching() == before);
}

#[test]
fn a_loop_breaker_that_is_none_counts_as_0() {
    let learned = Learned::new(
        blank(BehaviourSpec::centering()),
        blank(BehaviourSpec::approaching()),
    );
    for kappa in [f64::INFINITY, f64::NAN, -1.0] {
        assert_eq!(learned.clone().with_kappa(kappa, 7.0).kappa(), (0.0, 7.0));
    }
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let [gamma, alpha, temperature] = [0.9, 0.1, 0.3];
    let careful = OnlineLearning::new(gamma, alpha, temperature, 3).unwrap();
    assert_eq!(careful, OnlineLearning::careful(3));
    assert!(OnlineLearning::new(0.0, 1.0, 1e-6, 0).is_ok());
    let (nan, infinite) = (f64::NAN, f64::INFINITY);
    let refused =
        |gamma, alpha, temperature| match OnlineLearning::new(gamma, alpha, temperature, 0) {
            Err(BehaviourError::Learning { quantity, .. }) => quantity,
            other => panic!("{other:?}"),
        };
    for bad in [1.0, 1.5, -0.1, nan, infinite] {
        assert_eq!(refused(bad, alpha, temperature), "gamma", "{bad}");
    }
    for bad in [1.1, -0.1, nan, infinite] {
        assert_eq!(refused(gamma, bad, temperature), "alpha", "{bad}");
    }
    for bad in [0.0, -1.0, nan, infinite] {
        assert_eq!(refused(gamma, alpha, bad), "temperature", "{bad}");
    }
}

#[cfg(feature = "serde")]
#[test]
fn settings_are_validated_on_deserialization() {
    let careful = OnlineLearning::careful(3);
    let json = serde_json::to_string(&careful).unwrap();
    assert_eq!(
        serde_json::from_str::<OnlineLearning>(&json).unwrap(),
        careful
    );
    let refused = serde_json::from_str::<OnlineLearning>(&json.replace("0.9", "1.0")).unwrap_err();
    assert!(refused.to_string().contains("gamma"), "{refused}");
}
