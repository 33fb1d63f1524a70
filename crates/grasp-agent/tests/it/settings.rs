//! Settings that cannot work are refused where they are used, with the reason.

use grasp_agent::qtable::QTable;
use grasp_agent::{Behaviour, BehaviourPair, BehaviourSpec, HybridSettings, ServoSettings};

/// A change of settings, and what is said of it.
type Case<T> = (fn(&mut T), &'static str);

fn refused<T: Clone>(
    settings: &T,
    check: impl Fn(T) -> Result<(), grasp_agent::BehaviourError>,
    cases: &[Case<T>],
) {
    assert!(check(settings.clone()).is_ok());
    for (change, said) in cases {
        let mut changed = settings.clone();
        change(&mut changed);
        let refused = check(changed).unwrap_err().to_string();
        assert!(refused.contains(said), "{refused} does not say {said}");
    }
}

#[test]
fn settings_that_cannot_work_are_refused_with_the_reason() {
    refused(
        &HybridSettings::paper(),
        |settings| settings.check(),
        &[
            (|s| s.drift = -1.0, "drift is -1"),
            (|s| s.grip[1] = f64::NAN, "a turn of grip is NaN"),
            (|s| s.steps[1] = 0.0, "longest step of JT2 is 0"),
            (|s| s.goal.r = -33.0, "radius of the goal is -33"),
            (|s| s.prior.turn = 0.0, "prior is 0"),
            (|s| s.nominal.focal = 0.0, "focal length is 0"),
        ],
    );
    refused(
        &ServoSettings::paper(),
        |settings| settings.check(),
        &[
            (|s| s.gain = 0.0, "gain is 0"),
            (|s| s.model.ball_radius = 0.0, "radius of the ball is 0"),
            (
                |s| s.model.mount.rotation.as_mut_unchecked().i = 2.0,
                "unit quaternion",
            ),
        ],
    );
    let BehaviourPair { centering, .. } = BehaviourPair::paper_mended();
    let joined = |spec: BehaviourSpec| {
        let table = QTable::new(42, 9).unwrap();
        Behaviour::new(spec, table).map(drop)
    };
    refused(
        &centering,
        joined,
        &[
            (|s| s.inputs.truncate(1), "1 inputs"),
            (|s| s.goal[0].low = 500.0, "goal of X is from 500"),
            (|s| s.moves[0].degrees.clear(), "JT1 has no steps"),
            (|s| s.reward.floor = -1.0, "floor of its reward is -1"),
        ],
    );
}
